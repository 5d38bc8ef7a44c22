"""Where two runs decided otherwise, by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from fireworld.recording.decisions import RecordedDecisions
from fireworld.recording.explanation.spans import DecisionSpan, find_spans, span_at


def decisions(*brigades, targets=()):
    """Make recorded decisions of each brigade's actions, a digit a step from step 1 on; "-" is no decision.

    targets: what all of them go for, step by step.
    """
    rows = [[-1 if letter == "-" else int(letter) for letter in actions] for actions in brigades]
    records = [
        SimpleNamespace(
            step=step,
            decisions=SimpleNamespace(
                action=np.array(made, dtype=np.int32),
                target=np.full(len(made), targets[step - 1] if targets else -1),
                q_values=np.zeros(0),
                target_value=np.zeros(0),
                explored=np.zeros(len(made), dtype=np.uint8),
                epsilon=0.0,
            ),
        )
        for step, made in enumerate(zip(*rows, strict=True), start=1)
    ]
    return RecordedDecisions(records)


def spans(worse, better):
    return find_spans(decisions(worse), decisions(better), n_brigades=1)


def test_equal_decisions_make_no_span():
    assert spans("0123", "0123") == []


def test_a_span_ends_where_the_decisions_are_equal():
    assert spans("0030", "0333") == [DecisionSpan(0, 2, 2, 3, (0,)), DecisionSpan(0, 4, 4, 3, (0,))]


def test_a_span_ends_where_the_better_run_does_something_else():
    assert spans("0000", "1122") == [DecisionSpan(0, 1, 2, 1, (0,)), DecisionSpan(0, 3, 4, 2, (0,))]


def test_a_span_may_replace_several_actions():
    assert spans("0120", "3333") == [DecisionSpan(0, 1, 4, 3, (0, 1, 2))]


def test_a_brigade_that_refills_neither_begins_nor_ends_a_span():
    assert spans("-0-00-", "333-3-") == [DecisionSpan(0, 2, 5, 3, (0,))]


def test_steps_that_one_run_alone_has_are_no_span():
    assert spans("0000", "33") == [DecisionSpan(0, 1, 2, 3, (0,))]


def test_the_earliest_come_first_then_the_lowest_brigade():
    found = find_spans(decisions("0100", "0000"), decisions("0110", "2300"), n_brigades=2)
    assert [(one.first, one.brigade) for one in found] == [(1, 1), (2, 1), (3, 0)]


def test_words_and_halves():
    span = DecisionSpan(2, 14, 22, 3, (0, 1))
    assert str(span) == "nearest-to-me instead of easiest or nearest-to-civilian"
    assert [(half.first, half.last) for half in span.halves()] == [(14, 18), (19, 22)]
    assert span.n_steps == 9


def test_the_span_of_a_brigade_and_step():
    forced = [DecisionSpan(0, 2, 3, 3, (0,)), DecisionSpan(1, 3, 3, 1, (0,))]
    assert [span_at(forced, 0, step) for step in (1, 2, 3, 4)] == [None, forced[0], forced[0], None]
    assert [span_at(forced, 1, step) for step in (2, 3, 4)] == [None, forced[1], None]


def test_other_targets_of_its_own_are_other_decisions():
    worse, better = decisions("4440", targets=[7, 8, 9, 9]), decisions("4444", targets=[7, 5, 6, 6])
    (span,) = find_spans(worse, better, n_brigades=1)
    assert span == DecisionSpan(0, 2, 4, 4, (4, 0))
    assert str(span) == "own-target instead of other targets or easiest"


def test_targets_of_its_own_in_words():
    made = decisions("41444", targets=[7, 3, 5, 7, 8])
    assert made.targets(0, first=1, last=5) == [7, 5, 8]
    assert made.targets(0, first=2, last=2) == []
    span = DecisionSpan(0, 1, 5, 4, (0, 4))
    assert span.text([301]) == "own-target:301 instead of easiest or other targets"
    assert span.text([301, 4]) == "own-target (2 buildings) instead of easiest or other targets"


def test_where_nothing_is_recorded_the_last_action_goes_on():
    made = decisions("-2--")
    assert made.made(1, 0) is None
    assert [made.at(step, 0).action for step in (1, 2, 3, 9)] == [0, 2, 2, 2]
