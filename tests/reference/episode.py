"""Whole episodes in plain numpy and Python: the readable reference of a step, and the baseline of the benchmarks."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from typing import Self

import numpy as np

from fireworld.city.city import Array, City, Float64Array
from fireworld.draws import BURN_RATE, DAMAGE, DAMAGE_NOISE
from fireworld.parameters import Parameters
from fireworld.policy.kernel import KernelPolicy
from tests.reference import fire, outcome, people, random_draws, ranking, sites, team
from tests.reference.learning import Learner

PAPERS = outcome.Reward()


@dataclass(frozen=True)
class Tables:
    """What is fixed during an episode."""

    parameters: Parameters
    fire: fire.FireTables
    sites: sites.SiteTables
    streets: team.StreetArrays
    floor_area: Float64Array  # (n,) m2
    reward: outcome.Reward
    in_turn: bool  # brigades see what those before them have chosen in this step

    @classmethod
    def of_city(
        cls,
        city: City,
        parameters: Parameters,
        *,
        unit_volume_m3: float | None = None,
        reward: outcome.Reward = PAPERS,
        in_turn: bool = True,
    ) -> Self:
        """Prepare a city."""
        return cls(
            parameters=parameters,
            fire=fire.FireTables.of_city(city, parameters.fire),
            sites=sites.SiteTables.of_city(city, unit_volume_m3=unit_volume_m3),
            streets=team.StreetArrays.of_city(city),
            floor_area=city.footprints.ground_area_m2.astype(np.float64) * city.footprints.floors,
            reward=reward,
            in_turn=in_turn,
        )


@dataclass
class People:
    """Everybody's health: the c civilians, then the b brigades."""

    n_civilians: int
    place_mm: Float64Array  # (c, 2) of the civilians
    building: Array  # (c + b,) where each one is, -1 outdoors
    share: Float64Array  # (c + b,) part of the damage that each one takes
    hp: Array  # (c + b,)
    damage: Float64Array  # (c + b,) health points lost per step

    @classmethod
    def healthy(cls, parameters: Parameters, *, civilian_building: Array, civilian_mm: Array, n_brigades: int) -> Self:
        """Return people whom nothing has happened to."""
        n_civilians = len(civilian_building)
        outdoors = np.full(n_brigades, -1)
        return cls(
            n_civilians=n_civilians,
            place_mm=np.asarray(civilian_mm, dtype=np.float64).reshape(-1, 2),
            building=np.concatenate([np.asarray(civilian_building, dtype=np.int64), outdoors]),
            share=np.repeat([1.0, parameters.health.brigade_share], [n_civilians, n_brigades]),
            hp=np.full(n_civilians + n_brigades, parameters.health.initial_hp, dtype=np.int32),
            damage=np.zeros(n_civilians + n_brigades),
        )

    def exposed(self, fieryness: Array) -> Array:
        """(c + b,) bool: inside a burning building."""
        return (self.building >= 0) & (fieryness[self.building] - np.uint8(1) < 3)


@dataclass
class World:
    """Everything that a step changes."""

    fire: fire.FireState
    people: People
    team: list[team.Brigade]
    memory: sites.Memory
    outcome: outcome.Outcome

    @classmethod
    def at_start(
        cls, tables: Tables, *, ignited: Array, civilian_building: Array, civilian_mm: Array, brigade_refuge: Array
    ) -> Self:
        """Set up the start; arguments as of `fireworld.simulation.placement.Placement`."""
        state = fire.FireState.cold(tables.fire)
        fire.ignite(tables.fire, state, np.asarray(ignited, dtype=np.int64))
        streets, parameters = tables.streets, tables.parameters
        refuges = np.asarray(brigade_refuge).tolist()
        world = cls(
            fire=state,
            people=People.healthy(
                parameters,
                civilian_building=civilian_building,
                civilian_mm=civilian_mm,
                n_brigades=len(refuges),
            ),
            team=[
                team.Brigade(streets.entrance[b], *streets.entrance_mm[b], parameters.brigades.tank_litres)
                for b in refuges
            ],
            memory=sites.Memory(np.zeros(len(state.energy), dtype=np.int64)),
            outcome=outcome.Outcome(),
        )
        assess(tables, world)
        world.outcome.reward, world.outcome.reward_so_far = (0.0,) * 4, 0.0
        return world

    def copy(self) -> World:
        """Return an independent copy."""
        return deepcopy(self)


def advance(
    tables: Tables, world: World, policy: KernelPolicy, *, seed: int, step: int, learner: Learner | None = None
) -> None:
    """Run one step: look and decide, act, burn, hurt, assess."""
    decide(tables, world, policy, seed=seed, step=step, learner=learner)
    world.outcome.water_litres += team.act(
        world.team,
        alive(world),
        streets=tables.streets,
        tables=tables.sites,
        state=world.fire,
        parameters=tables.parameters.brigades,
    )
    burn(tables, world, seed=seed, step=step)
    hurt(tables, world, seed=seed, step=step)
    assess(tables, world)


def run_episode(
    tables: Tables,
    world: World,
    policy: KernelPolicy,
    *,
    seed: int,
    first_step: int,
    last_step: int,
    learner: Learner | None = None,
) -> int:
    """Run steps first_step..last_step, or until nothing burns; return the last step run. A learner learns meanwhile."""
    for step in range(first_step, last_step + 1):
        advance(tables, world, policy, seed=seed, step=step, learner=learner)
        if learner is not None:
            learner.take(sum(world.outcome.reward))
        if world.outcome.n_burning == 0:
            if learner is not None:
                learner.end()
            return step
    if learner is not None:
        decide(tables, world, policy, seed=seed, step=last_step + 1, learner=learner, truncated=True)
    return last_step


def alive(world: World) -> list[bool]:
    """Tell which brigades live."""
    return [hp > 0 for hp in world.people.hp[world.people.n_civilians :].tolist()]


def look(tables: Tables, world: World) -> sites.Sites | None:
    """Find the fire sites and settle which brigade belongs to which; None if nothing burns."""
    crowd, civilians = world.people, slice(world.people.n_civilians)
    can_be_saved = (crowd.hp[civilians] > 0) & ~crowd.exposed(world.fire.fieryness)[civilians]
    found = sites.find_sites(tables.sites, world.fire.fieryness, world.memory, crowd.place_mm[can_be_saved])
    team.join_sites(world.team, tables.sites, found)
    return found


def decide(
    tables: Tables,
    world: World,
    policy: KernelPolicy,
    *,
    seed: int,
    step: int,
    learner: Learner | None = None,
    truncated: bool = False,
) -> None:
    """Let the brigades look and choose, one after another; a learner hears of it, after a truncation of all of them."""
    found = look(tables, world)
    before = [brigade.action for brigade in world.team]
    went_for = [brigade.target for brigade in world.team]
    for who, (brigade, lives) in enumerate(zip(world.team, alive(world), strict=True)):
        brigade.target = -1
        if found is None or brigade.refilling or not lives:
            brigade.action = -1
            continue
        if ranking.ranks(policy, who):
            goals = [other.target for other in world.team] if tables.in_turn else went_for
            others = goals[:who] + goals[who + 1 :]
            moment = ranking.Moment(tables.fire, tables.sites, tables.parameters.brigades, world.fire, found)
            brigade.action, brigade.target = ranking.choose(
                policy, who, brigade, moment, last_target=went_for[who], others=others
            )
            continue
        known = [other.action for other in world.team] if tables.in_turn else before
        state = team.observe(brigade, known[:who] + known[who + 1 :], found)
        keeps = team.keeps_choice(policy, who, before[who], step)
        if not keeps:
            brigade.action = team.choose(policy, who, state, seed=seed, step=step)
        if learner is not None and (truncated or not keeps):
            learner.hear(who, state, brigade.action, bound=keeps)
        brigade.target = team.find_target(
            brigade,
            brigade.action,
            tables=tables.sites,
            found=found,
            energy=world.fire.energy,
            capacity=tables.fire.capacity,
        )


def burn(tables: Tables, world: World, *, seed: int, step: int) -> None:
    """Draw the burn rates of the burning buildings and advance the fire."""
    burning = np.flatnonzero(fire.is_burning(tables.fire, world.fire))
    parameters = tables.parameters.fire
    rate = np.zeros(len(world.fire.energy))
    deviates = random_draws.normals(seed, BURN_RATE, burning, step)
    rate[burning] = parameters.burn_rate_mean + parameters.burn_rate_sd * deviates
    fire.advance_fire(tables.fire, world.fire, rate)


def hurt(tables: Tables, world: World, *, seed: int, step: int) -> None:
    """Let fire hurt the civilians, and the brigades that refill inside a burning refuge; MODEL 3."""
    crowd, parameters = world.people, tables.parameters.health
    for k, brigade in enumerate(world.team):
        crowd.building[crowd.n_civilians + k] = brigade.refuge if brigade.activity == team.REFILLING else -1
    living = crowd.hp > 0
    exposed = np.flatnonzero(crowd.exposed(world.fire.fieryness) & living)
    hurt_before = (crowd.damage > 0) & living
    if not len(exposed) and not hurt_before.any():
        return
    exposure, noise = np.zeros(len(crowd.hp)), np.zeros(len(crowd.hp))
    draw = random_draws.uniforms(seed, DAMAGE, exposed, step)
    exposure[exposed] = people.expose(draw, parameters) * crowd.share[exposed]
    harmed = np.flatnonzero(hurt_before | (exposure > 0))
    noise[harmed] = parameters.noise_mean + parameters.noise_sd * random_draws.normals(seed, DAMAGE_NOISE, harmed, step)
    people.suffer(crowd.hp, crowd.damage, exposure, noise, parameters)


def assess(tables: Tables, world: World) -> None:
    """Write what the step was worth."""
    outcome.assess(
        world.outcome,
        fieryness=world.fire.fieryness,
        floor_area=tables.floor_area,
        hp=world.people.hp[: world.people.n_civilians],
        full_hp=tables.parameters.health.initial_hp,
        reward=tables.reward,
    )
