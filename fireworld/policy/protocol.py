"""What a policy is: something that sees an Observation and answers with a Decision."""

from __future__ import annotations

from abc import ABCMeta, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fireworld.kernels.allocation import named_range
from fireworld.kernels.arrays import CityArrays, Constants, WorldState
from fireworld.kernels.observation import find_named
from fireworld.kernels.ranking import N_OF_BUILDING, N_TARGET_FEATURES, OWN_TARGET, Sight
from fireworld.kernels.targets import describe_targets


class Action(IntEnum):
    """The paper's four actions, each of which names a burning building of the brigade's fire site; and a fifth."""

    EASIEST = 0
    """The one with the lowest temperature."""
    NEAREST_TO_CIVILIAN = 1
    NEAREST_TO_CENTER = 2
    NEAREST_TO_ME = 3
    OWN_TARGET = OWN_TARGET
    """Not in the paper: the burning building that the policy itself names, one of `Observation.burning`."""


@dataclass(frozen=True)
class Decision:
    """What one brigade does in one step, and why."""

    action: int
    target: int | None = None
    """With Action.OWN_TARGET: the index of a building, one of `Observation.burning`."""
    q_values: Sequence[float] | None = None
    """Values of the four actions, where the policy has them."""
    value: float | None = None
    """Value of the target, where the policy ranks targets."""
    explored: bool = False
    epsilon: float = 0.0


def named_target(brigade: int, action: int, city: CityArrays, world: WorldState, constants: Constants) -> int:
    """Return the building that one of the four actions names for a brigade, -1 without a site."""
    where = world.brigades, city.buildings, city.links, world.fire, city.geometry, world.sites
    return int(find_named(brigade, action, *where, constants.observation))


@dataclass(frozen=True)
class Observation:
    """What one brigade sees before it decides: the eight features, and on demand everything the team knows."""

    brigade: int
    step: int
    seed: int
    state_index: int
    """0..4319: mixed radix of the eight features."""
    free_edges: int
    """Sides of the fire site over which the fire can still spread, 0..4."""
    distance_from_center: int
    """0 low, 1 medium, 2 high."""
    distance_from_civilian: int
    """0 low, 1 medium, 2 high."""
    volume: int
    """Burning volume, 0 very low .. 5 huge."""
    others: tuple[bool, bool, bool, bool]
    """Whether another brigade does each of the four actions."""
    known_targets: NDArray[np.int32]
    """(b,) index of the building that each brigade goes for, -1 none: those before this one in this step, the others
    in the last step."""
    city: CityArrays
    """The city's arrays; not to be changed."""
    world: WorldState
    """The world's arrays as they are before the step; not to be changed."""
    constants: Constants
    """The scalars of the world's model."""

    @cached_property
    def targets(self) -> tuple[int, int, int, int]:
        """The building that each of the four actions names."""
        one, two, three, four = (
            named_target(self.brigade, action, self.city, self.world, self.constants) for action in range(4)
        )
        return one, two, three, four

    @cached_property
    def target_features(self) -> NDArray[np.float64]:
        """(4, 13) what the brigade sees of each of these targets, as rankings and networks do: docs/model.md, 7."""
        out = np.zeros((len(self.targets), N_TARGET_FEATURES))
        describe_targets(self.brigade, self.step, self.known_targets, self.sight, out)
        return out

    @property
    def sight(self) -> Sight:
        """What kernels take to value targets, with scratch of its own."""
        n = len(self.world.fire.energy)
        return Sight(
            self.city.buildings,
            self.city.links,
            self.city.geometry,
            self.city.streets,
            self.world.fire,
            self.world.brigades,
            self.world.sites,
            self.constants.fire,
            self.constants.brigades,
            np.zeros((n, N_OF_BUILDING)),
            np.full(n, -1),
        )

    @cached_property
    def burning(self) -> NDArray[np.uint32]:
        """(k,) indices of the burning buildings that the brigade may name as its own target.

        They are those of its fire site; with `brigades.allocation: free`, those of all sites.
        """
        sites, free = self.world.sites, self.constants.brigades.free
        first, end = named_range(self.brigade, self.world.brigades.site, sites, free)
        named: NDArray[np.uint32] = sites.member[first:end]
        return named

    @cached_property
    def temperature(self) -> NDArray[np.float64]:
        """(n,) degrees above ambient."""
        temperature: NDArray[np.float64] = self.world.fire.energy / self.city.buildings.capacity
        return temperature


class _HasDecide(ABCMeta):
    """Makes every object with a method `decide` an instance of Policy, whatever its class inherits."""

    def __instancecheck__(cls, instance: object) -> bool:
        """Return whether an object is a policy, or of a subclass of Policy."""
        if cls is Policy:
            return callable(getattr(instance, "decide", None))
        return super().__instancecheck__(instance)


class Policy(metaclass=_HasDecide):
    """Decides for every brigade, one after another in order of their numbers.

    The simplest policy is a class with a method, or a function with its body:

        class AlwaysNear:
            def decide(self, observation):
                return Action.NEAREST_TO_ME

    Inheriting from Policy is optional: it documents the other methods and types them. fireworld calls those that a
    class has and uses these defaults for the rest.
    """

    stateless: bool = False
    """True: decisions depend on the observation alone, not on earlier steps. Forks then skip the steps before."""
    digest: str = ""
    """What identifies the policy's behaviour, if its source does not: a digest of a model it reads, say. Text."""

    @abstractmethod
    def decide(self, observation: Observation) -> Decision | str | int:
        """Choose for one brigade: a Decision; or only an action, by its name or index."""

    def begin(self, city: CityArrays, n_brigades: int, seed: int) -> None:
        """Prepare for a run; called before its first step.

        Args:
            city: the city's arrays; not to be changed.
            n_brigades: brigades of the team.
            seed: of the run's random draws.
        """
        del city, n_brigades, seed

    def keeps(self, brigade: int, last_action: int, step: int) -> bool:
        """Return whether a brigade repeats its last action without being asked; never called if it has none."""
        del brigade, last_action, step
        return False
