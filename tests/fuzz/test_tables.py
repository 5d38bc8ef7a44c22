"""Results files and traces of other simulators, altered or made up: only complaints come out."""

import io
import math

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fireworld.conformance.city_file import load_city_file
from fireworld.conformance.trace import load_trace
from fireworld.evaluation.results import KINDS, Result, RunKey, _write, read_results
from tests.fuzz.support import FUZZ, altered, file_of, only_complaints, target
from tests.fuzz.test_files import npz
from tests.reference.traces import CITIES, TRACES

pytestmark = pytest.mark.slow

KEYS = [RunKey("ab" * 32, "cd" * 32, seed, "0.1.0+0123456789ab") for seed in range(3)]
ROW = tuple(kind(1) for kind in KINDS.values())
RESULTS = _write({key: Result("quick", "chief", ROW) for key in KEYS})
CITY = load_city_file(TRACES / f"{CITIES['mini']}.json")


KEPT = ("params", "city", "id", "order", "conn_ptr", "conn_idx", "conn_val", "burn_rate_draws", "grid_shape")
BY_STEP = ("fieryness", "energy", "temperature", "fuel", "water", "ever_watered", "air", "air_t")


def trace_arrays(*, n_steps: int = 6) -> dict[str, np.ndarray]:
    """Return a trace of a few steps, of what is read."""
    with np.load(TRACES / "mini.npz") as stored:
        return {name: stored[name] for name in KEPT} | {name: stored[name][:n_steps] for name in BY_STEP}


ARRAYS = trace_arrays()


def use_results(data: bytes) -> None:
    """Read results."""
    with only_complaints():
        read_results(file_of(data, "results.parquet"))


def use_trace(data: bytes) -> None:
    """Read a trace."""
    with only_complaints():
        load_trace(file_of(data, "trace.npz"), CITY)


@target
@FUZZ
@given(altered(RESULTS))
def test_results_bytes(data):
    use_results(data)


columns = st.sampled_from(
    [pa.array([None] * 3), pa.array([1, 2, 3]), pa.array([0.5, float("nan"), -1e300])]
) | st.lists(st.text(max_size=5), min_size=3, max_size=3).map(pa.array)


@target
@FUZZ
@given(st.data())
def test_results_values(data):
    table = pq.read_table(io.BytesIO(RESULTS))
    at = data.draw(st.integers(0, table.num_columns - 1))
    column = data.draw(columns)
    field = table.schema.field(at)
    if data.draw(st.booleans()):
        try:
            column = column.cast(field.type)
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
            pass
        else:
            table = table.set_column(at, field, column)
    elif data.draw(st.booleans()):
        table = table.set_column(at, data.draw(st.sampled_from([field.name, "odd", ""])), column)
    else:
        table = table.remove_column(at)
    file = io.BytesIO()
    try:
        pq.write_table(table, file)
    except pa.ArrowInvalid:  # nothing, where its own schema wants something
        return
    use_results(file.getvalue())


@target
@FUZZ
@given(st.deferred(lambda: altered(npz(ARRAYS))))
def test_trace_bytes(data):
    use_trace(data)


odd_arrays = st.tuples(
    st.sampled_from(["<f8", "<i8", "<i4", "|u1", "|b1", "<U9", "O", "<c16", ">f4"]),
    st.sampled_from([(), (0,), (1,), (6,), (12,), (6, 12), (12, 6), (3, 5), (6, 12, 2)]),
    st.sampled_from([0, 1, -1, 7, 255, 2**31, float("nan"), float("inf")]),
)


@target
@FUZZ
@given(st.lists(st.tuples(st.sampled_from(sorted(ARRAYS)), odd_arrays), min_size=1, max_size=3))
def test_trace_values(changes):
    arrays = dict(ARRAYS)
    for name, (dtype, shape, fill) in changes:
        with np.errstate(all="ignore"):
            kind = np.dtype(dtype).kind
            value = (
                fill if kind in "fcO" or (math.isfinite(fill) and abs(fill) < 256 and (kind != "u" or fill >= 0)) else 3
            )
            arrays[name] = np.full(shape, value).astype(dtype)
    use_trace(npz(arrays))


@target
@FUZZ
@given(st.sampled_from(sorted(ARRAYS)), st.integers(0, 200), st.sampled_from([0, -1, 1, 99, 2**31 - 1, 1e300]))
def test_trace_numbers(name, position, number):
    """One number of a trace is another one."""
    array = np.array(ARRAYS[name])
    if array.dtype.kind in "iuf" and array.size:
        info = np.iinfo(array.dtype) if array.dtype.kind in "iu" else np.finfo(array.dtype)
        array.flat[position % array.size] = min(max(number, 0 - abs(float(info.min)) / 2), float(info.max) / 2)
    use_trace(npz({**ARRAYS, name: array}))


def test_the_good_files_are_read():
    """What is altered above is good before."""
    assert len(read_results(file_of(RESULTS, "results.parquet"))) == 3
    assert load_trace(file_of(npz(ARRAYS), "trace.npz"), CITY).n_steps
