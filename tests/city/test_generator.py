"""Synthetic cities: what the parameters promise, for any of them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.city.generator import generate_plan
from fireworld.city.outlines import doubled_area_mm2
from fireworld.errors import CityError

PAPER = generate_plan(columns=24, rows=26, seed=1)


def outlines(plan):
    ptr = plan.footprints.outline_ptr
    corners = [tuple(corner) for corner in plan.footprints.outline_mm.tolist()]
    return [corners[begin:end] for begin, end in pairwise(ptr)]


def test_the_city_of_the_paper():
    footprints, streets = PAPER.footprints, PAPER.streets
    n = len(footprints.building_id)
    assert n == 624
    assert footprints.building_id.tolist() == list(range(n))
    assert len(streets.node_mm) == 9 * 14  # 8 by 13 blocks
    assert len(streets.street) == 8 * 14 + 9 * 13
    assert len(streets.hydrant_node) == 0
    assert footprints.refuge.sum() == 2
    np.testing.assert_array_equal(footprints.inflammable, 1 - footprints.refuge)
    assert np.bincount(footprints.floors)[1:] / n == pytest.approx([0.5, 0.25, 0.25], abs=0.05)
    assert np.bincount(footprints.material) / n == pytest.approx([0.75, 0.20, 0.05], abs=0.05)
    assert 0.1 < np.mean([len(outline) == 6 for outline in outlines(PAPER)]) < 0.5


def test_refuges_stand_on_the_lots_nearest_to_their_places():
    refuge_mm = PAPER.footprints.centroid_mm[PAPER.footprints.refuge == 1]
    city_mm = PAPER.streets.node_mm.max(axis=0) + 4000
    np.testing.assert_allclose(refuge_mm / city_mm, [[0.15, 0.15], [0.85, 0.85]], atol=0.03)
    crowd = generate_plan(columns=2, rows=1, seed=1, refuges=((0.1, 0.5), (0.1, 0.5)))
    assert crowd.footprints.refuge.tolist() == [1, 1]


@settings(max_examples=30)
@given(
    columns=st.integers(1, 9),
    rows=st.integers(1, 9),
    seed=st.integers(0, 2**63),
    block=st.tuples(st.integers(1, 5), st.integers(1, 5)),
    lot_m=st.sampled_from([5.0, 14.0, 33.3]),
    fill=st.sampled_from([(0.7, 0.97), (0.5, 0.5), (0.9, 1.0)]),
)
def test_buildings_stay_on_their_lots_and_off_the_streets(columns, rows, seed, block, lot_m, fill):
    plan = generate_plan(
        columns=columns, rows=rows, seed=seed, block=block, lot_m=lot_m, fill=fill, refuges=((0.5, 0.5),)
    )
    lot, street = round(lot_m * 1000), 8000
    for index, outline in enumerate(outlines(plan)):
        column, row = index % columns, index // columns
        x = column * lot + (column // block[0] + 1) * street
        y = row * lot + (row // block[1] + 1) * street
        assert all(x <= a <= x + lot and y <= b <= y + lot for a, b in outline)
        assert len(set(outline)) == len(outline)
        share = doubled_area_mm2(outline) / 2 / lot**2
        assert fill[0] - 0.001 < share < fill[1] + 0.001
        assert plan.footprints.ground_area_m2[index] == int(share * lot**2 / 1e6)
    low, high = plan.footprints.outline_mm.min(axis=0), plan.footprints.outline_mm.max(axis=0)
    nodes = plan.streets.node_mm
    assert (nodes.min(axis=0) == street // 2).all()
    assert (nodes.min(axis=0) < low).all()
    assert (nodes.max(axis=0) > high).all()
    spans = np.abs(nodes[plan.streets.street[:, 0]] - nodes[plan.streets.street[:, 1]])
    assert ((spans == 0).sum(axis=1) == 1).all()  # along one axis each
    assert plan.footprints.refuge.sum() == 1


def test_a_larger_city_begins_with_the_smaller_one():
    small, large = generate_plan(columns=6, rows=4, seed=5), generate_plan(columns=9, rows=8, seed=5)
    assert outlines(small)[7] == outlines(large)[10]  # column 1, row 1
    assert outlines(small) != outlines(generate_plan(columns=6, rows=4, seed=6))


def test_hydrants_stand_at_a_share_of_the_crossings():
    for share, low, high in [(0.0, 0, 0), (0.3, 20, 56), (1.0, 126, 126)]:
        plan = generate_plan(columns=24, rows=26, seed=1, hydrant_share=share)
        assert low <= len(plan.streets.hydrant_node) <= high
        assert len(set(plan.streets.hydrant_node.tolist())) == len(plan.streets.hydrant_node)


def test_a_city_that_is_too_large_is_refused():
    with pytest.raises(CityError, match=r"^generated: columns, rows: expected a city of at most 10000 m a side"):
        generate_plan(columns=10_000, rows=4, seed=1)
