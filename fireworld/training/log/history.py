"""The history of a state: how its values came about in a training, and which steps moved them most."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from fireworld.errors import LogError, expected
from fireworld.kernels.learning import EXPLORED, GREEDY
from fireworld.policy.teams.table_words import first_state
from fireworld.policy.words import N_STATES, describe_state
from fireworld.records import ACTIONS, CHOICES, Array
from fireworld.shown import SHOWN_MAX, Block, Shown, TextTable
from fireworld.training.log.learned import LearnedEpisode
from fireworld.training.log.reader import TrainingLog

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
        reward: of the team in that step, undiscounted.
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
    reward: float

    @property
    def place(self) -> str:
        """Where it was, as in "train-3, episode 41, step 17"."""
        return f"{self.scenario}, episode {self.episode}, step {self.step}"


@dataclass(frozen=True, repr=False)
class StateHistory(Shown):
    """What a training made of a state.

    Attributes:
        log: the file of the training.
        state: 0..4319, of states that the tables take for one the first.
        with_others: the tables see what the other brigades do.
        n_updates: how often its values were moved, by all brigades together.
        firsts: the first of these of each brigade that was ever in it, in their order; the state's first is the first.
        moments: its values at the end of every scenario, in every table.
        moves: the updates that moved a value most, the largest first.
    """

    log: str
    state: int
    with_others: bool
    n_updates: int
    firsts: tuple[Move, ...]
    moments: tuple[Moment, ...]
    moves: tuple[Move, ...]

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield the state in words, its values at the ends of scenarios, and the steps that moved them most."""
        yield f"state {self.state}: {describe_state(self.state, with_others=self.with_others)}"
        if not self.firsts:
            yield f"never visited in {self.log}"
            return
        yield f"{self.n_updates:,} updates"
        for first in self.firsts:
            yield f"brigade {first.brigade} was first in it in {first.place}"
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
            ["scenario", "ep", "step", "brig", "before", "after", "reward", "action"],
            [
                [
                    one.scenario,
                    str(one.episode),
                    str(one.step),
                    str(one.brigade),
                    f"{one.value_before:.5g}",
                    f"{one.value_after:.5g}",
                    f"{one.reward:.0f}",
                    f"{one.action}{' ?' if one.choice == 'explored' else ''}",
                ]
                for one in self.moves
            ],
        )
        yield "? explored; reward: of the team in that step"
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
            "firsts": [asdict(one) for one in self.firsts],
            "moments": [{**asdict(one), "action": one.action} for one in self.moments],
            "moves": [asdict(one) for one in self.moves],
        }


def state_history(log: TrainingLog, state: int, *, n_moves: int = MOVES_SHOWN) -> StateHistory:
    """Return what a training made of a state; arguments and errors as for `state_histories`."""
    return state_histories(log, [state], n_moves=n_moves)[0]


def state_histories(
    log: TrainingLog,
    states: Sequence[int],
    *,
    n_moves: int = MOVES_SHOWN,
    on_part: Callable[[], object] = lambda: None,
) -> list[StateHistory]:
    """Return what a training made of some states, in one pass over its log.

    Args:
        log: the training, as far as it is good.
        states: 0..4319 each.
        n_moves: updates to list of each at most.
        on_part: called after each episode.

    Raises:
        LogError: the log changed since it was opened, or its method learns no values of states.
    """
    trainer = log.learner()
    for state in states:
        if not 0 <= state < N_STATES:
            raise LogError(expected("state", "", f"a number from 0 to {N_STATES - 1}", state))
    found = [_Gathering(state, n_moves) for state in states]
    n_states = N_STATES
    for number, part in enumerate(log.parts()):
        episode = log.learn(trainer, part, number)
        n_states = episode.tables.shape[1]
        for one in found:
            one.add(number, episode, trainer.progress.visits)
        on_part()
    return [one.history(log.path.name, n_states) for one in found]


class _Gathering:
    """Gathers the history of a state, episode by episode."""

    def __init__(self, state: int, n_moves: int) -> None:
        self._state, self._n_moves = state, n_moves
        self._firsts: dict[int, Move] = {}
        self._moments: list[Moment] = []
        self._largest: list[tuple[float, int, Move]] = []
        self._n_updates = 0

    def add(self, number: int, episode: LearnedEpisode, visits: Array) -> None:
        """Add the next episode; `visits` are those after it."""
        name, width = episode.scenario.name, N_STATES // episode.tables.shape[1]
        for move in sorted(_moves(episode, self._state), key=lambda move: (move.step, move.brigade)):
            self._firsts.setdefault(move.brigade, move)
            self._n_updates += 1
            heapq.heappush(self._largest, (abs(move.value_after - move.value_before), -self._n_updates, move))
            if len(self._largest) > self._n_moves:
                heapq.heappop(self._largest)
        if episode.record.ended:
            row = self._state // width
            self._moments += [
                Moment(number, name, table, tuple(values[row].tolist()), tuple(visits[table, row].tolist()))
                for table, values in enumerate(episode.tables_after)
            ]

    def history(self, log: str, n_states: int) -> StateHistory:
        """Return the history of the state."""
        return StateHistory(
            log=log,
            state=first_state(self._state // (N_STATES // n_states), n_states),
            with_others=n_states == N_STATES,
            n_updates=self._n_updates,
            firsts=tuple(self._firsts.values()),
            moments=tuple(self._moments),
            moves=tuple(move for _, _, move in sorted(self._largest, reverse=True)),
        )


def _moves(found: LearnedEpisode, state: int) -> Iterator[Move]:
    """Yield the updates of a state in an episode; the k-th update of a brigade is about its k-th choice."""
    width = N_STATES // found.tables.shape[1]
    for brigade in range(len(found.state)):
        chosen = np.flatnonzero(np.isin(found.choice[brigade], (GREEDY, EXPLORED)))
        updated = np.flatnonzero(~np.isnan(found.td_error[brigade]))
        for row, update in zip(chosen.tolist(), updated.tolist(), strict=False):
            if found.state[brigade, row] // width == state // width:
                yield Move(
                    scenario=found.scenario.name,
                    episode=found.record.episode,
                    step=row + 1,
                    brigade=brigade,
                    action=ACTIONS[found.action[brigade, row]],
                    choice=CHOICES[found.choice[brigade, row]],
                    value_before=float(found.value_before[brigade, update]),
                    value_after=float(found.value_after[brigade, update]),
                    td_error=float(found.td_error[brigade, update]),
                    reward=found.learned_reward(brigade, row),
                )
