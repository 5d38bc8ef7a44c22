"""What the paper reports in its Tables 1 to 3.

A. Abdolmaleki, M. Movahedi, N. Lau, L. P. Reis: A Distributed Cooperative Reinforcement Learning Method for Decision
Making in Fire Brigade Teams. RoboCup 2012: Robot Soccer World Cup XVI, LNCS 7500, Springer 2013.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final


@dataclass(frozen=True)
class PaperTraining:
    """A row of Table 1: a training scenario with four brigades."""

    scenario: str
    convergence_episode: float
    score: float
    score_max: float


@dataclass(frozen=True)
class PaperTest:
    """A row of Table 2 or 3; pairs are without and with cooperation."""

    scenario: str
    n_brigades: int
    steps: tuple[float, float]
    burnt_out: tuple[float, float]
    score: tuple[float, float]
    score_max: float


@dataclass(frozen=True)
class World:
    """The paper's tables, and the scenarios that stand for its own."""

    name: str
    description: str
    curriculum: str
    """What its teams are trained in."""
    table_1: tuple[PaperTraining, ...]
    table_2: tuple[PaperTest, ...]
    table_3: tuple[PaperTest, ...]

    @property
    def tests(self) -> tuple[PaperTest, ...]:
        """The rows of Tables 2 and 3."""
        return (*self.table_2, *self.table_3)


TESTS: Final = World(
    name="tests",
    description="the dense city of test-1 to test-3 (--world tests)",
    curriculum="paper",
    table_1=(
        PaperTraining("train-1", 55, 9.977, 10),
        PaperTraining("train-2", 101, 8.795, 10),
        PaperTraining("train-3", 116, 10.787, 11),
        PaperTraining("train-4", 128, 8.611, 9),
        PaperTraining("train-5", 41, 9.891, 10),
        PaperTraining("train-6", 74, 9.629, 10),
        PaperTraining("train-7", 73, 8.973, 10),
        PaperTraining("train-8", 59, 11.31, 12),
    ),
    table_2=(
        PaperTest("test-1", 4, (436, 290), (410, 278), (2.017, 9.15), 12),
        PaperTest("test-2", 4, (490, 203), (541, 115), (2.564, 10.808), 12),
        PaperTest("test-3", 4, (473, 410), (570, 337), (0.27, 5.582), 10),
    ),
    table_3=(
        PaperTest("test-1-brigades-7", 7, (361, 246), (268, 167), (8.221, 10.257), 12),
        PaperTest("test-2-brigades-8", 8, (292, 113), (160, 77), (10.34, 11.198), 12),
        PaperTest("test-3-brigades-8", 8, (456, 294), (318, 112), (6.76, 8.788), 10),
    ),
)


def like_the_papers(name: str) -> str:
    """Return how one of these scenarios is called in the world like the paper's."""
    return name.replace("train-", "paper-train-").replace("test-", "paper-")


PAPER: Final = World(
    name="paper",
    description="a world like the paper's (--world paper)",
    curriculum="paper-like",
    table_1=tuple(replace(row, scenario=like_the_papers(row.scenario)) for row in TESTS.table_1),
    table_2=tuple(replace(row, scenario=like_the_papers(row.scenario)) for row in TESTS.table_2),
    table_3=tuple(replace(row, scenario=like_the_papers(row.scenario)) for row in TESTS.table_3),
)
"""A world like the paper's, `python -m benchmarks.paper_world`."""
WORLDS: Final = {world.name: world for world in (PAPER, TESTS)}
"""By name."""
DEFAULT_WORLD: Final = PAPER.name
