"""Many worlds in one call: given decisions, one step of each, and what learners see of it next.

A world that others step is left as its brigades see it: what is lit in the coming step is lit, and its fire sites are
found. Decisions are the caller's; all else are the phases of `fireworld.kernels.step`.
"""

from __future__ import annotations

from typing import NamedTuple

from fireworld.kernels.addresses import opener
from fireworld.kernels.allocation import is_asked, join_site, named_range, stays
from fireworld.kernels.arrays import (
    BURNING,
    Array,
    BrigadeState,
    Float32x2,
    Float32x3,
    Float32x4,
    Float64x2,
    Int32x2,
    Int32x3,
    Int64,
    Int64x2,
    Int64x3,
    UInt8,
    UInt8x2,
    UInt8x3,
)
from fireworld.kernels.deciding import state_of
from fireworld.kernels.episode_arrays import HOLDS_AFTER, LAST_STEP, SEED, STEP, Episode
from fireworld.kernels.fire import is_over
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.observation import N_ACTIONS, can_choose, find_named, find_target, site_place
from fireworld.kernels.outcome import score
from fireworld.kernels.ranking import N_TARGET_FEATURES, OWN_TARGET, describe_building, see_target
from fireworld.kernels.step import begin_step, finish_step, opened_episode, sight_of
from fireworld.kernels.warmth import begin


class View(NamedTuple):
    """What learners see of n worlds; b brigades at most, k targets of their own. What nobody wants has no rows."""

    features: Int64x3  # (n, b, 8)
    state: Int64x2  # (n, b): 0..4319, -1 without a site
    mask: UInt8x3  # (n, b, 4 + k): the actions that a brigade may take; 0 alone where it chooses nothing
    alive: UInt8x2  # (n, b)
    chooses: UInt8x2  # (n, b): it acts in the coming step: alive, not refilling, and something burns
    own: Int32x3  # (n, b, k): the burning buildings that it may name, -1 where there are no more
    targets: Float32x4  # (n, b, 4, 13): features of the targets that the actions name
    team: Float32x2  # (n, 6), TEAM
    burning: Int32x2  # (n, g): burning buildings, site after site, -1 where there are no more
    buildings: Float32x3  # (n, g, 7): their features
    brigades: Float32x3  # (n, b, 6), EACH
    frame: Float64x2  # (n, 4), mm: west and south end of the city's streets, width and height; it is given


TEAM = ("steps_left", "burning", "burnt_out", "water_damaged", "civilians_alive", "score")
"""Of the team: the part of the steps that is left; parts of the buildings and the civilians; score / maximal score."""
EACH = ("x", "y", "tank", "refilling", "health", "drives")
"""Of each brigade: where it is, from 0 to 1 over the city; the parts of its tank and health; refilling, driving."""


class Result(NamedTuple):
    """What the last step of n worlds came to."""

    reward: Float64x2  # (n, 6), as in `Outcome`
    score: Float64x2  # (n, 3), SCORES
    counts: Int32x2  # (n, 4), COUNTS
    terminated: UInt8  # (n,)
    truncated: UInt8  # (n,)
    seed: Int64  # (n,)
    step: Int64  # (n,), last step done
    action: Int32x2  # (n, b), what the brigades did: 0..3, 4 of a target of their own, -1 nothing
    target: Int32x2  # (n, b), the building that they went for, -1 none


class Batch(NamedTuple):
    """What n worlds take and give."""

    actions: Int32x2  # (n, b): 0..3 as named; 4 + j: the j-th of `View.own`
    shown: View
    result: Result


opened_batch = opener(Batch)


SHOW, BEGIN, STEP_DECIDED, STEP_GIVEN = 0, 1, 2, 3
"""What is done with worlds: nothing, for their coming step has begun; their coming step begins; a step is run whose
brigades have taken their turns; a step is run in which they do what `Batch.actions` says."""


@kernel
def work_on_worlds(rows: Array, batch_row: Array, indices: Array, what: int) -> None:
    """Do something with worlds, and let learners see them.

    Args:
        rows: (n, r) int64, address rows of an `Episode` each.
        batch_row: (k,) int64, address row of the `Batch`.
        indices: (m,) int64, of the worlds; where a step is run, of such as have not ended.
        what: one of the above: one kernel for all, because what they show takes long to compile.
    """
    batch = opened_batch(batch_row)
    for k in range(len(indices)):
        i = indices[k]
        episode = opened_episode(rows[i])
        city, world, clock, warmth = episode.city, episode.world, episode.clock, episode.scratch.warmth
        brigades = world.brigades
        if what == STEP_GIVEN:
            for brigade in range(len(brigades.action)):
                follow(brigade, batch.actions[i, brigade], i, episode, batch)
        if what >= BEGIN and warmth.number[HOLDS_AFTER] != clock[STEP] + 1:
            begin(city.cover, world.fire, warmth)
        if what >= STEP_DECIDED:
            clock[STEP] += 1
            finish_step(city, world, episode.constants, warmth, clock[SEED], clock[STEP])
            score(world.fire, world.civilians, city.geometry, world.outcome)
        if what >= BEGIN:
            note_decisions(i, brigades, batch.result)
            begin_step(city, world, episode.constants, warmth, clock[STEP] + 1)
            warmth.number[HOLDS_AFTER] = clock[STEP] + 1
        show(i, episode, batch)


@kernel
def take_turn(row: Array, batch_row: Array, i: int, brigade: int) -> None:
    """Let one brigade decide, and the next one see what it does; `row`: of world i."""
    batch, episode = opened_batch(batch_row), opened_episode(row)
    follow(brigade, batch.actions[i, brigade], i, episode, batch)
    if brigade + 1 < len(episode.world.brigades.action):
        show_brigade(brigade + 1, i, episode, batch)


@kernel
def look_again(row: Array, batch_row: Array, i: int, brigade: int) -> None:
    """Let one brigade see what the others have decided by now; arguments as for `take_turn`."""
    show_brigade(brigade, i, opened_episode(row), opened_batch(batch_row))


@inner
def note_decisions(i: int, brigades: BrigadeState, result: Result) -> None:
    """Write down what the brigades of world i did in the step just done."""
    for brigade in range(len(brigades.action)):
        result.action[i, brigade], result.target[i, brigade] = brigades.action[brigade], brigades.target[brigade]


@inner
def follow(brigade: int, action: int, i: int, episode: Episode, batch: Batch) -> None:
    """Write down what a brigade of world i decides; one that chooses nothing does nothing."""
    city, world = episode.city, episode.world
    brigades, sites = world.brigades, world.sites
    target = -1
    if not can_choose(brigade, brigades.hp, brigades.refilling, sites.counts):
        action = -1
    elif stays(brigade, brigades, sites, episode.constants.brigades):
        action, target = brigades.action[brigade], brigades.target[brigade]
    elif action >= N_ACTIONS:
        target, action = batch.shown.own[i, brigade, action - N_ACTIONS], OWN_TARGET
    else:
        where = city.buildings, city.links, world.fire, city.geometry, sites
        target = find_named(brigade, action, brigades, *where, episode.constants.observation)
    brigades.action[brigade], brigades.target[brigade] = action, target
    join_site(brigade, target, brigades.site, sites, episode.constants.brigades.free)


@inner
def show(i: int, episode: Episode, batch: Batch) -> None:
    """Write what is seen of world i, in whose coming step the fire sites are found, and what its last step came to."""
    city, world, clock = episode.city, episode.world, episode.clock
    outcome, view, result = world.outcome, batch.shown, batch.result
    for k in range(len(outcome.reward)):
        result.reward[i, k] = outcome.reward[k]
    for k in range(len(outcome.score)):
        result.score[i, k] = outcome.score[k]
    for k in range(len(outcome.counts)):
        result.counts[i, k] = outcome.counts[k]
    result.seed[i], result.step[i] = clock[SEED], clock[STEP]
    over = is_over(outcome.counts[BURNING], city.buildings.later_step, clock[STEP])
    result.terminated[i] = over
    result.truncated[i] = not over and clock[STEP] >= clock[LAST_STEP]
    episode.scratch.described_at[:] = -1
    n_buildings, n_civilians = len(world.fire.energy), max(len(world.civilians.hp), 1)
    team = view.team[i]
    team[0] = (clock[LAST_STEP] - clock[STEP]) / max(clock[LAST_STEP], 1)
    for k in range(3):
        team[1 + k] = outcome.counts[(0, 2, 1)[k]] / n_buildings
    team[4] = outcome.counts[3] / n_civilians
    team[5] = outcome.score[0] / outcome.score[1]
    for brigade in range(len(world.brigades.action)):
        episode.scratch.target_before[brigade] = world.brigades.target[brigade]
    for brigade in range(len(world.brigades.action)):
        show_brigade(brigade, i, episode, batch)
    if len(view.burning):
        show_buildings(i, episode, view)


@inner
def show_brigade(brigade: int, i: int, episode: Episode, batch: Batch) -> None:
    """Write what a brigade of world i sees."""
    world, view = episode.world, batch.shown
    brigades, sites = world.brigades, world.sites
    view.state[i, brigade] = state_of(brigade, brigades.action, episode, view.features[i, brigade])
    chooses = is_asked(brigade, brigades, sites, episode.constants.brigades)
    view.alive[i, brigade], view.chooses[i, brigade] = brigades.hp[brigade] > 0, chooses
    mask, own = view.mask[i, brigade], view.own[i, brigade]
    mask[0] = 1
    for action in range(1, N_ACTIONS):
        mask[action] = chooses
    first, end = named_range(brigade, brigades.site, sites, episode.constants.brigades.free)
    for k in range(len(own)):
        there = chooses and first + k < end
        mask[N_ACTIONS + k] = there
        own[k] = sites.member[first + k] if there else -1
    if len(view.targets):
        has_site = site_place(brigade, brigades.site, sites) >= 0
        for action in range(N_ACTIONS):
            show_target(action, brigade, has_site, i, episode, view)
    if len(view.brigades):
        show_position(brigade, i, episode, view)


@inner
def show_target(action: int, brigade: int, has_site: bool, i: int, episode: Episode, view: View) -> None:
    """Write the features of the building that an action names for a brigade; MODEL 7."""
    city, world, constants, scratch = episode.city, episode.world, episode.constants, episode.scratch
    shown, seen = view.targets[i, brigade, action], scratch.seen[0]
    if not has_site:
        shown[:] = 0.0
        return
    see_target(
        brigade,
        find_target(brigade, action, world.brigades, city.buildings, world.fire, city.geometry, world.sites),
        episode.clock[STEP] + 1,
        world.brigades.target,
        sight_of(city, world, constants, scratch),
        seen,
    )
    for k in range(N_TARGET_FEATURES):
        shown[k] = seen[k]


@inner
def show_position(brigade: int, i: int, episode: Episode, view: View) -> None:
    """Write the state of a brigade itself."""
    brigades, frame, shown = episode.world.brigades, view.frame[i], view.brigades[i, brigade]
    shown[0] = (brigades.x[brigade] - frame[0]) / frame[2]
    shown[1] = (brigades.y[brigade] - frame[1]) / frame[3]
    shown[2] = brigades.tank[brigade] / max(episode.constants.brigades.tank, 1)
    shown[3] = brigades.refilling[brigade]
    shown[4] = brigades.hp[brigade] / max(episode.constants.health.initial_hp, 1)
    shown[5] = brigades.driven[brigade] > 0


@inner
def show_buildings(i: int, episode: Episode, view: View) -> None:
    """Write the burning buildings of world i and their features, as many as there is room for."""
    city, world, sites, scratch = episode.city, episode.world, episode.world.sites, episode.scratch
    n_burning = sites.counts[2]
    for k in range(view.burning.shape[1]):
        if k >= n_burning:
            view.burning[i, k] = -1
            view.buildings[i, k, :] = 0.0
            continue
        b = sites.member[k]
        view.burning[i, k] = b
        power = episode.constants.brigades.power
        describe_building(
            b,
            city.buildings,
            city.links,
            city.geometry,
            world.fire,
            sites,
            episode.constants.fire,
            power,
            scratch.described[b],
        )
        for j in range(scratch.described.shape[1]):
            view.buildings[i, k, j] = scratch.described[b, j]
