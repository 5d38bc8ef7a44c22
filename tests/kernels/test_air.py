"""The warm spans: outside of them no air is warm, and how wide they are makes no difference to any bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fireworld.city.build import build_city
from fireworld.city.generator import generate_plan
from fireworld.kernels.fire import advance_fire, ignite
from fireworld.kernels.warmth import fresh_warmth
from fireworld.parameters import PAPER
from fireworld.simulation.city_arrays import city_arrays, fire_constants
from fireworld.simulation.state import fresh_fire, restore_snapshot, take_snapshot, warm_spans
from tests.simulation.town import town_world

CITY = build_city(generate_plan(columns=14, rows=14, seed=3), PAPER.fire, seed=3)
TABLES = city_arrays(CITY, PAPER.fire)
CORNER, MIDDLE = 1, 98


def kindled(*buildings):
    """A cold city but for the buildings on fire."""
    fire = fresh_fire(CITY)
    fire.rate[:] = 0.15
    for b in buildings:
        assert ignite(b, TABLES.buildings, fire)
    return fire


def burn_on(fire, n_steps=1, *, flush=0.001):
    constants = fire_constants(replace(PAPER.fire, flush_temperature=flush))
    warmth = fresh_warmth(CITY.n_buildings, fire.air.shape)
    for _ in range(n_steps):
        advance_fire(TABLES.buildings, TABLES.cover, TABLES.links, fire, constants, warmth)


def cell_by_cell(fire):
    """(nx + 2, pitch) bool: cells within the spans."""
    cells = np.arange(fire.air.shape[1])
    return (cells >= fire.span[0][:, None]) & (cells < fire.span[1][:, None])


@pytest.mark.parametrize("flush", [0.001, 0.0])
@pytest.mark.parametrize("buildings", [(CORNER,), (MIDDLE,), (CORNER, MIDDLE)])
def test_the_air_outside_the_spans_is_cold(buildings, flush):
    fire = kindled(*buildings)
    widths = []
    for _ in range(60):
        burn_on(fire, flush=flush)
        within = cell_by_cell(fire)
        assert not fire.air[~within].any()
        widths.append(int(within.sum()))
        west, east, south, north = fire.warm
        within[west:east, south:north] = False
        assert not within.any(), "the box is around all spans"
    assert widths[0] < fire.air.size / 4, "a small fire has narrow spans"
    assert len(set(widths)) > 5


@pytest.mark.parametrize("flush", [0.001, 0.0])
@pytest.mark.parametrize("buildings", [(CORNER,), (MIDDLE,), (CORNER, MIDDLE)])
def test_spans_wider_than_they_need_be_change_nothing(buildings, flush):
    """Once with the spans as they are, once with all cells taken for warm before every step."""
    fire, wide = kindled(*buildings), kindled(*buildings)
    rows, pitch = wide.air.shape
    for _ in range(60):
        wide.warm[:] = 1, rows - 1, 1, pitch - 4
        wide.span[:] = warm_spans(wide.warm, wide.air.shape)
        burn_on(fire, flush=flush)
        burn_on(wide, flush=flush)
        for name in ("energy", "fuel", "fieryness", "air"):
            assert getattr(fire, name).tobytes() == getattr(wide, name).tobytes()


def test_the_spans_vanish_with_the_heat_and_come_again():
    fire, first = kindled(MIDDLE), kindled(CORNER)
    burn_on(fire, 20)
    for _ in range(80):
        fire.energy[:] = 0.0
        burn_on(fire)
    assert not fire.air.any()
    assert not cell_by_cell(fire).any()
    assert fire.warm[0] == fire.warm[1]
    fire.energy[:], fire.fuel[:] = first.energy, first.fuel
    burn_on(fire, 20)
    burn_on(first, 20)
    assert fire.air.tobytes() == first.air.tobytes()
    assert fire.warm.tolist() == first.warm.tolist()
    assert fire.span.tolist() == first.span.tolist()


def test_a_restored_fire_has_the_spans_of_its_own_air():
    world, other = town_world(seed=5, n_fires=1), town_world(seed=9, n_fires=8)
    fire = other.state.fire
    fire.span[0], fire.span[1] = 1, fire.air.shape[1]
    snapshot = take_snapshot(world.state)
    assert "fire.span" not in snapshot
    restore_snapshot(other.state, snapshot)
    assert not cell_by_cell(fire).any()


def test_the_spans_of_a_box():
    span = warm_spans(np.array([2, 4, 3, 6]), (6, 10))
    assert span.tolist() == [[10, 10, 3, 3, 10, 10], [0, 0, 6, 6, 0, 0]]
