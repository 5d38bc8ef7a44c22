"""Trace: one run of another fire simulator, what went in and what came out, read from an .npz file and checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from fireworld.city.city import Array, Float64Array, Int64Array, Links
from fireworld.conformance.arrays import Arrays, read_arrays
from fireworld.conformance.city_file import INTEGER_MAX, CityFile
from fireworld.conformance.configuration import Configuration, read_configuration
from fireworld.conformance.derived import DERIVED

INPUTS: Final = ("params", "city", "id", "order", "conn_ptr", "conn_idx", "conn_val", "burn_rate_draws")
OUTPUTS: Final = ("fieryness", "energy", "temperature", "fuel", "water", "ever_watered", "air", "tank", "requests")
LABELS: Final = ("steps", "air_t", "brigade_id")


@dataclass(frozen=True)
class Series:
    """An output at some steps."""

    name: str
    row_of: dict[int, int]  # row of each step
    values: Array  # (rows, ...)
    resolution: float  # relative rounding of the type in which it is stored

    def at(self, step: int) -> Array | None:
        """Return the values after a step, if they were kept."""
        row = self.row_of.get(step)
        return None if row is None else self.values[row]


@dataclass(frozen=True)
class Trace:
    """A trace that fits its city of n buildings. None: the file does not have it."""

    arrays: Arrays
    configuration: Configuration
    city_name: str | None
    order: Int64Array | None  # (n,) indices in the order in which buildings are visited
    links: Links | None
    rates: Float64Array | None  # (n, k) burn rates; each building takes the next one in every step in which it burns
    n_steps: int
    outputs: Sequence[Series]
    brigade_id: Int64Array | None  # (b,) columns of `tank`
    requests: Int64Array | None  # (r, 5) step, brigade, target, litres, result code

    @property
    def where(self) -> str:
        """Name of the file."""
        return self.arrays.where


def load_trace(path: Path, city: CityFile) -> Trace:
    """Read a trace; TraceError if it has something missing or wrong, or is not of this city."""
    arrays = read_arrays(path, {*INPUTS, *OUTPUTS, *LABELS, *DERIVED})
    configuration = read_configuration(arrays.where, arrays.text("params"))
    identifiers = city.plan.footprints.building_id
    n = len(identifiers)
    stored = arrays.get("fieryness").shape
    if len(stored) == 2 and stored[1] != n:
        arrays.refuse("fieryness", f"a column for each of the {n} buildings of {city.where}", f"{stored[1]} columns")
    codes = arrays.integers("fieryness", None, n, low=0, high=8)
    if not len(codes):
        arrays.refuse("fieryness", "a row for the start and one for each step", "no rows")
    if "id" in arrays:
        listed = arrays.integers("id", n, low=-INTEGER_MAX, high=INTEGER_MAX)
        differs = listed != identifiers
        if differs.any():
            b = int(np.argmax(differs))
            arrays.refuse(f"id[{b}]", f"the city's building {int(identifiers[b])}", int(listed[b]))
    return Trace(
        arrays=arrays,
        configuration=configuration,
        city_name=arrays.text("city") if "city" in arrays else None,
        order=_order(arrays, n),
        links=_links(arrays, n),
        rates=_rates(arrays, n),
        n_steps=len(codes) - 1,
        outputs=_outputs(arrays, codes, n_brigades=len(city.inputs.brigade_id)),
        brigade_id=_brigade_id(arrays, city),
        requests=_requests(arrays, city, n_steps=len(codes) - 1),
    )


def _order(arrays: Arrays, n: int) -> Int64Array | None:
    """Read the order in which buildings are visited."""
    if "order" not in arrays:
        return None
    order = arrays.integers("order", n, low=0, high=n - 1)
    repeated = np.bincount(order, minlength=n)[order] > 1
    arrays.refuse_first("order", repeated, "every building once", order)
    return order


def _links(arrays: Arrays, n: int) -> Links | None:
    """Read the radiation links: all three arrays or none."""
    if not any(key in arrays for key in ("conn_ptr", "conn_idx", "conn_val")):
        return None
    building = arrays.integers("conn_idx", None, low=0, high=n - 1)
    share = arrays.floats("conn_val", len(building))
    arrays.refuse_first("conn_val", (share < 0) | (share > 1), "a share from 0 to 1", share)
    ptr = arrays.integers("conn_ptr", n + 1, low=0, high=len(building))
    if ptr[0] != 0 or ptr[-1] != len(building):
        arrays.refuse("conn_ptr", f"0 first and {len(building)} last", f"{ptr[0]} and {ptr[-1]}")
    arrays.refuse_first("conn_ptr", np.diff(ptr, prepend=0) < 0, "rising numbers", ptr)
    return Links(ptr.astype(np.int32), building.astype(np.int32), share.astype(np.float32))


def _rates(arrays: Arrays, n: int) -> Float64Array | None:
    """Read the burn rates: one list that every building goes through at its own pace, or a list for each."""
    if "burn_rate_draws" not in arrays:
        return None
    each = arrays.get("burn_rate_draws").ndim == 2
    rates = arrays.floats("burn_rate_draws", n, None) if each else arrays.floats("burn_rate_draws", None)
    if rates.shape[-1] == 0:
        arrays.refuse("burn_rate_draws", "at least one rate", "none")
    return np.broadcast_to(rates, (n, rates.shape[-1]))


def _outputs(arrays: Arrays, codes: Int64Array, *, n_brigades: int) -> list[Series]:
    """Read what came out, in the order in which a step makes it."""
    n_steps, n = len(codes) - 1, codes.shape[1]
    every = {step: step for step in range(n_steps + 1)}
    kept = _labels(arrays, "steps", n_steps) if "steps" in arrays else every
    found: dict[str, Array] = {}
    if "tank" in arrays and n_brigades:
        found["tank"] = arrays.integers("tank", None, n_brigades, low=0, high=INTEGER_MAX)
    found["fieryness"] = codes
    found |= {name: arrays.floats(name, None, n) for name in ("energy", "temperature", "fuel") if name in arrays}
    for name, high in (("water", INTEGER_MAX), ("ever_watered", 1)):
        if name in arrays:
            found[name] = arrays.integers(name, None, n, low=0, high=high)
    outputs = [_series(arrays, name, values, kept=kept, every=every) for name, values in found.items()]
    if "air" in arrays:
        row_of = _labels(arrays, "air_t", n_steps) if "air_t" in arrays else kept
        shape = arrays.integers("grid_shape", 2, low=1, high=INTEGER_MAX).tolist() if "grid_shape" in arrays else ()
        air = arrays.floats("air", len(row_of), *(shape or (None, None)))
        outputs.append(_series(arrays, "air", air, kept=row_of, every=row_of))
    return outputs


def _series(arrays: Arrays, name: str, values: Array, *, kept: dict[int, int], every: dict[int, int]) -> Series:
    """Find out which steps the rows of an output are of: those kept, or all."""
    if len(values) not in (len(kept), len(every)):
        arrays.refuse(name, " or ".join(f"{k} rows" for k in sorted({len(kept), len(every)})), f"{len(values)} rows")
    kind = arrays.get(name).dtype
    resolution = float(np.finfo(kind).eps) if kind.kind == "f" else 0.0
    return Series(name, every if len(values) == len(every) else kept, values, resolution)


def _labels(arrays: Arrays, key: str, n_steps: int) -> dict[int, int]:
    """Read which steps were kept."""
    steps = arrays.integers(key, None, low=0, high=n_steps)
    arrays.refuse_first(key, np.diff(steps, prepend=-1) <= 0, "rising steps", steps)
    return {int(step): row for row, step in enumerate(steps)}


def _brigade_id(arrays: Arrays, city: CityFile) -> Int64Array | None:
    """Read which brigade each column of `tank` is of."""
    ours = city.inputs.brigade_id
    if "tank" not in arrays or not ours:
        return None
    if "brigade_id" not in arrays:
        return np.array(ours, dtype=np.int64)
    listed = arrays.integers("brigade_id", len(ours), low=0, high=INTEGER_MAX)
    if sorted(listed.tolist()) != list(ours):
        arrays.refuse("brigade_id", f"the city's brigades {list(ours)}", listed.tolist())
    return listed


def _requests(arrays: Arrays, city: CityFile, *, n_steps: int) -> Int64Array | None:
    """Read the requests with their results, by step; they must be those of the city file."""
    if "requests" not in arrays:
        return None
    rows = np.zeros((0, 5), dtype=np.int64)
    if arrays.get("requests").size:  # a list of no requests is often stored without its second axis
        rows = arrays.integers("requests", None, 5, low=-INTEGER_MAX, high=INTEGER_MAX)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    asked = [
        [step, request.brigade_id, request.target_id, request.litres]
        for step in sorted(city.inputs.requests)
        for request in city.inputs.requests[step]
        if step <= n_steps
    ]
    if len(asked) != len(rows):
        arrays.refuse("requests", f"the {len(asked)} requests of the city file", f"{len(rows)} rows")
    for row, (ours, theirs) in enumerate(zip(asked, rows[:, :4].tolist(), strict=True)):
        if ours != theirs:
            arrays.refuse(f"requests, row {row} by step", f"the city's (step, brigade, target, litres) {ours}", theirs)
    return rows
