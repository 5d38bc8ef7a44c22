"""The outcome of a run at its last step, as diff and info tell it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from fireworld.records import StepRecord, Steps, StoredRun


@dataclass(frozen=True)
class Totals:
    """What a run has come to; all but the first are None for a run without steps."""

    n_steps: int
    last_step: int | None = None
    time_to_complete: int | None = None
    """The step at which nothing burned any more; None if something still burns."""
    score: float | None = None
    score_max: float | None = None
    n_burnt_out: int | None = None
    n_civilians_alive: int | None = None
    sum_of_rewards: float | None = None
    water_used_litres: float | None = None


def totals_at(last: StepRecord | None, n_steps: int) -> Totals:
    """Read the outcome off the last of `n_steps` steps."""
    if last is None:
        return Totals(n_steps)
    return Totals(
        n_steps=n_steps,
        last_step=last.step,
        time_to_complete=last.step if last.terminated else None,
        score=last.score.score,
        score_max=last.score.score_max,
        n_burnt_out=last.score.n_burnt_out,
        n_civilians_alive=last.score.n_civilians_alive,
        sum_of_rewards=last.rewards.sum_so_far,
        water_used_litres=last.score.water_used_litres,
    )


def totals_of(run: Steps) -> Totals:
    """Read the outcome of a run, from its last step alone where the run can jump there."""
    steps = run.steps
    if len(steps) and isinstance(run, StoredRun):
        return totals_at(run.step(int(steps[-1])), len(steps))
    last = deque(run, maxlen=1)
    return totals_at(last[0] if last else None, len(steps))
