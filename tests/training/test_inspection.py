"""What a team does, in words: states, choices and why, and the states in which two teams differ."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fireworld.errors import PolicyError
from fireworld.kernels.observation import state_index
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import compare_teams
from fireworld.policy.words import FEATURES, RADIX, describe_state, features_of, find_states, short_state


def make_team(values=(), visits=(), *, n_tables=1, n_states=4320, commit=1):
    """Return a team of zeros, but for these (table, row): four values, and these visits."""
    team = TableTeam(
        np.zeros((n_tables, n_states, 4)),
        np.zeros((n_tables, n_states, 4), dtype=np.int64),
        {"method": {"commit": commit}},
    )
    for array, entries in ((team.tables, values), (team.visits, visits)):
        for place, content in dict(entries).items():
            array[place] = content
    return team


def state_of(features):
    """The state of eight features, as the kernels number it."""
    return state_index(np.array(features, dtype=np.int64))


def test_states_are_those_of_the_kernels():
    assert tuple(len(feature.values) for feature in FEATURES) == RADIX
    for state in range(0, 4320, 97):
        features = features_of(state)
        assert state_of(features) == state
        assert find_states(str(state)) == [state]
        exact = short_state(state) + "".join(
            f",{feature.name}=no" for feature, value in zip(FEATURES[4:], features[4:], strict=True) if not value
        )
        assert find_states(exact) == [state]


def test_a_state_in_words():
    state = state_of((1, 0, 2, 4, 1, 0, 0, 1))
    words = "free to spread over 1 side, distance from center low, from a civilian high, burning volume very high"
    assert describe_state(state) == f"{words}; others do easiest, nearest-to-me"
    assert describe_state(state, with_others=False) == words
    assert describe_state(0).endswith("others do nothing")
    assert short_state(state).endswith("volume=very-high,others_easiest=yes,others_nearest_to_me=yes")


def test_states_by_features():
    found = find_states("free_edges=3, volume=high")
    assert len(found) == 3 * 3 * 16
    assert all(features_of(state)[0] == 3 and features_of(state)[3] == 3 for state in found)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("4320", r"STATE: expected a number from 0 to 4319, got '4320'"),
        ("9" * 5000, "a number from 0 to 4319"),
        ("-1", "a number, or features as in free_edges=3,volume=high"),
        ("", "a number, or features"),
        ("volume=enormous", "STATE: volume: expected one of very-low, low, .*, got 'enormous'"),
        ("wind=high", "STATE: wind: expected one of free_edges, .*, got 'wind'"),
        ("volume=high,volume=low", "volume: expected one value, got low besides another"),
        ("volume=high,", "a number, or features"),
    ],
)
def test_a_state_that_is_none(text, message):
    with pytest.raises(PolicyError, match=message):
        find_states(text)


@pytest.mark.parametrize(
    ("values", "visits", "action", "why"),
    [
        ((-9, -4, -7, -8), (1, 2, 3, 4), 1, "nearest-to-civilian is worth 3 more than nearest-to-center"),
        (
            (-9, -4, 0, -8),
            (1, 2, 0, 4),
            2,
            "nearest-to-center was never tried here: the value it began with, 0, is still",
        ),
        (
            (2, 0, -7, -8),
            (1, 0, 3, 4),
            0,
            "easiest is worth 2 more than nearest-to-civilian, which was never tried here",
        ),
        ((-2, -1, -7, -1), (1, 1, 3, 4), 1, "nearest-to-civilian ties with nearest-to-me, and a tie goes to the first"),
        ((0, 0, 0, 0), (0, 0, 0, 0), 0, "never visited in training: all values are 0, and a tie goes to the first"),
        ((0, 0, 0, 5), (0, 0, 0, 0), 3, "never visited in this training: its values are those it began with"),
    ],
)
def test_what_a_team_does_and_why(values, visits, action, why):
    one = make_team({(0, 9): values}, {(0, 9): visits}).choice(table=0, state=9)
    assert one.action == action
    assert one.why.startswith(why)
    assert one.visited == any(visits)


def test_a_table_of_270_states_does_not_tell_what_others_do():
    team = make_team({(0, 3): (0, 0, 1, 0)}, n_states=270)
    ones = [team.choice(table=0, state=state) for state in (48, 55, 63)]
    assert {(one.state, one.action) for one in ones} == {(48, 2)}
    assert team.choice(table=0, state=64).action == 0


def test_a_summary():
    values = {
        (0, 1): (0, 1, 0, 0),
        (0, 2): (0, 1, 0, 0),
        (0, 3): (1, 0, 0, 0),
        (1, 1): (0, 2, 0, 0),
        (1, 2): (3, 0, 0, 0),
    }
    team = make_team(values, dict.fromkeys([*values][:2] + [*values][3:], (1, 0, 0, 0)), n_tables=2)
    assert team.summaries() == [(2, [0, 2, 0, 0]), (2, [1, 1, 0, 0])]
    assert team.agreement() == (1, 2)


def test_where_two_teams_differ():
    state = state_of((3, 0, 0, 2, 0, 0, 0, 0))
    a = make_team({(1, state): (1, 0, 0, 0), (0, 5): (1, 0, 0, 0)}, n_tables=2)
    b = make_team({(1, state): (0, 0, 1, 0), (0, 5): (2, 0, 0, 0)}, n_tables=2)
    assert compare_teams(a, a).same
    found = compare_teams(a, b)
    assert (found.same, found.same_actions, found.n_values_only) == (False, False, 1)
    ((one, other),) = found.changed
    assert (one.table, one.state, one.action, other.action) == (1, state, 0, 2)
    counts = dict(found.by_feature())
    assert counts["free_edges"] == {"0": 0, "1": 0, "2": 0, "3": 1, "4": 0}
    assert counts["volume"]["medium"] == 1
    values_only = compare_teams(a, make_team({(1, state): (1, 0, 0, 0), (0, 5): (2, 0, 0, 0)}, n_tables=2))
    assert values_only.same_actions
    assert not values_only.same


def test_how_long_choices_are_kept_is_a_difference():
    assert not compare_teams(make_team(), make_team(commit=2)).same_actions


def test_a_team_that_sees_less_is_compared_in_all_states_of_the_other():
    state, alone = state_of((3, 0, 0, 2, 0, 0, 0, 1)), state_of((3, 0, 0, 2, 0, 0, 0, 0)) // 16
    a = make_team({(1, state): (0, 0, 0, 1)}, n_tables=2)
    b = make_team({(0, alone): (0, 0, 1, 0)}, n_states=270)
    for found, order in ((compare_teams(a, b), 1), (compare_teams(b, a), -1)):
        assert {len(changed) for changed in found.changed} == {2}
        assert [one.table for one, _ in found.changed] == [0] * 16 + [1] * 16
        assert {one.state // 16 for one, _ in found.changed} == {alone}
        differing = [(one.action, other.action) for one, other in found.changed if (one.table, one.state) == (1, state)]
        assert differing == [(3, 2)[::order]]


def test_choices_are_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        make_team().choice(table=0, state=0).action = 3
