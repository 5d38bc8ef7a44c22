"""The start of a scenario's runs: computed once, and copied by every world."""

from __future__ import annotations

from dataclasses import dataclass

from fireworld.city.city import City
from fireworld.kernels.arrays import CityArrays, Constants, WorldState
from fireworld.kernels.fire import ignite
from fireworld.kernels.outcome import assess
from fireworld.parameters import Parameters
from fireworld.rewards import Reward, reward_of
from fireworld.scenario.document import Choices
from fireworld.simulation.city_arrays import city_arrays, world_constants
from fireworld.simulation.placement import Placement
from fireworld.simulation.state import fresh_world


@dataclass(frozen=True)
class Start:
    """What all worlds of a scenario have in common, and the state each of them begins with; not to be changed."""

    city: City
    city_arrays: CityArrays
    constants: Constants
    state: WorldState


def prepare_start(
    city: City,
    parameters: Parameters,
    placement: Placement,
    *,
    reward: Reward | None = None,
    choices: Choices = "in-turn",
    unit_volume_m3: float | None = None,
    arrays: CityArrays | None = None,
) -> Start:
    """Place everybody in a city and set it on fire; arguments are named as in a scenario.

    A reward of None is the paper's; the city's arrays are built unless they are given.
    """
    arrays = arrays if arrays is not None else city_arrays(city, parameters.fire)
    reward = reward if reward is not None else reward_of("stock")
    constants = world_constants(city, parameters, reward=reward, choices=choices, unit_volume_m3=unit_volume_m3)
    state = fresh_world(city, parameters, placement)
    for building in placement.ignited.tolist():
        ignite(building, arrays.buildings, state.fire)
    assess(state.fire, state.civilians, arrays.geometry, constants.reward, state.outcome)
    state.outcome.reward[:] = 0.0  # the start is not rewarded
    return Start(city, arrays, constants, state)
