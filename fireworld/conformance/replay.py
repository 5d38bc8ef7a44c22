"""Replay: the engine run on what went into a trace."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from fireworld.city.build import build_city, with_links, with_order
from fireworld.city.city import Array, City
from fireworld.city.formats.official.keys import BRIGADE_KEYS, BURN_KEYS, FIRE_KEYS, RAY_KEYS
from fireworld.conformance.city_file import CityFile, Placement, Request
from fireworld.conformance.trace import Trace
from fireworld.kernels.arrays import BrigadeState, CityArrays, FireState
from fireworld.kernels.brigades import ACCEPTED, UNKNOWN_BRIGADE, distance_square, judge_request, refill, spray
from fireworld.kernels.fire import advance_fire, ignite
from fireworld.kernels.warmth import fresh_warmth
from fireworld.parameters import BrigadeParameters, FireParameters
from fireworld.simulation.city_arrays import air_inside, brigade_constants, city_arrays, fire_constants
from fireworld.simulation.state import fresh_brigades, fresh_fire

RAY_SEED = 1
"""Seed of the random rays where a trace has no links."""


@dataclass(frozen=True)
class Moment:
    """The state after a step: outputs by their names in a trace. The arrays change with the next step."""

    step: int
    outputs: dict[str, Array]
    results: list[int]  # codes of the step's requests


def fire_parameters(trace: Trace) -> FireParameters:
    """Return the trace's parameters; TraceError if one is missing that its other arrays do not replace."""
    keys = dict(FIRE_KEYS)
    for group, needed in ((BURN_KEYS, trace.rates is None), (RAY_KEYS, trace.links is None)):
        if needed or trace.configuration.has(group):
            keys |= group
    fire = trace.configuration.parameters(FireParameters, keys)
    if trace.rates is None and fire.burn_rate_sd != 0.0:
        wanted = "this array to be there, because params say that burn rates vary"
        trace.arrays.refuse("burn_rate_draws", wanted, "a file without it")
    return fire


def prepare(city_file: CityFile, trace: Trace) -> tuple[City, City, FireParameters]:
    """Build the city as the trace's parameters want it.

    Returns the city as fireworld builds it, the same with the order and the links of the trace, and the parameters.
    """
    fire = fire_parameters(trace)
    named = replace(city_file.plan, name=city_file.where)  # what errors begin with
    own = build_city(named, fire, seed=RAY_SEED)
    city = own
    if trace.links is not None:
        city = with_links(city, ptr=trace.links.ptr, building=trace.links.building, share=trace.links.share)
    if trace.order is not None:
        city = with_order(city, trace.order)
    return own, city, fire


def replay(city_file: CityFile, trace: Trace, city: City, parameters: FireParameters) -> Iterator[Moment]:
    """Run the engine through all steps of a trace and yield the state after each, step 0 first."""
    inputs, fire_is = city_file.inputs, fire_constants(parameters)
    tables, fire = city_arrays(city, parameters), fresh_fire(city)
    warmth = fresh_warmth(city.n_buildings, fire.air.shape)
    crew = Crew(city_file, trace, tables, city) if inputs.brigade_id or inputs.requests else None
    rates = Rates(trace, city, parameters)
    for b in inputs.ignitions:
        ignite(b, tables.buildings, fire)
    yield _moment(0, city, fire, crew, [])
    for step in range(1, trace.n_steps + 1):
        for b in inputs.later_ignitions.get(step, ()):
            ignite(b, tables.buildings, fire)
        for b, litres in inputs.water.get(step, ()):
            fire.water[b] += litres
            fire.watered[b] = 1
        results = crew.act(step, fire) if crew is not None else []
        fire.rate[:] = rates.take(fire.fieryness, step)
        advance_fire(tables.buildings, tables.cover, tables.links, fire, fire_is, warmth)
        yield _moment(step, city, fire, crew, results)


def _moment(step: int, city: City, fire: FireState, crew: Crew | None, results: list[int]) -> Moment:
    """Collect the state under the names of a trace."""
    outputs = {
        "fieryness": fire.fieryness,
        "energy": fire.energy,
        "temperature": fire.energy / city.heat_capacity.astype(np.float64),
        "fuel": fire.fuel,
        "water": fire.water,
        "ever_watered": fire.watered,
        "air": air_inside(city, fire.air),
    }
    if crew is not None:
        outputs["tank"] = crew.team.tank
    return Moment(step, outputs, results)


class Rates:
    """The burn rates of a trace: in every step in which a building burns it takes the next of its list."""

    def __init__(self, trace: Trace, city: City, parameters: FireParameters) -> None:
        self._trace = trace
        self._identifiers = city.footprints.building_id
        self._constant = np.full(city.n_buildings, parameters.burn_rate_mean)
        self._taken = np.zeros(city.n_buildings, dtype=np.int64)

    def take(self, codes: Array, step: int) -> Array:
        """Return the rates of a step, (n,); codes (n,) are those before it."""
        rates = self._trace.rates
        if rates is None:
            return self._constant
        burning = (codes >= 1) & (codes <= 3)
        n_rates = rates.shape[1]
        short = burning & (self._taken >= n_rates)
        if short.any():
            b = int(np.argmax(short))
            got = f"{n_rates} rates, all taken when building {int(self._identifiers[b])} still burns at step {step}"
            self._trace.arrays.refuse("burn_rate_draws", "a rate for every step in which a building burns", got)
        rate: Array = rates[np.arange(len(rates)), np.minimum(self._taken, n_rates - 1)]
        self._taken += burning
        return rate


class Crew:
    """The brigades of a city file, by rising id in `team`: moved by its rows, refilled and judged by the engine."""

    def __init__(self, city_file: CityFile, trace: Trace, tables: CityArrays, city: City) -> None:
        self._inputs = city_file.inputs
        self._geometry = tables.geometry
        self._index = {identifier: k for k, identifier in enumerate(self._inputs.brigade_id)}
        self._building = {int(identifier): b for b, identifier in enumerate(city.footprints.building_id)}
        parameters = trace.configuration.parameters(BrigadeParameters, BRIGADE_KEYS)
        range_mm = trace.configuration.number("water_distance")  # not rounded: exactly at the range is allowed
        self._constants = brigade_constants(parameters)._replace(range_square=range_mm * range_mm)
        anywhere = np.zeros(len(self._index), dtype=np.int64)
        self.team: BrigadeState = fresh_brigades(city, anywhere, tank_litres=0, hp=1)
        self.team.tank[:] = self._inputs.tank_litres
        self._place(self._inputs.start)

    def act(self, step: int, fire: FireState) -> list[int]:
        """Move, refill and spray by a step's rows; return the requests' result codes."""
        team = self.team
        self._place(self._inputs.moves.get(step, ()))
        refill(team.refuge, team.hydrant, team.hp, team.tank, self._constants)
        team.sprayed[:] = 0
        return [self._answer(request, fire) for request in self._inputs.requests.get(step, ())]

    def _place(self, placements: Iterable[Placement]) -> None:
        """Put brigades somewhere."""
        for placement in placements:
            k = placement.brigade
            self.team.x[k], self.team.y[k] = placement.x_mm, placement.y_mm
            self.team.refuge[k], self.team.hydrant[k] = placement.refuge, placement.hydrant

    def _answer(self, request: Request, fire: FireState) -> int:
        """Judge a request, and spray if it is accepted."""
        k = self._index.get(request.brigade_id)
        if k is None:
            return UNKNOWN_BRIGADE
        team, target = self.team, self._building[request.target_id]
        square = distance_square(float(team.x[k]), float(team.y[k]), self._geometry.x[target], self._geometry.y[target])
        result = judge_request(request.litres, int(team.sprayed[k]), int(team.tank[k]), square, self._constants)
        if result == ACCEPTED:
            spray(k, target, request.litres, team, fire)
        return int(result)
