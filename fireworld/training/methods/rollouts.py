"""Rollouts: improve a network that values targets by what the options of its own decisions come to. MODEL 11."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Event
from typing import ClassVar, Final, Literal

from fireworld.simulation.built import CityCache
from fireworld.simulation.world import World
from fireworld.training.curriculum import Curriculum
from fireworld.training.decisions import DecisionMethod, DecisionTrainer
from fireworld.training.method import Count, CountOrNone, Positive, PositiveShare
from fireworld.training.networks import Hidden
from fireworld.training.options import Trial, TriedDecision, try_options


@dataclass(frozen=True, kw_only=True)
class Rollouts(DecisionMethod):
    """Improvement of a network that values targets by rollouts of its own decisions."""

    name: ClassVar[str] = "rollouts"
    curriculum: ClassVar[str] = "conditions"

    hidden: Hidden = 24
    """Numbers of the layer between features and value, relu; 0: the value is one weighted sum."""
    start: Literal["best-2026", "best", "none"] = "best-2026"
    """The network before the first generation: it values targets as this team does; `none`: all of them 0."""
    n_generations: Count = 4
    n_averaged: Count = 3
    """Networks that the team is the mean of: those after the last generations, and the first one before them."""
    n_fights: Count = 2500
    """Fights of a generation, the conditions in turn."""
    n_steps_max: Count = 200
    """Steps of such a fight at most; those of the checks are as long as the scenarios."""
    share: PositiveShare = 0.27
    """Of the first 12 steps of a fight in which options are tried out; of later ones a third of it."""
    n_brigades: Count = 2
    """Brigades whose options are tried out in such a step."""
    n_options: Count = 7
    """Targets that are tried out of each, its own choice among them."""
    n_likely: CountOrNone = 0
    """Of the others so many are those that the network values next; the rest is drawn."""
    n_rollouts: Count = 2
    """Rollouts of each target; the same random draws for all."""
    commit: Count = 6
    """Steps for which the brigade goes for the target, while that burns; then it decides as the team."""
    horizon: Count = 50
    """Steps of a rollout."""
    n_epochs: Count = 40
    """How often the network goes through the decisions of a generation."""
    n_batch: Count = 512
    """Decisions between two moves of the network."""
    rate: Positive = 0.002
    """Length of a move, of every number (Adam)."""
    temperature: Positive = 0.1
    """Differences of values that decide, while the network learns, how probable an option is."""
    n_checks: Count = 2
    """Fights of the team with every fire after each generation."""

    def trainer(self, curriculum: Curriculum, *, seed: int, cities: CityCache | None = None) -> RolloutsTrainer:
        """Return what trains one team; see `Method.trainer`."""
        return RolloutsTrainer(curriculum, self, seed=seed, cities=cities)

    @property
    def trial(self) -> Trial:
        """How options are tried out."""
        return Trial(
            share=self.share,
            n_brigades=self.n_brigades,
            n_options=self.n_options,
            n_likely=self.n_likely,
            n_rollouts=self.n_rollouts,
            commit=self.commit,
            horizon=self.horizon,
        )


METHOD: Final = Rollouts()


class RolloutsTrainer(DecisionTrainer[Rollouts]):
    """Improves one network by rollouts of its own decisions; arguments as for `Method.trainer`."""

    def _tried_in(self, world: World, stop: Event) -> list[TriedDecision]:
        """Fight as the network says, and try options of its decisions out."""
        return try_options(world, self.policy_of(self.newest), self.method.trial, stop)
