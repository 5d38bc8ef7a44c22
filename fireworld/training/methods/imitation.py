"""Imitation: improve a network that values targets by what a look-ahead makes of the options. MODEL 13."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Event
from typing import Annotated, ClassVar, Final, Literal

from fireworld.draws import MOMENT, uniform
from fireworld.planning.planner import OPTION_MAX, Planner
from fireworld.simulation.built import CityCache
from fireworld.simulation.world import World
from fireworld.training.curriculum import Curriculum
from fireworld.training.decisions import DecisionMethod, DecisionTrainer
from fireworld.training.method import Count, Limits, Positive, Share
from fireworld.training.networks import Hidden
from fireworld.training.options import TriedDecision
from fireworld.training.plans import N_PLAN_OPTIONS, follow_and_plan

PlannerCount = Annotated[int, Limits(f"a whole number from 1 to {OPTION_MAX}", 1, OPTION_MAX)]


@dataclass(frozen=True, kw_only=True)
class Imitation(DecisionMethod):
    """Imitation of a planner that looks ahead over a team, by a network that does not."""

    name: ClassVar[str] = "imitation"
    curriculum: ClassVar[str] = "conditions"
    n_options: ClassVar[int] = N_PLAN_OPTIONS

    hidden: Hidden = 72
    """Numbers of the layer between features and value, relu; 0: the value is one weighted sum."""
    start: Literal["best-2026", "best", "none"] = "best"
    """The network before the first generation, which the planner is over: it values targets as this team does;
    `none`: all of them 0."""
    n_generations: Count = 2
    n_averaged: Count = 1
    """Networks that the team is the mean of: those after the last generations, and the first one before them."""
    n_fights: Count = 1200
    """Fights of a generation, the conditions in turn."""
    n_steps_max: Count = 120
    """Steps of such a fight at most; those of the checks are as long as the scenarios."""
    lead: Share = 0.5
    """Of the fights, those in which brigades do what the planner says; in all others, what the network says."""
    horizon: PlannerCount = 30
    """Steps of the planner's rollouts."""
    interval: PlannerCount = 4
    """Steps from plan to plan."""
    n_rollouts: PlannerCount = 1
    """Rollouts of each assignment."""
    n_epochs: Count = 12
    """How often the network goes through the decisions of a generation."""
    n_batch: Count = 512
    """Decisions between two moves of the network."""
    rate: Positive = 0.001
    """Length of a move, of every number (Adam)."""
    temperature: Positive = 0.1
    """Differences of values that decide, while the network learns, how probable an option is."""
    n_checks: Count = 2
    """Fights of the team with every fire after each generation."""

    def trainer(self, curriculum: Curriculum, *, seed: int, cities: CityCache | None = None) -> ImitationTrainer:
        """Return what trains one team; see `Method.trainer`."""
        return ImitationTrainer(curriculum, self, seed=seed, cities=cities)


METHOD: Final = Imitation()


class ImitationTrainer(DecisionTrainer[Imitation]):
    """Improves one network by what a planner over its start plans; arguments as for `Method.trainer`."""

    def _tried_in(self, world: World, stop: Event) -> list[TriedDecision]:
        """Let the planner plan in a fight, which it or the network leads."""
        method = self.method
        over = self.policy_of(self._first)
        planner = Planner(horizon=method.horizon, interval=method.interval, rollouts=method.n_rollouts, over=over)
        leads = uniform(world.seed, MOMENT, 0, 0) < method.lead
        return follow_and_plan(world, planner, None if leads else self.policy_of(self.newest), stop)
