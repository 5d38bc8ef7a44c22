"""What a ranking prefers, in words, from sign and size of its weights; and where two rankings differ."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.errors import TrainingError
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.ranking_words import WEIGHTS
from fireworld.policy.teams.team import compare_teams
from fireworld.records import ACTIONS

NAMES = [weight.name for weight in WEIGHTS]


def make_ranking(*rows, own_targets=True):
    """Return a ranking of zeros but for the weights named in each row."""
    weights = np.zeros((len(rows), len(NAMES)))
    for row, named in enumerate(rows):
        for name, weight in named.items():
            weights[row, NAMES.index(name)] = weight
    return RankingTeam(weights, own_targets)


def test_every_weight_has_words_for_both_signs():
    words = [text for weight in WEIGHTS for text in (weight.above, weight.below)]
    assert len(set(words)) == 2 * len(NAMES)


@pytest.mark.parametrize(
    ("name", "more", "less"),
    [
        ("volume", "prefers larger buildings", "prefers smaller buildings"),
        ("exposure", "goes for what endangers unburnt buildings", "leaves what endangers unburnt buildings"),
        ("others_here", "joins those who go for the same", "avoids what others go for"),
        ("civilian_distance", "prefers what is far from civilians", "prefers what is close to civilians"),
    ],
)
def test_the_sign_says_which_way(name, more, less):
    for value, words in ((0.3, more), (-0.3, less)):
        assert list(make_ranking({name: value}).sentences(row=0)) == [f"above all: {words}"]


def test_the_size_says_how_much():
    ranking = make_ranking(
        {
            "kindling": -0.2,
            "temperature": 2.0,
            "volume": -1.0,
            "fuel_left": 0.99,
            "mine": 0.4,
            "enough": 0.39,
            "in_range": 0.1,
            "others_near": -0.099,
        }
    )
    assert list(ranking.sentences(row=0)) == [
        "above all: prefers hotter buildings, prefers smaller buildings",
        "also: prefers what has much fuel left, stays with its target",
        (
            "a little: goes along where the others are enough, leaves what is about to kindle others, "
            "prefers what it can spray at once"
        ),
    ]
    told = [(one.weight.name, one.strength) for one in ranking.preferences(row=0)]
    assert told[-1] == ("others_near", ""), "hardly counts"
    assert len(told) == 8, "weights of 0 say nothing"


def test_size_is_measured_within_a_row():
    ranking = make_ranking({"volume": 100.0, "mine": 1.0}, {"mine": 0.01, "volume": -0.01})
    assert list(ranking.sentences(row=0)) == ["above all: prefers larger buildings"]
    assert list(ranking.sentences(row=1)) == ["above all: prefers smaller buildings, stays with its target"]
    assert [weight.name for weight, _ in ranking.by_size][:2] == ["volume", "mine"]


def test_weights_of_actions_count_where_actions_are_chosen_among():
    rows = {"easiest": 2.0, "nearest-to-me": -1.5, "mine": 1.0}
    named, own = (make_ranking(rows, own_targets=own) for own in (False, True))
    assert next(named.sentences(row=0)) == (
        "above all: prefers what easiest names, avoids what nearest-to-me names, stays with its target"
    )
    assert list(own.sentences(row=0)) == ["above all: stays with its target"]
    assert [weight.name for weight in own.counted] == NAMES[:13]
    assert not {weight.name for weight, _ in own.by_size} & set(ACTIONS)
    assert len(named.by_size) == 17


def test_nothing_is_preferred():
    (sentence,) = make_ranking({}).sentences(row=0)
    assert sentence == "all weights are 0: every target is worth the same, and the first one is taken"
    assert make_ranking({"easiest": 3.0}).preferences(row=0) == []


def test_where_two_rankings_differ():
    a = make_ranking({"volume": 1.0, "mine": 2.0}, {"fuel_left": 1.0})
    b = make_ranking({"volume": 1.5, "mine": -2.0}, {"fuel_left": 1.0, "easiest": 1e-12})
    assert compare_teams(a, a).same
    found = compare_teams(a, b)
    assert not found.same
    assert [(one.row, one.name, one.a, one.b) for one in found.changed] == [
        (0, "mine", 2.0, -2.0),
        (0, "volume", 1.0, 1.5),
        (1, "easiest", 0.0, 1e-12),
    ]


def test_what_is_ranked_is_a_difference():
    found = compare_teams(make_ranking({"mine": 1.0}), make_ranking({"mine": 1.0}, own_targets=False))
    assert (found.changed, found.own_targets, found.same) == ((), (True, False), False)


def test_other_rows_cannot_be_compared():
    with pytest.raises(TrainingError, match=r"^B: weights: expected as many rows as in A, 1, got 2 of them$"):
        compare_teams(make_ranking({}), make_ranking({}, {}))
