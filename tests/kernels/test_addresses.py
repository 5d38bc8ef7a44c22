"""Address rows: what a kernel opens is what the row was made of."""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np
import pytest

from fireworld.kernels.addresses import address_row, opener
from fireworld.kernels.arrays import Array, CityArrays, Constants, Float64, Int32x2, UInt8
from fireworld.kernels.jit import kernel
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.packing import Packing
from fireworld.simulation.state import named_arrays


class Pair(NamedTuple):
    number: float
    whole: int
    truth: bool
    several: tuple[float, float]


class Group(NamedTuple):
    line: Float64
    pair: Pair
    table: Int32x2
    bytes: UInt8


opened_group = opener(Group)


@kernel
def change(row: Array, out: Array) -> None:
    group = opened_group(row)
    out[0], out[1], out[2] = group.pair.number, group.pair.whole, group.pair.truth
    out[3], out[4] = group.pair.several
    out[5], out[6], out[7] = len(group.line), group.table.shape[0], group.table.shape[1]
    out[8], out[9] = group.table[1, 2], len(group.bytes)
    group.line[0] = -1.0
    group.table[0, 1] = 7


def group(**changes):
    table = np.arange(6, dtype=np.int32).reshape(2, 3)
    values = {
        "line": np.ones(4),
        "pair": Pair(0.1, -3, True, (1e300, -0.0)),
        "table": table,
        "bytes": np.zeros(0, dtype=np.uint8),
    }
    return Group(**values | changes)


def test_a_kernel_reads_and_writes_the_arrays_of_a_row():
    made, out = group(), np.zeros(10)
    change(address_row(made), out)
    assert out.tolist() == [0.1, -3.0, 1.0, 1e300, -0.0, 4.0, 2.0, 3.0, 5.0, 0.0]
    assert made.line.tolist() == [-1.0, 1.0, 1.0, 1.0]
    assert made.table.tolist() == [[0, 7, 2], [3, 4, 5]]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"line": np.ones(4, dtype=np.float32)}, "Group.line: expected contiguous float64 of 1 axes, got float32"),
        ({"line": np.ones(8)[::2]}, "Group.line: expected contiguous float64"),
        ({"table": np.zeros(3, dtype=np.int32)}, "Group.table: expected contiguous int32 of 2 axes"),
    ],
)
def test_arrays_of_another_type_have_no_row(changes, message):
    with pytest.raises(TypeError, match=message):
        address_row(group(**changes))


def test_a_row_has_the_bits_of_its_numbers():
    row = address_row(Pair(-0.0, 2**40, False, (0.5, np.inf)))
    assert struct.pack("<5q", *row) == struct.pack("<dqqdd", -0.0, 2**40, 0, 0.5, np.inf)


def test_a_state_and_its_memory_are_one():
    start = build_scenario(load_scenario("quick")).start
    packing, (one, other) = Packing(start.state), (start.packing.fresh() for _ in range(2))
    one[:] = packing.memory
    state = packing.state(one)
    for (name, view), (_, array) in zip(named_arrays(state), named_arrays(start.state), strict=True):
        np.testing.assert_array_equal(view, array, err_msg=name)
        assert view.dtype == array.dtype
        assert np.shares_memory(view, one) or not view.size
    other[:] = one
    state.fire.energy[:] = 5.0
    assert (packing.state(other).fire.energy != 5.0).all(), "a copy goes its own way"
    row = packing.row(one, state.ways)
    np.testing.assert_array_equal(row, address_row(state))
    assert packing.digest == start.packing.digest


def test_all_that_kernels_take_has_a_row():
    start = build_scenario(load_scenario("quick")).start
    assert len(start.row) == len(address_row(start.city_arrays)) + len(address_row(start.constants))
    assert isinstance(start.city_arrays, CityArrays)
    assert isinstance(start.constants, Constants)
