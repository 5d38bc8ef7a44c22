"""Lists of what is warm: nothing that a step would change is left out, and a small fire needs few of many buildings."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.city.build import build_city
from fireworld.city.generator import generate_plan
from fireworld.kernels.episode_arrays import ALL, N_BLOCKS, N_VISITS, SEED, STEP
from fireworld.kernels.fire import ignite
from fireworld.kernels.jit import kernel
from fireworld.kernels.outcome import score
from fireworld.kernels.step import begin_step, finish_step, opened_episode
from fireworld.kernels.warmth import BLOCK, CROWDED, begin, list_bits, set_bit
from fireworld.parameters import PAPER
from fireworld.policy.kernel import always
from fireworld.simulation.city_arrays import city_arrays, ignition_energy
from fireworld.simulation.placement import Placement
from fireworld.simulation.world import World, prepare_start

CITY = build_city(generate_plan(columns=40, rows=40, seed=3), PAPER.fire, seed=3)
TABLES = city_arrays(CITY, PAPER.fire)
N = CITY.n_buildings
CORNER = int(np.flatnonzero(CITY.footprints.inflammable)[0])


@kernel
def run_in_one_call(row, n_steps):
    """Run steps in which the brigades go on with what they do."""
    episode = opened_episode(row)
    city, world, warmth, clock = episode.city, episode.world, episode.scratch.warmth, episode.clock
    begin(city.cover, world.fire, warmth)
    for _ in range(n_steps):
        clock[STEP] += 1
        begin_step(city, world, episode.constants, warmth, clock[STEP])
        finish_step(city, world, episode.constants, warmth, clock[SEED], clock[STEP])
    score(world.fire, world.civilians, city.geometry, world.outcome)


def world_of(*ignited):
    refuge = np.flatnonzero(CITY.footprints.refuge)[:1]
    placement = Placement(
        ignited=np.array(ignited, dtype=np.int64),
        civilian_building=np.array([3, 40]),
        civilian_mm=CITY.footprints.centroid_mm[[3, 40]],
        brigade_refuge=refuge,
    )
    return World(prepare_start(CITY, PAPER, placement, arrays=TABLES), seed=1, n_steps_max=100)


def run(world, n_steps, *, calls=1):
    """Run steps in some calls; return the lists as they are at the end."""
    bound = world.bound(always(3).for_brigades(world.n_brigades))
    for _ in range(calls):
        run_in_one_call(bound.row, n_steps // calls)
    return bound.scratch.warmth


@pytest.mark.parametrize("n_steps", [2, 3, 20, 70])
def test_lists_hold_all_that_is_warm_in_order(n_steps):
    world = world_of(CORNER)
    lists, warm = run(world, n_steps), np.flatnonzero(world.state.fire.energy)
    assert len(warm)
    block = lists.block[: lists.number[N_BLOCKS]].tolist()
    assert set((warm // BLOCK).tolist()) <= set(block)
    assert block == sorted(set(block))
    visit = lists.visit[: lists.number[N_VISITS]].tolist()
    position = np.argsort(CITY.order)
    assert visit == sorted(set(visit), key=lambda b: position[b])


def test_a_small_fire_needs_few_of_many_buildings():
    lists = run(world_of(CORNER), 6)
    assert not lists.number[ALL]
    assert lists.number[N_BLOCKS] * BLOCK < N
    assert lists.number[N_VISITS] < N // 2


def test_where_much_is_warm_everything_is_listed():
    lists = run(world_of(*np.flatnonzero(CITY.footprints.inflammable)[:: CROWDED // 2].tolist()), 6)
    assert lists.number[ALL]
    assert lists.visit.tolist() == CITY.order.tolist()


@pytest.mark.parametrize("calls", [2, 6, 60])
def test_it_makes_no_difference_where_calls_begin(calls):
    """A call begins with lists of everything: many calls are the slow way to compute what one call does."""
    one, many = world_of(CORNER, N // 2), world_of(CORNER, N // 2)
    run(one, 60)
    run(many, 60, calls=calls)
    assert one.digest() == many.digest()


def test_a_state_that_somebody_else_changed_between_calls_is_seen():
    """Lit, watered or heated far from the fire: it burns, has another code, radiates in the coming step."""
    world, far = world_of(CORNER), np.flatnonzero(CITY.footprints.inflammable)[-3:].tolist()
    run(world, 5)
    fire = world.state.fire
    assert ignite(far[0], TABLES.buildings, fire)
    fire.watered[far[1]] = 1
    fire.fieryness[far[2]] = 2
    run(world, 1)
    assert fire.fieryness[far].tolist() == [1, 4, 0]
    assert world.outcome.n_burning == np.count_nonzero((fire.fieryness >= 1) & (fire.fieryness <= 3))


def test_bits_are_listed_rising():
    bits, out = np.zeros(3, dtype=np.uint64), np.zeros(192, dtype=np.uint32)
    for k in (191, 0, 63, 64, 100):
        set_bit(k, bits)
    assert out[: list_bits(bits, out)].tolist() == [0, 63, 64, 100, 191]


def test_the_ignition_energy_is_where_the_temperature_is_reached():
    random = np.random.default_rng(5)
    capacity, point = random.uniform(1e3, 1e8, 5000).astype(np.float32).astype(float), random.uniform(1, 900, 5000)
    point[:50] = 0.0
    least = ignition_energy(capacity, point)
    assert (least > 0).all()
    assert (least / capacity >= point).all()
    below = np.nextafter(least, 0.0)
    assert ((below <= 0) | (below / capacity < point)).all()
