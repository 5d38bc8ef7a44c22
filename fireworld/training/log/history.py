"""The history of a state: how its values came about in a training, and which steps moved them most."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from fireworld.errors import LogError, TrainingError, expected
from fireworld.kernels.learning import EXPLORED, GREEDY
from fireworld.policy.teams.table_words import first_state
from fireworld.policy.teams.team import Team
from fireworld.policy.words import N_STATES, describe_state
from fireworld.records import ACTIONS, CHOICES
from fireworld.shown import SHOWN_MAX, Block, Shown, TextTable
from fireworld.training.log.reader import LearnedEpisode, TrainingLog, learned
from fireworld.training.log.records import Episode
from fireworld.training.methods.sarsa import SarsaTrainer

MOVES_SHOWN: Final = 10


@dataclass(frozen=True)
class Moment:
    """The values of a state in one table at the end of a scenario.

    Attributes:
        part: the episode, counted through the training.
        scenario: its name.
        table: whose.
        q_values: of the four actions.
        visits: how often each was learned in the stage.
    """

    part: int
    scenario: str
    table: int
    q_values: tuple[float, ...]
    visits: tuple[int, ...]

    @property
    def action(self) -> str:
        """The greedy action."""
        return ACTIONS[int(np.argmax(self.q_values))]

    @property
    def cells(self) -> list[str]:
        """The values in words, the greedy one marked."""
        return [
            f"{'*' if name == self.action else ''}{value:.5g}"
            for name, value in zip(ACTIONS, self.q_values, strict=True)
        ]


@dataclass(frozen=True)
class Move:
    """An update of a value of the state.

    Attributes:
        scenario: its name.
        episode: its number in the scenario.
        step: in which the brigade chose in the state.
        brigade: who chose.
        action: what it chose.
        choice: greedy or explored.
        value_before: of the action.
        value_after: what it became when the brigade chose the next time, or at the end.
        td_error: the error that moved it.
    """

    scenario: str
    episode: int
    step: int
    brigade: int
    action: str
    choice: str
    value_before: float
    value_after: float
    td_error: float


@dataclass(frozen=True, repr=False)
class StateHistory(Shown):
    """What a training made of a state.

    Attributes:
        log: the file of the training.
        state: 0..4319, of states that the tables take for one the first.
        n_updates: how often its values were moved, by all brigades together.
        first: the first of these; None: it was never visited.
        moments: its values at the end of every scenario, in every table.
        moves: the updates that moved a value most, the largest first.
    """

    log: str
    state: int
    with_others: bool
    n_updates: int
    first: Move | None
    moments: tuple[Moment, ...]
    moves: tuple[Move, ...]

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield the state in words, its values at the ends of scenarios, and the steps that moved them most."""
        yield f"state {self.state}: {describe_state(self.state, with_others=self.with_others)}"
        if self.first is None:
            yield f"never visited in {self.log}"
            return
        first = self.first
        yield f"{self.n_updates:,} updates, the first in {first.scenario}, episode {first.episode}, step {first.step}"
        yield ""
        changed = list(self._changes())
        rows = [[one.scenario, str(one.table), *one.cells] for one in changed]
        heads = ["after", "table", *(action.removeprefix("nearest-") for action in ACTIONS)]
        yield TextTable(heads, rows[-limit:])
        if len(rows) > limit:
            yield f"{len(rows) - limit} changes before these; --limit shows more, --json all"
        yield "* what the table prefers"
        yield ""
        yield "the steps that moved it most"
        yield TextTable(
            ["scenario", "episode", "step", "brig", "before", "after", "action"],
            [
                [
                    one.scenario,
                    str(one.episode),
                    str(one.step),
                    str(one.brigade),
                    f"{one.value_before:.5g}",
                    f"{one.value_after:.5g}",
                    f"{one.action}{' ?' if one.choice == 'explored' else ''}",
                ]
                for one in self.moves
            ],
        )
        yield "? explored"
        yield ""
        top = self.moves[0]
        where = f"--scenario {top.scenario} --episode {top.episode}"
        yield f"fireworld replay {self.log} {where} -o episode.mcap   opens the first of these"

    def _changes(self) -> Iterator[Moment]:
        """Yield the moments at which a table's values are others than at its last moment."""
        last: dict[int, tuple[float, ...]] = {}
        for one in self.moments:
            if last.get(one.table) != one.q_values and any(one.q_values):
                yield one
            last[one.table] = one.q_values

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, as `fireworld policy show --log --json` writes them."""
        return {
            "log": self.log,
            "state": self.state,
            "words": describe_state(self.state, with_others=self.with_others),
            "n_updates": self.n_updates,
            "first": None if self.first is None else asdict(self.first),
            "moments": [{**asdict(one), "action": one.action} for one in self.moments],
            "moves": [asdict(one) for one in self.moves],
        }


def state_history(
    log: TrainingLog,
    state: int,
    *,
    n_moves: int = MOVES_SHOWN,
    team: Team | None = None,
    on_part: Callable[[], object] = lambda: None,
) -> StateHistory:
    """Return what a training made of a state, in one pass over its log.

    Args:
        log: the training, as far as it is good.
        state: 0..4319.
        n_moves: updates to list at most.
        team: what came of the training, if that is to be checked.
        on_part: called after each episode.

    Raises:
        LogError: the log changed since it was opened, or its method learns no values of states.
        TrainingError: the team is not what came of this training.
    """
    trainer = log.trainer()
    if not isinstance(trainer, SarsaTrainer):
        raise LogError(expected(str(log.path), "method", "one that learns values of states", log.method.name))
    if team is not None and team.digest != log.team().digest:
        raise TrainingError(expected("team", "", f"the one of {log.path}, digest {log.team().digest}", team.digest))
    if not 0 <= state < N_STATES:
        raise LogError(expected("state", "", f"a number from 0 to {N_STATES - 1}", state))
    names = [one.name for one in log.scenarios]
    first: Move | None = None
    moments: list[Moment] = []
    largest: list[tuple[float, int, Move]] = []
    n_updates, n_states = 0, N_STATES
    for number, part in enumerate(log.parts()):
        record: Episode = part[Episode]
        before = trainer.progress.tables, trainer.progress.visits.copy()
        found = learned(trainer, record, log.scenarios[record.scenario])
        n_states = found.tables.shape[1]
        for move in _moves(found, state, names[record.scenario]):
            first = first or move
            n_updates += 1
            heapq.heappush(largest, (abs(move.value_after - move.value_before), -n_updates, move))
            if len(largest) > n_moves:
                heapq.heappop(largest)
        if record.ended:
            row = state // (N_STATES // n_states)
            visits = trainer.progress.visits
            moments += [
                Moment(
                    number,
                    names[record.scenario],
                    table,
                    tuple(values[row].tolist()),
                    tuple(int(n) for n in visits[table, row]),
                )
                for table, values in enumerate(found.tables_after)
            ]
        trainer.progress.tables, trainer.progress.visits = before
        log.follow(trainer, part, number)
        on_part()
    return StateHistory(
        log=log.path.name,
        state=first_state(state // (N_STATES // n_states), n_states),
        with_others=n_states == N_STATES,
        n_updates=n_updates,
        first=first,
        moments=tuple(moments),
        moves=tuple(move for _, _, move in sorted(largest, reverse=True)),
    )


def _moves(found: LearnedEpisode, state: int, scenario: str) -> Iterator[Move]:
    """Yield the updates of a state in an episode; the k-th update of a brigade is about its k-th choice."""
    width = N_STATES // found.tables.shape[1]
    for brigade in range(len(found.state)):
        chosen = np.flatnonzero(np.isin(found.choice[brigade], (GREEDY, EXPLORED)))
        updated = np.flatnonzero(~np.isnan(found.td_error[brigade]))
        for row, update in zip(chosen.tolist(), updated.tolist(), strict=False):
            if found.state[brigade, row] // width == state // width:
                yield Move(
                    scenario=scenario,
                    episode=found.record.episode,
                    step=row + 1,
                    brigade=brigade,
                    action=ACTIONS[found.action[brigade, row]],
                    choice=CHOICES[found.choice[brigade, row]],
                    value_before=float(found.value_before[brigade, update]),
                    value_after=float(found.value_after[brigade, update]),
                    td_error=float(found.td_error[brigade, update]),
                )
