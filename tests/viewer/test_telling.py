"""Choices in words: what for, by which value, and what the brigade saw."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fireworld_viewer.story.narration import decision_lines
from fireworld_viewer.story.series import choices_of

from fireworld.records import ACTION_NAMES, MemoryRecording
from tests.viewer.conftest import make_recording


def recording_of(**decisions: Any) -> MemoryRecording:
    """One step of three brigades that saw something; the building of index 5 has the id 105."""
    made = make_recording(3, 3, 1)
    record = list(made)[1]
    seen = {
        "free_edges": [3, 3, 3],
        "distance_from_center": [0, 1, 2],
        "distance_from_civilian": [2, 1, 0],
        "volume": [5, 0, 4],
        "others_easiest": [0, 1, 1],
        "others_nearest_to_me": [0, 0, 1],
        "state_index": [1193, 7, -1],
    }
    observations = replace(record.observations, **{name: np.array(values) for name, values in seen.items()})
    chosen = replace(record.decisions, **{name: np.array(values) for name, values in decisions.items()})
    return MemoryRecording(made.header, made.city, [replace(record, observations=observations, decisions=chosen)])


def lines_of(recording: MemoryRecording) -> list[str]:
    chosen = choices_of(recording)
    return [text for _, _, text, _ in decision_lines(recording, chosen, np.ones(chosen.action.shape, dtype=bool))]


def test_a_learned_choice_is_told_with_its_value_and_the_next_best():
    said = lines_of(
        recording_of(
            action=[1, 0, -1],
            target=[5, 5, -1],
            explored=[0, 1, 0],
            q_values=[-50.0, -41.25, -44.0, -60.0, -3.0, -1.0, -2.0, -4.0, 0.0, 0.0, 0.0, 0.0],
        )
    )
    assert said == [
        (
            "brigade 0: nearest-to-civilian → building 105, Q -41.25 against -44 of nearest-to-center, "
            "state 1193: free edges 3, center low, civilian high, volume huge, others nothing"
        ),
        (
            "brigade 1: easiest → building 105 (exploring), Q -3 against -1 of nearest-to-civilian, "
            "state 7: free edges 3, center medium, civilian medium, volume very-low, others easiest"
        ),
        "brigade 2: no choice",
    ]


def test_a_target_that_a_policy_ranks_is_told_beside_the_best_action():
    own = ACTION_NAMES.index("own-target")
    said = lines_of(
        recording_of(
            action=[own, own, 3],
            target=[5, 6, 7],
            explored=[0, 0, 0],
            q_values=[1.0, 2.0, -1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.5, 0.25, 0.75, 4.0],
            target_value=[3.88, 1.5, 4.0],
        )
    )
    assert said[0].startswith("brigade 0: own-target → building 105, value 3.88, nearest-to-civilian would be 2, state")
    assert said[1].startswith("brigade 1: own-target → building 106, value 1.5, easiest would be 0, state")
    assert said[2] == "brigade 2: nearest-to-me → building 107, value 4, nearest-to-center would be 0.75"


@pytest.mark.parametrize("values", [[], [0, 1, 0, 0] * 3])
def test_a_rule_has_no_values(values: list[float]):
    said = lines_of(recording_of(action=[1, 1, 1], target=[5, 5, 5], explored=[0, 0, 0], q_values=values))
    assert said[0].startswith("brigade 0: nearest-to-civilian → building 105, state 1193")
    assert said[2] == "brigade 2: nearest-to-civilian → building 105"
