"""A whole city: the same everywhere, closed to changes, and as it is recorded."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from fireworld.city.build import build_city
from fireworld.city.city import City
from fireworld.city.generator import generate_plan
from fireworld.errors import CityError
from fireworld.parameters import FireParameters
from tests.city.plans import plan, rectangle
from tests.reference.ways import shortest_ways

DIGEST = "299d856d4a150af808c6028dc434e84c2b1e60fc69b04beb842d24424b4eee31"
"""Of the city below. It changes only with the model or the generator: say so in the commit."""


def arrays_of(value, path=""):
    """List every array in a dataclass."""
    for item in fields(value):
        part = getattr(value, item.name)
        if isinstance(part, np.ndarray):
            yield f"{path}{item.name}", part
        elif is_dataclass(part):
            yield from arrays_of(part, f"{path}{item.name}.")


def small_city() -> City:
    return build_city(generate_plan(columns=9, rows=7, seed=4, hydrant_share=0.2), FireParameters(), seed=2)


def digest(city):
    total = hashlib.sha256()
    for name, array in arrays_of(city):
        total.update(f"{name} {array.dtype} {array.shape}".encode() + array.tobytes())
    return total.hexdigest()


CITY = small_city()


def test_the_city_is_the_same_on_every_machine():
    assert digest(CITY) == DIGEST


@pytest.mark.slow
@pytest.mark.parametrize("setting", [{"PYTHONHASHSEED": "0"}, {"PYTHONHASHSEED": "9", "NUMBA_CPU_NAME": "generic"}])
def test_the_city_is_the_same_in_every_process(setting):
    code = "from tests.city import test_build as t; print(t.digest(t.small_city()))"
    run = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | setting, capture_output=True, text=True, check=True
    )
    assert run.stdout.strip() == DIGEST


def test_plans_need_no_compiler():
    modules = ["city.generator", "city.formats.json_plan", "draws"]
    code = f"import sys, {', '.join(f'fireworld.{name}' for name in modules)}; print('numba' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


def test_shapes_and_types_are_the_promised_ones():
    n = CITY.n_buildings
    assert n == 63
    for name in ("volume_m3", "heat_capacity", "initial_fuel", "ignition_point"):
        assert getattr(CITY, name).dtype == np.float32
        assert getattr(CITY, name).shape == (n,)
    assert CITY.wall_area_m2.dtype == np.float64
    assert sorted(CITY.order.tolist()) == list(range(n))
    for relation in (CITY.links, CITY.near):
        assert relation.ptr.dtype == relation.building.dtype == np.int32
        assert relation.share.dtype == np.float32
        assert relation.ptr[-1] == len(relation.building) == len(relation.share)
        for b in range(n):
            neighbours = relation.building[relation.ptr[b] : relation.ptr[b + 1]]
            assert (np.diff(neighbours) > 0).all()
            assert b not in neighbours
    streets, air = CITY.streets, CITY.air
    assert air.ptr.dtype == air.x.dtype == air.y.dtype == air.percent.dtype == np.int32
    assert 1 <= air.percent.min() <= air.percent.max() <= 100
    assert air.x.max() < air.shape[0]
    assert air.y.max() < air.shape[1]
    assert streets.access_offset_mm.dtype == streets.street_length_mm.dtype == np.int64
    assert streets.access_street.dtype == streets.access_mm.dtype == np.int32
    assert (shortest_ways(streets)[0] >= 0).all()


def test_shares_are_shares():
    emitter = np.repeat(np.arange(CITY.n_buildings), np.diff(CITY.links.ptr))
    assert (CITY.links.share > 0).all()
    assert np.bincount(emitter, weights=CITY.links.share).max() < 1.0


def test_near_is_symmetric_and_holds_every_link():
    emitter = np.repeat(np.arange(CITY.n_buildings), np.diff(CITY.near.ptr)).tolist()
    pairs = set(zip(emitter, CITY.near.building.tolist(), strict=True))
    assert pairs == {(b, a) for a, b in pairs}
    linking = np.repeat(np.arange(CITY.n_buildings), np.diff(CITY.links.ptr)).tolist()
    assert set(zip(linking, CITY.links.building.tolist(), strict=True)) <= pairs


def test_nothing_can_be_changed():
    found = list(arrays_of(CITY))
    assert len(found) > 25
    assert [name for name, array in found if array.flags.writeable] == []


def test_a_building_without_air_is_refused():
    thin = [(10_100, 10_100), (10_400, 10_100), (10_400, 14_000), (10_100, 14_000)]
    with pytest.raises(CityError, match=r"^small: building 1: apexes: expected a footprint that covers"):
        build_city(plan(rectangle(0, 0, 5000, 5000), thin), FireParameters(), seed=1)


def test_one_building_is_a_city():
    city = build_city(plan(rectangle(0, 0, 5000, 5000)), FireParameters(), seed=1)
    assert city.n_buildings == 1
    assert len(city.links.building) == len(city.near.building) == 0
