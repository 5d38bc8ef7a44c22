"""How a run had come out at the last step of it that was read, and what JSON gets of that and of other results."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from fireworld.errors import LogError
from fireworld.outcome import Outcome, outcome_of
from fireworld.records import CityRecord, StepRecord, Steps, StoredRun

JSON_KEYS: Final[Mapping[str, str]] = {
    "last_step": "steps",
    "time_to_complete": "time_to_complete",
    "score": "score",
    "score_max": "score_max",
    "n_burnt_out": "n_burnt_out",
    "n_civilians_alive": "n_civilians_alive",
    "sum_of_rewards": "total_reward",
    "water_used_litres": "water_used_litres",
}
"""What JSON calls the quantities of an outcome; None without one, and for what was not recorded."""


@dataclass(frozen=True)
class Totals:
    """How many steps of a run were read, and how it stood after the last of them."""

    n_steps: int
    outcome: Outcome | None = None
    """None for a run without steps."""


def totals_at(last: StepRecord | None, n_steps: int, city: CityRecord) -> Totals:
    """Return the totals of `n_steps` steps from the last of them, None if there is none."""
    return Totals(n_steps, None if last is None else outcome_of(last, city))


def totals_of(run: Steps) -> Totals:
    """Return the totals of a run, from its last step alone where the run can jump there."""
    if isinstance(run, StoredRun) and len(run):
        return totals_at(run.step(int(run.steps[-1])), len(run), run.city)
    return totals_over(run, run.city)


def totals_over(records: Iterable[StepRecord], city: CityRecord) -> Totals:
    """Return the totals of some steps; all are iterated over."""
    n_steps, last = 0, None
    for record in records:
        n_steps, last = n_steps + 1, record
    return totals_at(last, n_steps, city)


def final_outcome(run: Steps) -> Outcome:
    """Return how a run came out.

    Raises:
        LogError: it has no steps.
    """
    outcome = totals_of(run).outcome
    if outcome is None:
        raise LogError("a run without steps has no outcome")
    return outcome


def _known(outcome: Outcome, name: str) -> Any:
    """Return an attribute of an outcome, None for a number that was not recorded."""
    value = getattr(outcome, name)
    return None if isinstance(value, float) and math.isnan(value) else value


def plain(value: Any) -> Any:
    """Turn dataclasses and mappings into dicts, sequences into lists, and NaN, which JSON lacks, into text."""
    if isinstance(value, Totals):
        outcome = value.outcome
        quantities = {key: None if outcome is None else _known(outcome, name) for key, name in JSON_KEYS.items()}
        return plain({"n_steps": value.n_steps, **quantities})
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {item.name: plain(getattr(value, item.name)) for item in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value
