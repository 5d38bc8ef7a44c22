"""Where heat is, or may come in a step: the work of a step goes with that, not with the size of the city.

Every call of a kernel that runs steps begins with lists of everything, so whatever state it was given, nothing is
missed; in a batch of worlds the first call does, and the next ones continue, as long as nobody else sets a state. The
second step, and every PERIOD-th after that, lists what is warm by then. The steps between add what heat reaches and
take nothing away: to look at what is cold costs time and changes nothing. Lists rise, so that sums over them come in
the order of the buildings, which digests hang on.
"""

from __future__ import annotations

import numpy as np
from numba.cpython.unsafe.numbers import trailing_zeros

from fireworld.kernels.arrays import Array, CoverArrays, FireState, LinkArrays
from fireworld.kernels.episode_arrays import (
    ALL,
    BLOCKS_CHANGED,
    N_BLOCKS,
    N_KNOWN,
    N_VISITS,
    NUMBERS,
    SITES_CHANGED,
    VISITS_CHANGED,
    Warmth,
)
from fireworld.kernels.jit import inner

BLOCK, TILE, WORD = 64, 16, 64
"""Buildings in a block; cells along each side of a tile of air; bits in a word."""
BLOCK_SHIFT, TILE_SHIFT, WORD_SHIFT = np.uint64(6), np.uint64(4), np.uint64(6)
ZERO, ONE, LAST_BIT = np.uint64(0), np.uint64(1), np.uint64(63)
PERIOD = 64
"""Steps after which the lists are made anew."""
CROWDED = 4
"""Where one building in so many is warm, all are listed: that is cheaper than to find out whom their heat can reach."""


def tiles_of(air_shape: tuple[int, ...]) -> tuple[int, int]:
    """Return rows and columns of the tiles of a padded air grid."""
    return -(-air_shape[0] // TILE), -(-air_shape[1] // TILE)


def fresh_warmth(n_buildings: int, air_shape: tuple[int, ...]) -> Warmth:
    """Return room for what is warm in a city; nothing in it yet, and memory is taken only where it is used."""
    n, n_blocks = n_buildings, -(-n_buildings // BLOCK)
    return Warmth(
        number=np.zeros(NUMBERS, dtype=np.int64),
        n_of_code=np.zeros(9, dtype=np.int64),
        block=np.empty(n_blocks, dtype=np.uint32),
        visit=np.empty(n, dtype=np.uint32),
        block_bits=np.empty(-(-n_blocks // WORD), dtype=np.uint64),
        visit_bits=np.empty(-(-n // WORD), dtype=np.uint64),
        is_doubtful=np.empty(n_blocks, dtype=np.uint8),
        unknown=np.empty(n),
        tile=np.empty(tiles_of(air_shape), dtype=np.uint8),
        waiting=np.zeros(-(-n // WORD), dtype=np.uint64),
        burning=np.empty(n, dtype=np.uint32),
        x=np.empty(n),
        y=np.empty(n),
        square=np.empty(n),
        emitted=np.empty(n),
        code=np.empty(n, dtype=np.uint8),
        row=np.empty((2, air_shape[1])),
    )


@inner
def begin(cover: CoverArrays, fire: FireState, warmth: Warmth) -> None:
    """List everything, whoever is warm, and let every code be doubtful."""
    warmth.number[:] = 0
    warmth.number[SITES_CHANGED] = 1
    warmth.is_doubtful[:] = 1
    list_all(cover, warmth)
    count_codes(fire.fieryness, warmth.n_of_code)


@inner
def count_codes(codes: Array, n_of_code: Array) -> None:
    """Count the buildings of each code, (n,) uint8, into (9,) int64."""
    n_of_code[:] = 0
    for b in range(len(codes)):
        n_of_code[codes[b]] += 1


@inner
def list_all(cover: CoverArrays, warmth: Warmth) -> None:
    """List all buildings, and all of them as visited."""
    number = warmth.number
    number[ALL], number[N_BLOCKS], number[N_VISITS] = 1, len(warmth.block), len(warmth.visit)
    number[BLOCKS_CHANGED] = number[VISITS_CHANGED] = 0
    for k in range(len(warmth.block)):
        warmth.block[k] = k
    for k in range(len(warmth.visit)):
        warmth.visit[k] = cover.order[k]


@inner
def narrow(cover: CoverArrays, links: LinkArrays, fire: FireState, warmth: Warmth) -> None:
    """List what is warm by now, has a doubtful code, or lies over warm air; everything where much is warm."""
    number = warmth.number
    number[ALL] = number[N_KNOWN] = 0
    warmth.block_bits[:] = ZERO
    warmth.visit_bits[:] = ZERO
    warmth.unknown[:] = 1.0
    warmth.tile[:] = 0
    for block in range(len(warmth.block)):
        first, end = bounds(block, len(fire.energy))
        is_warm = warmth.is_doubtful[block] != 0
        for b in range(first, end):
            is_warm |= fire.energy[b] != 0.0
        if is_warm:
            add_building(first, warmth)
    span_low, span_end = fire.span[0], fire.span[1]
    for x in range(np.uint64(fire.warm[0]), np.uint64(fire.warm[1])):
        if span_low[x] < span_end[x]:
            take_tiles(x, span_low[x], span_end[x], cover, warmth)
    refresh(cover, warmth)
    follow_heat(cover, links, fire, warmth)


@inner
def lowest_bit(bits: np.uint64) -> np.uint64:
    """Return which is the lowest bit; there must be one."""
    return np.uint64(trailing_zeros(bits))


@inner
def set_bit(k: int, bits: Array) -> None:
    """Set a bit in a row of words."""
    bits[np.uint64(k) >> WORD_SHIFT] |= ONE << (np.uint64(k) & LAST_BIT)


@inner
def has_bit(k: int, bits: Array) -> bool:
    """Return whether a bit in a row of words is set."""
    return bits[np.uint64(k) >> WORD_SHIFT] & (ONE << (np.uint64(k) & LAST_BIT)) != ZERO


@inner
def clear_bit(k: int, bits: Array) -> None:
    """Clear a bit in a row of words."""
    bits[np.uint64(k) >> WORD_SHIFT] &= ~(ONE << (np.uint64(k) & LAST_BIT))


@inner
def list_bits(bits: Array, out: Array) -> np.int64:
    """Write which bits are set, rising; return how many."""
    n = ZERO
    for word in range(np.uint64(len(bits))):
        rest = bits[word]
        while rest != ZERO:
            out[n] = (word << WORD_SHIFT) + lowest_bit(rest)
            n += ONE
            rest &= rest - ONE
    return np.int64(n)


@inner
def refresh(cover: CoverArrays, warmth: Warmth) -> None:
    """List what has been added since the lists were made."""
    number = warmth.number
    if number[BLOCKS_CHANGED] != 0:
        number[N_BLOCKS], number[BLOCKS_CHANGED] = list_bits(warmth.block_bits, warmth.block), 0
    if number[VISITS_CHANGED] != 0:
        number[N_VISITS], number[VISITS_CHANGED] = list_bits(warmth.visit_bits, warmth.visit), 0
        for k in range(number[N_VISITS]):
            warmth.visit[k] = cover.order[warmth.visit[k]]


@inner
def bounds(block: int, n: int) -> tuple[np.uint64, np.uint64]:
    """Return the first building of a block, and the one behind its last; `n`: of the city."""
    first = np.uint64(block) << BLOCK_SHIFT
    return first, min(first + np.uint64(BLOCK), np.uint64(n))


@inner
def add_building(b: int, warmth: Warmth) -> None:
    """Add a building to those that a step looks at, with all others of its block."""
    set_bit(np.uint64(b) >> BLOCK_SHIFT, warmth.block_bits)
    warmth.number[BLOCKS_CHANGED] = 1 - warmth.number[ALL]


@inner
def doubt(b: int, warmth: Warmth) -> None:
    """Note that a building may change its code, be it ever so cold: it burned, or has been watered."""
    add_building(b, warmth)
    warmth.is_doubtful[np.uint64(b) >> BLOCK_SHIFT] = 1


@inner
def take_tiles(x: int, low: int, end: int, cover: CoverArrays, warmth: Warmth) -> None:
    """Add the buildings over the cells [low, end) of a row of air, tile by tile: they exchange heat with it."""
    row = np.uint64(x) >> TILE_SHIFT
    for column in range(np.uint64(low) >> TILE_SHIFT, ((np.uint64(end) - ONE) >> TILE_SHIFT) + ONE):
        if warmth.tile[row, column] == 0:
            warmth.tile[row, column] = 1
            tile = row * np.uint64(warmth.tile.shape[1]) + column
            for k in range(cover.tile_ptr[tile], cover.tile_ptr[tile + ONE]):
                position = cover.tile_position[k]
                set_bit(position, warmth.visit_bits)
                add_building(cover.order[position], warmth)
            warmth.number[VISITS_CHANGED] = 1


@inner
def know(b: int, cover: CoverArrays, links: LinkArrays, warmth: Warmth) -> None:
    """Add all that the heat of a building can reach in a step: whom it radiates to, and who shares its air."""
    warmth.unknown[b] = 0.0
    warmth.number[N_KNOWN] += 1
    for k in range(links.ptr[b], links.ptr[b + 1]):
        add_building(links.building[k], warmth)
    first, low = np.uint64(cover.x0[b]), np.uint64(cover.y0[b])
    for row in range(first >> TILE_SHIFT, ((first + cover.rows[b] - ONE) >> TILE_SHIFT) + ONE):
        take_tiles(row << TILE_SHIFT, low, low + cover.width[b], cover, warmth)


@inner
def follow_heat(cover: CoverArrays, links: LinkArrays, fire: FireState, warmth: Warmth) -> None:
    """Add what heat can reach from buildings that have become warm, before it does."""
    number = warmth.number
    if number[ALL] != 0:
        return
    for k in range(number[N_BLOCKS]):
        first, end = bounds(warmth.block[k], len(fire.energy))
        is_new = False
        for b in range(first, end):
            is_new |= fire.energy[b] * warmth.unknown[b] != 0.0
        if is_new:
            for b in range(first, end):
                if fire.energy[b] * warmth.unknown[b] != 0.0:
                    know(np.int64(b), cover, links, warmth)
    if number[N_KNOWN] * CROWDED >= len(fire.energy):
        list_all(cover, warmth)
    refresh(cover, warmth)
