"""Check: a trace replayed and compared, output by output: how far apart they are, and what counts as a difference."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from fireworld.city.city import Array, City
from fireworld.city.formats.official.keys import RAY_KEYS
from fireworld.conformance.city_file import CityFile
from fireworld.conformance.derived import RELATIVE_TOLERANCE, TableDifference, differing_tables
from fireworld.conformance.replay import Moment, prepare, replay
from fireworld.conformance.trace import Series, Trace, load_trace

EXACT: Final = frozenset({"fieryness", "fuel", "water", "ever_watered", "tank", "requests"})
"""Outputs that must be equal; the others may be apart by the tolerance."""


@dataclass
class Tally:
    """How one output compares over all steps so far."""

    name: str
    n_compared: int = 0
    n_differing: int = 0
    largest: float | None = None
    """Largest relative difference; None for outputs that must be equal."""

    def add(self, ours: Array, theirs: Array, *, scale: Array | float, resolution: float) -> Array:
        """Compare the values of a step and return where they differ, bool of the same shape.

        A difference is relative to the greater of the trace's value and a scale (for energies the heat capacity, which
        is one degree), because what is left of a building's heat after it was cooled all the way is rounding noise:
        relative to itself it means nothing. The tolerance is not finer than `resolution`, the rounding of the trace's
        type.
        """
        if self.name in EXACT:
            with np.errstate(over="ignore"):
                differs: Array = ours != theirs.astype(ours.dtype)
        else:
            with np.errstate(all="ignore"):
                gap = np.abs(ours - theirs) / np.maximum(np.abs(theirs), scale)
            gap = np.where(np.isfinite(gap), gap, np.inf)
            self.largest = max(self.largest or 0.0, float(gap.max(initial=0.0)))
            differs = gap > max(RELATIVE_TOLERANCE, resolution)
        self.n_compared += differs.size
        self.n_differing += int(np.count_nonzero(differs))
        return differs


@dataclass(frozen=True)
class Pair:
    """A value as computed here and as it is in the trace, which may not have kept it."""

    ours: float
    theirs: float | None

    def __str__(self) -> str:
        return f"{self.ours!r} here, {'not kept' if self.theirs is None else repr(self.theirs)} in the trace"


@dataclass(frozen=True)
class FirstDifference:
    """Where a replay and its trace part."""

    step: int
    output: str
    entity: str
    values: Pair
    code: Pair | None = None  # of the building, if it is one
    energy: Pair | None = None

    @property
    def sentence(self) -> str:
        """All of it on one line."""
        words = [f"step {self.step}, {self.entity}: {self.output} {self.values}"]
        if self.code is not None and self.output != "code":
            words.append(f"code {self.code}")
        if self.energy is not None and self.output != "energy":
            words.append(f"energy {self.energy}")
        return "; ".join(words)


@dataclass(frozen=True)
class Report:
    """How a trace and its replay compare."""

    trace: str
    n_steps: int
    n_buildings: int
    tallies: dict[str, Tally]  # by output; the codes always, the others if the trace has them
    tables: tuple[TableDifference, ...]
    first_difference: FirstDifference | None
    notes: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether everything that the trace has agrees."""
        return not self.tables and not any(tally.n_differing for tally in self.tallies.values())


def check(city_file: CityFile, path: Path) -> Report:
    """Replay a trace and compare everything that it has with what the engine makes of its inputs in that city.

    Raises TraceError if it cannot be read or does not fit, CityError if the city cannot be built with its parameters.
    """
    trace = load_trace(path, city_file)
    own_city, city, fire = prepare(city_file, trace)
    with_rays = trace.configuration.has(RAY_KEYS)
    tables = differing_tables(trace.arrays, own_city, fire, with_rays=with_rays)
    comparison = Comparison(trace, city)
    for moment in replay(city_file, trace, city, fire):
        comparison.add(moment)
    return Report(
        trace=trace.where,
        n_steps=trace.n_steps,
        n_buildings=city.n_buildings,
        tallies=comparison.tallies,
        tables=tuple(tables),
        first_difference=comparison.first,
        notes=(*city_file.plan.notes, *_notes(trace, city_file.plan.name)),
    )


def _notes(trace: Trace, city_name: str) -> list[str]:
    """List what the trace does not have, and what makes one wonder."""
    notes = []
    if trace.order is None:
        notes.append("the trace has no order: fireworld's own is used")
    if trace.links is None:
        notes.append("the trace has no links: fireworld's own are used, whose rays are drawn differently")
    if trace.rates is None:
        notes.append("the trace has no burn rates: the average is used")
    if not any(series.name == "energy" for series in trace.outputs):
        notes.append("the trace has no energies: only what it has is compared")
    if trace.city_name is not None and trace.city_name != city_name:
        notes.append(f"the trace says that its city is {trace.city_name!r}, the city file is {city_name!r}")
    return notes


def _is_comparable(series: Series, trace: Trace, city: City) -> bool:
    """Return whether an output has the same shape here; another air grid is a difference of the derived tables."""
    if series.name != "air" or series.values.shape[1:] == city.air.shape:
        return True
    if "grid_shape" not in trace.arrays:
        trace.arrays.refuse("air", f"{city.air.shape} cells", f"{series.values.shape[1:]} cells")
    return False


class Comparison:
    """Compares moment after moment with a trace; `tallies` are by output, in the order in which a step makes them."""

    def __init__(self, trace: Trace, city: City) -> None:
        self.first: FirstDifference | None = None
        self._trace = trace
        self._building_id = city.footprints.building_id
        self._scales: dict[str, Any] = {"energy": city.heat_capacity.astype(np.float64)}
        self._series = {series.name: series for series in trace.outputs if _is_comparable(series, trace, city)}
        names = [*(["requests"] if trace.requests is not None else []), *self._series]
        self.tallies = {name: Tally(name) for name in names}

    def add(self, moment: Moment) -> None:
        """Compare one moment."""
        if self._trace.requests is not None:
            theirs = self._trace.requests[self._trace.requests[:, 0] == moment.step, 4]
            self._compare("requests", moment, np.array(moment.results, dtype=np.int64), theirs, resolution=0.0)
        for series in self._series.values():
            row = series.at(moment.step)
            if row is not None:
                ours = moment.outputs[series.name]
                if series.name == "tank" and self._trace.brigade_id is not None:  # its columns are in another order
                    ours = ours[np.argsort(np.argsort(self._trace.brigade_id))]
                self._compare(series.name, moment, ours, row, resolution=series.resolution)

    def _compare(self, name: str, moment: Moment, ours: Array, theirs: Array, *, resolution: float) -> None:
        """Compare one output of a moment, and note the first difference of all."""
        scale = self._scales.get(name, 1.0)
        differs = self.tallies[name].add(ours, theirs, scale=scale, resolution=resolution)
        if self.first is None and differs.any():
            place = tuple(int(k) for k in np.unravel_index(int(np.argmax(differs)), differs.shape))
            self.first = self._describe(name, moment, place, Pair(ours[place].item(), theirs[place].item()))

    def _describe(self, name: str, moment: Moment, place: tuple[int, ...], values: Pair) -> FirstDifference:
        """Describe where an output differs; of a building, its code and energy too."""
        if name == "requests":
            requests = self._trace.requests
            assert requests is not None  # noqa: S101 - there is an output of them
            _, brigade, target, litres, _ = requests[requests[:, 0] == moment.step][place[0]].tolist()
            return FirstDifference(moment.step, "result", f"brigade {brigade} asks {litres} for {target}", values)
        if name == "tank":
            assert self._trace.brigade_id is not None  # noqa: S101 - there are tanks
            brigade = int(self._trace.brigade_id[place[0]])
            return FirstDifference(moment.step, name, f"brigade {brigade}", values)
        if name == "air":
            return FirstDifference(moment.step, name, f"cell {place[0]}, {place[1]}", values)
        b = place[0]
        return FirstDifference(
            moment.step,
            "code" if name == "fieryness" else name,
            f"building {int(self._building_id[b])}",
            values,
            code=self._pair("fieryness", moment, b),
            energy=self._pair("energy", moment, b),
        )

    def _pair(self, name: str, moment: Moment, b: int) -> Pair:
        """Return one output of a building on both sides."""
        series = self._series.get(name)
        row = None if series is None else series.at(moment.step)
        return Pair(moment.outputs[name][b].item(), None if row is None else row[b].item())
