"""What a trained team does in a state and why; what it does overall; where two teams differ."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fireworld.errors import TrainingError, expected
from fireworld.policy.team import Team
from fireworld.policy.words import FEATURES, N_STATES, features_of
from fireworld.records import ACTIONS


@dataclass(frozen=True)
class Choice:
    """What one table does in a state, and why."""

    table: int
    state: int
    """0..4319; of a table of 270 states the first of the 16 that share a row."""
    action: int
    q_values: tuple[float, ...]
    visits: tuple[int, ...]
    """How often each action was learned from in this state."""

    @property
    def visited(self) -> bool:
        """Whether training ever learned anything in this state."""
        return any(self.visits)

    @property
    def why(self) -> str:
        """The reason in words."""
        name, value = ACTIONS[self.action], self.q_values[self.action]
        others = [k for k in range(len(ACTIONS)) if k != self.action]
        second = max(others, key=lambda k: self.q_values[k])
        margin = value - self.q_values[second]
        if not self.visited:
            if not any(self.q_values):
                return f"never visited in training: all values are 0, and a tie goes to the first action, {name}"
            return f"never visited in this training: its values are those it began with, {name} the highest"
        if not self.visits[self.action]:
            return (
                f"{name} was never tried here: the value it began with, {value:.4g}, is still above {ACTIONS[second]}"
            )
        if margin == 0.0:
            return f"{name} ties with {ACTIONS[second]}, and a tie goes to the first action"
        untried = "" if self.visits[second] else ", which was never tried here"
        return f"{name} is worth {margin:.4g} more than {ACTIONS[second]}{untried}"


@dataclass(frozen=True)
class TableSummary:
    """What one table does overall."""

    n_states: int
    n_visited: int
    n_by_action: tuple[int, ...]
    """Visited states in which the table prefers each action."""


@dataclass(frozen=True)
class TeamDifference:
    """In which states two teams differ."""

    n_states: int
    changed: tuple[tuple[Choice, Choice], ...]
    """Choices of both where the action changed, table by table."""
    n_values_only: int
    """Rows of the tables with other values but the same action."""
    commit: tuple[int, int]
    """Steps that each team keeps a choice for."""

    @property
    def same(self) -> bool:
        """Whether the teams are the same, values too."""
        return self.same_actions and not self.n_values_only

    @property
    def same_actions(self) -> bool:
        """Whether the teams do the same."""
        return not self.changed and self.commit[0] == self.commit[1]

    def by_feature(self) -> Iterator[tuple[str, dict[str, int]]]:
        """Yield, for every feature, how many of the changed choices have each of its values."""
        seen = [features_of(choice.state) for choice, _ in self.changed]
        known = FEATURES if self.n_states == N_STATES else FEATURES[:4]
        for place, feature in enumerate(known):
            counts = {
                name: sum(features[place] == value for features in seen) for value, name in enumerate(feature.values)
            }
            yield feature.name, counts


def first_state(row: int, n_states: int) -> int:
    """Return the state 0..4319 of a row of a table; of 270 rows, each is that of 16 states."""
    return row * (N_STATES // n_states)


def choice(team: Team, *, table: int, state: int) -> Choice:
    """Return what a table does in a state 0..4319."""
    n_states = team.tables.shape[1]
    row = state // (N_STATES // n_states)
    values = team.tables[table, row]
    return Choice(
        table=table,
        state=first_state(row, n_states),
        action=int(values.argmax()),
        q_values=tuple(values.tolist()),
        visits=tuple(team.visits[table, row].tolist()),
    )


def summarize(team: Team) -> list[TableSummary]:
    """Return what each table does overall."""
    summaries = []
    for values, visits in zip(team.tables, team.visits, strict=True):
        visited = visits.any(axis=1)
        counts = np.bincount(values[visited].argmax(axis=1), minlength=len(ACTIONS))
        summaries.append(
            TableSummary(
                n_states=len(values), n_visited=int(visited.sum()), n_by_action=tuple(int(count) for count in counts)
            )
        )
    return summaries


def agreement(team: Team) -> tuple[int, int]:
    """Return in how many of the states that all tables visited they prefer the same action, and how many these are."""
    everywhere = team.visits.any(axis=2).all(axis=0)
    actions = team.tables.argmax(axis=2)[:, everywhere]
    return int((actions == actions[0]).all(axis=0).sum()), int(everywhere.sum())


def compare(a: Team, b: Team) -> TeamDifference:
    """Compare the tables of two teams, state by state.

    Raises:
        TrainingError: they have other states, or another number of tables.
    """
    if a.tables.shape != b.tables.shape:
        n, states, _ = a.tables.shape
        got = f"{b.tables.shape[0]} of {b.tables.shape[1]} states"
        raise TrainingError(expected("B", "tables", f"{n} of {states} states, as in A", got))
    n_states = a.tables.shape[1]
    differs = (a.tables != b.tables).any(axis=2)
    changed = a.tables.argmax(axis=2) != b.tables.argmax(axis=2)
    pairs = []
    for table, row in np.argwhere(changed):
        state = first_state(int(row), n_states)
        pairs.append((choice(a, table=int(table), state=state), choice(b, table=int(table), state=state)))
    return TeamDifference(
        n_states=n_states,
        changed=tuple(pairs),
        n_values_only=int((differs & ~changed).sum()),
        commit=(a.commit, b.commit),
    )
