"""What is plotted of a run, step by step: fields of its records and their labels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fireworld.outcome import QUANTITIES
from fireworld.records import Recording

REWARD_TERMS: Final = ("rewards.water_damaged", "rewards.burning", "rewards.burnt_out", "rewards.civilians")

LABELS: Final[Mapping[str, str]] = {
    **{one.field: one.label.removeprefix("still ") for one in QUANTITIES if one.field},
    "score.score_max": "greatest",
    "score.score_now": "by today's rule",
    **{term: term.removeprefix("rewards.") for term in REWARD_TERMS},
    "rewards.water_damaged": "water-damaged",
    "rewards.burnt_out": "burnt out",
    "rewards.total": "total",
}
"""What curves are called, by field; what is still burning after the last step is burning before."""


def series(recording: Recording, field: str) -> NDArray[np.float64]:
    """Return a field over all steps, as in "score.n_burning": (k,) of a value, (k, width) of an array."""
    topic, _, name = field.partition(".")
    return np.asarray(recording.column(f"/{topic}", name), dtype=np.float64)
