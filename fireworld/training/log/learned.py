"""An episode of a training with all that was learned in it."""

from __future__ import annotations

from dataclasses import dataclass

from fireworld.kernels.arrays import TOTAL
from fireworld.records import Array
from fireworld.scenario import Scenario
from fireworld.training.log.records import Episode
from fireworld.training.methods.sarsa import SarsaTrainer


@dataclass(frozen=True)
class LearnedEpisode:
    """An episode of a training with all that was learned in it; b brigades, k choices of each.

    There is a choice for every step, and where the episode was truncated one more: that which would come next.

    Attributes:
        scenario: in which it took place.
        record: as it is recorded.
        tables: (tables, states, 4) before it.
        visits: the same shape: how often each value was learned before it.
        state: (b, k) what each brigade saw, -1 where it did not look.
        action: (b, k) what it did.
        choice: (b, k) how it came to that, a position in `fireworld.records.CHOICES`.
        reward: (terms, steps) of the team, by term.
        own_reward: (b, steps) what each brigade got, if they learn from their own doing; else (0, steps).
        value_before: (b, steps + 1) the value that was updated in each step: that of the choice before; nan where there
            was no update. The last column has the updates that end the episode.
        td_error: (b, steps + 1) the error of the update.
        value_after: (b, steps + 1).
        tables_after: as `tables`.
    """

    scenario: Scenario
    record: Episode
    tables: Array
    visits: Array
    state: Array
    action: Array
    choice: Array
    reward: Array
    own_reward: Array
    value_before: Array
    td_error: Array
    value_after: Array
    tables_after: Array

    def learned_reward(self, brigade: int, row: int) -> float:
        """Return what a brigade learned from in a step, `row` from 0; 0 after the last one."""
        if row >= self.record.n_steps:
            return 0.0
        return float(self.own_reward[brigade, row] if len(self.own_reward) else self.reward[:, row].sum())


def learned(trainer: SarsaTrainer, record: Episode, scenario: Scenario) -> LearnedEpisode:
    """Let a trainer that stands before an episode learn it, and return all about it.

    Raises:
        LogError: what is recorded of it cannot be.
    """
    before, visits = trainer.progress.tables, trainer.progress.visits.copy()
    trace = record.trace(scenario.brigades.n)
    updates = trainer.learn_from(record)
    n_choices = record.n_choices
    return LearnedEpisode(
        scenario=scenario,
        record=record,
        tables=before,
        visits=visits,
        state=trace.state[:, :n_choices],
        action=trace.action[:, :n_choices],
        choice=trace.choice[:, :n_choices],
        reward=trace.reward[:TOTAL],
        own_reward=trace.reward[TOTAL:],
        value_before=updates[0],
        td_error=updates[1],
        value_after=updates[2],
        tables_after=trainer.progress.tables,
    )
