"""Assignment: the search for a ranking of targets by which brigades are assigned to them together. MODEL 7.2."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Final

from fireworld.errors import TrainingError, expected
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy, from_assignment
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum
from fireworld.training.methods.search import Search, SearchTrainer


@dataclass(frozen=True, kw_only=True)
class AssignmentSearch(Search):
    """Search for the weights of a ranking by which brigades are assigned to targets; hyperparameters as of `search`."""

    name: ClassVar[str] = "assignment"

    def __post_init__(self) -> None:
        """Raise TrainingError if a hyperparameter is not what it may be."""
        super().__post_init__()
        if not self.own_targets:
            wanted = "true: brigades are assigned to any burning building"
            raise TrainingError(expected("method", "own_targets", wanted, self.own_targets))

    def trainer(self, curriculum: Curriculum, *, seed: int, cities: CityCache | None = None) -> AssignmentTrainer:
        """Return what searches for one team; see `Method.trainer`."""
        return AssignmentTrainer(curriculum, self, seed=seed, cities=cities)


METHOD: Final = AssignmentSearch()


class AssignmentTrainer(SearchTrainer):
    """Searches for one ranking; arguments as for `Method.trainer`."""

    def team(self) -> RankingTeam:
        """Return what has been found so far: the mean of the distribution that candidates are drawn from."""
        return replace(super().team(), assigned=True)

    def policy_of(self, numbers: Array) -> KernelPolicy:
        """Return the policy of a team that is assigned by these weights, (17,) float64."""
        return from_assignment(numbers)
