"""The air over the city: how its heat spreads, and how buildings and the air under them exchange heat.

Warm is what differs from zero. Of every row of air a span of cells is known outside of which nothing is warm, and of
the whole grid a box around all spans: the work of a step goes with what is warm, not with the size of the city.
"""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import Array, BuildingArrays, CoverArrays, FireConstants, FireState
from fireworld.kernels.episode_arrays import ALL, N_VISITS, Warmth
from fireworld.kernels.jit import inner
from fireworld.kernels.warmth import take_tiles

ONE, TWO, THREE, FOUR = np.uint64(1), np.uint64(2), np.uint64(3), np.uint64(4)
PADDING = 5
"""Cells of a row of air that are no cells of the city: one before, four behind them."""


@inner
def mix_row(
    before: Array, row: Array, after: Array, low: int, end: int, flow: float, kept: float, flush: float, mixed: Array
) -> None:
    """Mix the cells [low, end) of a row of air with their neighbours and lose some heat, into `mixed`.

    Unsigned bounds spare numba's test for negative ones, so that the compiler turns this into vector instructions.
    """
    for y in range(low, end):
        old = row[y]
        left = before[y - ONE] + row[y - ONE] + after[y - ONE]
        middle = before[y] + old + after[y]
        right = before[y + ONE] + row[y + ONE] + after[y + ONE]
        mean = (left + middle + right - old) * 0.125
        warmth = (old + (mean - old) * flow) * kept
        mixed[y] = warmth if warmth > flush else 0.0


@inner
def put_row(mixed: Array, low: int, end: int, row: Array) -> None:
    """Copy the cells [low, end) to where they belong."""
    for y in range(low, end):
        row[y] = mixed[y]


@inner
def spread_air(cover: CoverArrays, fire: FireState, constants: FireConstants, warmth: Warmth) -> None:
    """Mix every air cell with its eight neighbours and lose some heat; MODEL 2.5. Only the warm spans are touched.

    Heat reaches one cell farther than before, within the grid. So a row's span becomes that of the row and its two
    neighbours, one cell longer on either side; then it is drawn in to the cells that are not zero. Works in place: a
    row is put back once the next one, which needs it as it was, is mixed. The buildings over air that becomes warm are
    listed.
    """
    air, warm, span_low, span_end = fire.air, fire.warm, fire.span[0], fire.span[1]
    if warm[1] <= warm[0]:
        return
    flow, kept, flush = constants.air_to_air_flow, constants.air_heat_kept, constants.flush_temperature
    rows, pitch = air.shape
    edge = np.uint64(pitch - PADDING + 1)
    first, last = np.uint64(max(1, warm[0] - 1)), np.uint64(min(rows - 1, warm[1] + 1))
    west, east, south, north = last, first, edge, ONE  # the new box, of nothing yet
    low_before, end_before = span_low[first - ONE], span_end[first - ONE]
    mixed, held, held_low, held_end = warmth.row[0], warmth.row[1], ONE, ONE
    for x in range(first, last):
        low = max(TWO, min(low_before, span_low[x], span_low[x + ONE])) - ONE
        end = max(low, min(edge, max(end_before, span_end[x], span_end[x + ONE]) + ONE))
        low_before, end_before = span_low[x], span_end[x]
        mix_row(air[x - ONE], air[x], air[x + ONE], low, end, flow, kept, flush, mixed)
        put_row(held, held_low, held_end, air[x - ONE])
        mixed, held, held_low, held_end = held, mixed, low, end
        while low < end and held[low] == 0.0:
            low += ONE
        while low < end and held[end - ONE] == 0.0:
            end -= ONE
        if low < end:
            if warmth.number[ALL] == 0 and (low < span_low[x] or end > span_end[x]):
                take_tiles(x, low, end, cover, warmth)
            span_low[x], span_end[x] = low, end
            west, east, south, north = min(west, np.uint64(x)), x + ONE, min(south, low), max(north, end)
        else:
            span_low[x], span_end[x] = pitch, 0
    put_row(held, held_low, held_end, air[last - ONE])
    if west < east:
        warm[0], warm[1], warm[2], warm[3] = west, east, south, north
    else:
        warm[0], warm[2] = warm[1], warm[3]


@inner
def meets_heat(x0: int, x1: int, y0: int, y1: int, span_low: Array, span_end: Array) -> bool:
    """Return whether a block of air reaches into the warm span of one of its rows."""
    for x in range(x0, x1):  # noqa: SIM110 - a generator is slow in compiled code
        if y0 < span_end[x] and y1 > span_low[x]:
            return True
    return False


@inner
def widen_spans(x0: int, x1: int, y0: int, y1: int, span_low: Array, span_end: Array) -> None:
    """Take a block of air into the spans of its rows."""
    for x in range(x0, x1):
        span_low[x] = min(span_low[x], y0)
        span_end[x] = max(span_end[x], y1)


@inner
def are_full(span_low: Array, span_end: Array, pitch: int) -> bool:
    """Return whether the spans hold all cells of the city, as they do where much burns: then none can be widened."""
    edge = np.uint64(pitch - PADDING + 1)
    for x in range(ONE, np.uint64(len(span_low) - 1)):  # noqa: SIM110 - a generator is slow in compiled code
        if span_low[x] != ONE or span_end[x] < edge:
            return False
    return True


@inner
def exchange_with_air(
    buildings: BuildingArrays, cover: CoverArrays, fire: FireState, constants: FireConstants, warmth: Warmth
) -> None:
    """Let each building in turn exchange heat with the air cells under it; MODEL 2.6.

    q = (T_cell - T_building) * weight; the cell loses q * cell_share, the building gains the sum. A building without
    heat over cells without heat is passed over: nothing would change. Four cells go at once, with a sum each, because
    one sum would make every cell wait for the one before; unsigned indices spare numba's test for negative ones.
    Only buildings with heat warm cells that were cold, so only they widen the spans and the box.
    """
    energy, air, weight, warm = fire.energy, fire.air, cover.weight, fire.warm
    span_low, span_end, share = fire.span[0], fire.span[1], constants.cell_share
    rows, pitch = air.shape
    west, east, south, north = np.uint64(rows), np.uint64(0), np.uint64(pitch), np.uint64(0)
    if warm[0] < warm[1]:
        west, east, south, north = np.uint64(warm[0]), np.uint64(warm[1]), np.uint64(warm[2]), np.uint64(warm[3])
    full = are_full(span_low, span_end, pitch)
    for k in range(np.uint64(warmth.number[N_VISITS])):
        b = warmth.visit[k]
        heat = energy[b]
        x0 = np.uint64(cover.x0[b])
        if heat == 0.0 and (x0 >= east or x0 + cover.rows[b] <= west):  # far off: looked at no further
            continue
        y0, x1 = np.uint64(cover.y0[b]), x0 + cover.rows[b]
        y1 = y0 + cover.width[b]
        if heat == 0.0:
            if y0 >= north or y1 <= south or not meets_heat(x0, x1, y0, y1, span_low, span_end):
                continue
        else:
            west, east, south, north = min(west, x0), max(east, x1), min(south, y0), max(north, y1)
            if not full:
                widen_spans(x0, x1, y0, y1, span_low, span_end)
        temperature = heat / buildings.capacity[b]
        p = np.uint64(cover.ptr[b])
        gain_0 = gain_1 = gain_2 = gain_3 = 0.0
        for x in range(x0, x1):
            y = y0
            while y < y1:
                cell_0, cell_1, cell_2, cell_3 = air[x, y], air[x, y + ONE], air[x, y + TWO], air[x, y + THREE]
                q_0 = (cell_0 - temperature) * weight[p]
                q_1 = (cell_1 - temperature) * weight[p + ONE]
                q_2 = (cell_2 - temperature) * weight[p + TWO]
                q_3 = (cell_3 - temperature) * weight[p + THREE]
                air[x, y] = cell_0 - q_0 * share
                air[x, y + ONE] = cell_1 - q_1 * share
                air[x, y + TWO] = cell_2 - q_2 * share
                air[x, y + THREE] = cell_3 - q_3 * share
                gain_0 += q_0
                gain_1 += q_1
                gain_2 += q_2
                gain_3 += q_3
                p += FOUR
                y += FOUR
        energy[b] = heat + ((gain_0 + gain_1) + (gain_2 + gain_3))
    if west < east:
        warm[0], warm[1], warm[2], warm[3] = west, east, south, north
