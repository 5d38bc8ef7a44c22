"""What a team with tables does in a state and why, and where two such teams differ; in words and as plain values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from fireworld.kernels.learning import UNTRIED
from fireworld.policy.teams.team import TeamDifference
from fireworld.policy.words import FEATURES, N_OWN, N_STATES, describe_state, features_of, short_state
from fireworld.records import ACTIONS
from fireworld.shown import SHOWN_MAX, Block, TextTable, more


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

    def as_dict(self) -> dict[str, Any]:
        """Return the choice as plain values."""
        return {
            "state": self.state,
            "brigade": self.table,
            "action": ACTIONS[self.action],
            "q_values": self.q_values,
            "visits": self.visits,
            "why": self.why,
        }


@dataclass(frozen=True)
class TableDifference(TeamDifference):
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
        known = FEATURES if self.n_states == N_STATES else FEATURES[:N_OWN]
        for place, feature in enumerate(known):
            values = [features[place] for features in seen]
            yield feature.name, {name: values.count(value) for value, name in enumerate(feature.values)}

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield in which states the teams act differently."""
        if self.commit[0] != self.commit[1]:
            yield f"choices are kept for {self.commit[0]} / {self.commit[1]} steps"
        if self.same:
            yield f"the same: {self.n_states} states"
            return
        n_states = len({a.state for a, _ in self.changed})
        yield (
            f"another action in {n_states} of {self.n_states} states, {len(self.changed)} entries over all "
            f"brigades; {self.n_values_only} more with other values and the same action"
        )
        if not self.changed:
            return
        yield ""
        counts = [
            [name, ", ".join(f"{value} {n}" for value, n in values.items() if n)] for name, values in self.by_feature()
        ]
        yield TextTable(["feature", "changed entries by its value"], counts, n_left=2)
        yield ""
        for a, b in self.changed[:limit]:
            state = short_state(a.state, with_others=self.n_states == N_STATES)
            yield (
                f"brigade {a.table}, state {a.state}: {ACTIONS[a.action]} / {ACTIONS[b.action]}, "
                f"visits {sum(a.visits)} / {sum(b.visits)}; {state}"
            )
        yield from more(len(self.changed), limit)

    def as_dict(self, *, limit: int = SHOWN_MAX) -> dict[str, Any]:
        """Return what differs as plain values."""
        return {
            "n_states": self.n_states,
            "n_changed": len(self.changed),
            "n_values_only": self.n_values_only,
            "commit": self.commit,
            "by_feature": dict(self.by_feature()),
            "changed": [[a.as_dict(), b.as_dict()] for a, b in self.changed[:limit]],
        }


def first_state(row: int, n_states: int) -> int:
    """Return the state 0..4319 of a row of a table; of 270 rows, each is that of 16 states."""
    return row * (N_STATES // n_states)


def describe_choices(text: str, chosen: Sequence[Sequence[Choice]], *, n_states: int, limit: int) -> Iterator[Block]:
    """Yield what tables do in the states that a text asks for, and why; of several only in those seen in training."""
    listed = chosen
    if len(chosen) > 1:
        listed = [choices for choices in chosen if any(one.visited for one in choices)]
        yield from ("", f"{text}: {len(chosen)} states, {len(listed)} of them visited in training")
    for choices in listed[:limit]:
        state = choices[0].state
        yield from ("", f"state {state}: {describe_state(state, with_others=n_states == N_STATES)}", "")
        rows = [
            [
                action,
                *(f"{'> ' if one.action == k else ''}{_number(one.q_values[k])} ({one.visits[k]})" for one in choices),
            ]
            for k, action in enumerate(ACTIONS)
        ]
        yield TextTable(["value (times tried)", *(f"brigade {one.table}" for one in choices)], rows)
        for why in dict.fromkeys(one.why for one in choices):
            brigades = ", ".join(str(one.table) for one in choices if one.why == why)
            yield f"brigade {brigades}: {why}"
    if len(listed) > limit:
        yield from ("", *more(len(listed), limit))


def _number(value: float) -> str:
    if value == UNTRIED:
        return "never tried"
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.4g}"
