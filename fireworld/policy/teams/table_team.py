"""Teams with tables: a value for every action in every state, for each brigade or one for all."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Final, Self

import numpy as np

from fireworld.errors import TrainingError, expected
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy, from_tables
from fireworld.policy.teams.npz import check_arrays, check_finite
from fireworld.policy.teams.table_words import Choice, TableDifference, describe_choices, first_state
from fireworld.policy.teams.team import Team
from fireworld.policy.words import N_STATES, N_STATES_ALONE, find_states
from fireworld.records import ACTIONS
from fireworld.shown import SHOWN_MAX, Block, TextTable

COMMIT_MAX: Final = 1_000_000


def tables_digest(tables: Array) -> bytes:
    """Return the SHA-256 of tables, (tables, states, 4)."""
    content = hashlib.sha256(repr(tables.shape).encode())
    content.update(np.ascontiguousarray(tables, dtype="<f8").data)
    return content.digest()


def agreement(tables: Array, visits: Array) -> tuple[int, int]:
    """Return in how many states all tables, (tables, states, 4), prefer the same action, and of how many visited ones.

    Only states that all of them have visited count.
    """
    everywhere = visits.any(axis=2).all(axis=0)
    actions = tables[:, everywhere].argmax(axis=2)
    return int((actions == actions[0]).all(axis=0).sum()), int(everywhere.sum())


@dataclass(frozen=True, eq=False, repr=False)
class TableTeam(Team):
    """Tables that brigades follow, one each (or one for all), and where they come from."""

    kind: ClassVar[str] = "tables"
    what: ClassVar[str] = "tables of actions"

    tables: Array  # (tables, states, 4) float64
    visits: Array  # (tables, states, 4) int64, how often each value was learned
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Curriculum, method, seed, version: plain values."""

    @property
    def digest(self) -> str:
        """SHA-256 of the tables."""
        return tables_digest(self.tables).hex()

    @property
    def summary(self) -> str:
        """How many tables of how many states."""
        n_tables, n_states, _ = self.tables.shape
        return f"{n_tables} table{'s' if n_tables > 1 else ''} of {n_states} states"

    @property
    def commit(self) -> int:
        """Steps that a choice is kept for."""
        return int(self._method.get("commit", 1))

    def policy(self) -> KernelPolicy:
        """Return the greedy policy of the team."""
        return from_tables(self.tables, commit=self.commit)

    def arrays(self) -> dict[str, Array]:
        """Return tables and visits."""
        return {
            "tables": np.ascontiguousarray(self.tables, dtype="<f8"),
            "visits": np.ascontiguousarray(self.visits, dtype="<i8"),
        }

    @classmethod
    def from_file(
        cls, header: dict[str, Any], arrays: dict[str, Array], *, provenance: Mapping[str, Any], source: str
    ) -> Self:
        """Make a team of what its file holds; see `Team.from_file`."""
        del header
        method = provenance.get("method", {})
        commit = method.get("commit", 1) if isinstance(method, dict) else None
        if type(commit) is not int or not 1 <= commit <= COMMIT_MAX:
            raise TrainingError(expected(source, "method.commit", f"a whole number from 1 to {COMMIT_MAX}", commit))
        check_arrays(arrays, "tables", "visits", source=source)
        tables, visits = arrays.pop("tables"), arrays.pop("visits")
        fits = tables.ndim == 3 and tables.shape[0] >= 1 and tables.shape[1:] in ((N_STATES, 4), (N_STATES_ALONE, 4))
        if not fits or tables.dtype != np.float64:
            wanted = "float64 tables of shape (brigades, 4320 or 270, 4)"
            raise TrainingError(expected(source, "tables", wanted, f"{tables.dtype} {tables.shape}"))
        check_finite(tables, "tables", source=source)
        if visits.shape != tables.shape or visits.dtype != np.int64 or (visits < 0).any():
            wanted = f"int64 visits >= 0 of shape {tables.shape}"
            raise TrainingError(expected(source, "visits", wanted, f"{visits.dtype} {visits.shape}"))
        return cls(np.ascontiguousarray(tables), np.ascontiguousarray(visits), provenance)

    def choice(self, *, table: int, state: int) -> Choice:
        """Return what a table does in a state 0..4319, and why."""
        n_states = self.tables.shape[1]
        row = state // (N_STATES // n_states)
        values = self.tables[table, row]
        return Choice(
            table=table,
            state=first_state(row, n_states),
            action=int(values.argmax()),
            q_values=tuple(values.tolist()),
            visits=tuple(self.visits[table, row].tolist()),
        )

    def summaries(self) -> list[tuple[int, list[int]]]:
        """Return how many states each table visited, and in how many of these it prefers each action."""
        found = []
        for values, visits in zip(self.tables, self.visits, strict=True):
            visited = visits.any(axis=1)
            counts = np.bincount(values[visited].argmax(axis=1), minlength=len(ACTIONS))
            found.append((int(visited.sum()), counts.tolist()))
        return found

    def agreement(self) -> tuple[int, int]:
        """Return in how many states all tables prefer the same action, and of how many: those that all visited."""
        return agreement(self.tables, self.visits)

    def difference(self, other: Self) -> TableDifference:
        """Compare the tables of another team with these.

        What the others do is left out of tables of 270 states: they are compared in every one of the 4320. Of teams
        that differ in their number of tables, the smaller one's are followed by further brigades, too.
        """
        shapes = self.tables.shape, other.tables.shape
        n_tables, n_states = (max(sizes) for sizes in zip(*(shape[:2] for shape in shapes), strict=True))
        a, b = (_spread(team.tables, n_tables, n_states) for team in (self, other))
        differs = (a != b).any(axis=2)
        changed = a.argmax(axis=2) != b.argmax(axis=2)
        places = [(int(table), first_state(int(row), n_states)) for table, row in np.argwhere(changed)]
        return TableDifference(
            n_states=n_states,
            changed=tuple(
                (self._choice_of(brigade=table, state=state), other._choice_of(brigade=table, state=state))
                for table, state in places
            ),
            n_values_only=int((differs & ~changed).sum()),
            commit=(self.commit, other.commit),
        )

    def describe(self, *, states: Sequence[str] = (), limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield how much each table has seen and what it prefers, and what it does in the states asked for."""
        asked = [(text, self._rows(text)) for text in states]
        n_tables, n_states, _ = self.tables.shape
        yield f"{self.summary}, {'with' if n_states == N_STATES else 'without'} what the others do"
        yield from (*self.origin, f"digest {self.digest}", "")
        summaries = self.summaries()
        rows = [["states visited", *(str(n_visited) for n_visited, _ in summaries)]]
        for k, action in enumerate(ACTIONS):
            rows.append([action, *(f"{100 * n_by[k] / n:.0f} %" if n else "-" for n, n_by in summaries)])
        yield TextTable(["", *(f"brigade {number}" for number in range(n_tables))], rows)
        if n_tables > 1:
            same, common = self.agreement()
            yield from ("", f"of {common} states that all visited, all prefer the same action in {same}")
        for text, found in asked:
            chosen = [self._choices(state) for state in found]
            yield from describe_choices(text, chosen, n_states=n_states, limit=limit)

    def as_dict(self, *, states: Sequence[str] = (), limit: int = SHOWN_MAX) -> dict[str, Any]:
        """Return what `describe` shows as plain values."""
        found = [state for text in states for state in self._rows(text)[:limit]]
        return {
            "digest": self.digest,
            "n_tables": self.tables.shape[0],
            "n_states": self.tables.shape[1],
            "provenance": self.short_provenance,
            "tables": [{"n_visited": n, "n_by_action": n_by} for n, n_by in self.summaries()],
            "states": [choice.as_dict() for state in found for choice in self._choices(state)],
        }

    def _choice_of(self, *, brigade: int, state: int) -> Choice:
        return replace(self.choice(table=brigade % len(self.tables), state=state), table=brigade, state=state)

    def _choices(self, state: int) -> list[Choice]:
        return [self.choice(table=table, state=state) for table in range(len(self.tables))]

    def _rows(self, text: str) -> list[int]:
        """Return the states that a user names, of those that a table of 270 states does not tell apart the first."""
        step = N_STATES // self.tables.shape[1]
        return list(dict.fromkeys(state // step * step for state in find_states(text)))


def _spread(tables: Array, n_tables: int, n_states: int) -> Array:
    """Return tables as those of more brigades and states: (n_tables, n_states, 4), rows and tables repeated."""
    rows = np.repeat(tables, n_states // tables.shape[1], axis=1)
    return rows[np.arange(n_tables) % len(rows)]
