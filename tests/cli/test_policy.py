"""`fireworld policy` of rankings and of teams by their names; `tests/training/test_cli.py` has those of tables."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fireworld.policy.teams import team_path
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.ranking_words import WEIGHTS

pytestmark = pytest.mark.usefixtures("policies_file")

NAMES = [weight.name for weight in WEIGHTS]
ORIGIN = {
    "method": {"name": "search", "n_fires": 5},
    "seed": 3,
    "generations_done": 14,
    "curriculum": {"name": "contested", "digest": "abc"},
}


@pytest.fixture
def here(here):
    """Also some rankings."""
    weights = np.zeros((2, len(NAMES)))
    weights[0, :3] = 0.5, -2.0, 0.25
    weights[1, NAMES.index("others_here")] = -1.0
    weights[0, NAMES.index("easiest")] = 7.0
    RankingTeam(weights[:1], True, ORIGIN).save(here / "own.npz")
    RankingTeam(weights, False).save(here / "named.npz")
    other = weights.copy()
    other[0, 1] = -2.5
    other[1, 0] = 0.125
    RankingTeam(other, False).save(here / "other.npz")
    return here


def lines(done):
    assert (done.code, done.err) == (0, "")
    return done.out.splitlines()


def test_a_ranking_of_own_targets(here, fireworld):
    shown = lines(fireworld("policy", "show", "own.npz"))
    assert shown[:3] == [
        "own.npz: a ranking of all burning buildings of the fire site, one row of weights for all brigades",
        "trained in contested, 14 generations, seed 3",
        "method n_fires 5, name search",
    ]
    assert shown[3].startswith("digest ")
    table = [line.split() for line in shown if line.split()[:1] and line.split()[0] in NAMES]
    assert len(table) == 13, "weights of actions do not count"
    assert [(row[0], row[-1]) for row in table[:4]] == [
        ("volume", "-2.000"),
        ("temperature", "+0.500"),
        ("fuel_left", "+0.250"),
        ("civilian_distance", "0"),
    ]
    assert "its size: root of the volume in 1000 m3" in "\n".join(shown)
    assert shown[-3:] == [
        "above all: prefers smaller buildings",
        "also: prefers hotter buildings",
        "a little: prefers what has much fuel left",
    ]


def test_a_ranking_of_the_four_targets_with_a_row_for_each(here, fireworld):
    shown = lines(fireworld("policy", "show", "named.npz"))
    assert shown[0] == (
        "named.npz: a ranking of the targets of the paper's four actions, 2 rows of weights, "
        "one for each brigade in turn"
    )
    table = [line.split() for line in shown if line.split()[:1] and line.split()[0] in NAMES]
    assert [(row[0], *row[-2:]) for row in table[:3]] == [
        ("easiest", "+7.000", "0"),
        ("volume", "-2.000", "0"),
        ("others_here", "0", "-1.000"),
    ]
    assert shown[shown.index("brigade 1") + 1] == "above all: avoids what others go for"


def test_a_ranking_as_json(here, fireworld):
    told = json.loads(fireworld("policy", "show", "own.npz", "--json").out)
    assert (told["own_targets"], told["n_rows"], told["provenance"]) == (True, 1, ORIGIN)
    assert [weight["name"] for weight in told["weights"]][:2] == ["volume", "temperature"]
    assert {weight["name"] for weight in told["weights"]} == set(NAMES)
    assert told["weights"][0]["values"] == [-2.0]
    assert [weight["name"] for weight in told["weights"] if not weight["counts"]] == NAMES[13:]
    assert told["preferences"][0][0] == {
        "weight": "volume",
        "strength": "above all",
        "words": "prefers smaller buildings",
    }


def test_rankings_compared(here, fireworld):
    same = fireworld("policy", "diff", "named.npz", "named.npz")
    assert (same.code, same.out) == (0, "the same: 2 rows of weights\n")
    done = fireworld("policy", "diff", "named.npz", "other.npz")
    assert (done.code, done.err) == (1, "")
    assert done.out.startswith("2 weights differ\n")
    rows = [line.split() for line in done.out.splitlines() if "brigade" in line]
    assert rows == [
        ["volume", "brigade", "0", "-2", "-2.5", "-0.5"],
        ["temperature", "brigade", "1", "+0", "+0.125", "+0.125"],
    ]
    assert "... and 1 more; --limit" in fireworld("policy", "diff", "named.npz", "other.npz", "--limit", 1).out
    done = fireworld("policy", "diff", "named.npz", "other.npz", "--json")
    told = json.loads(done.out)
    assert (done.code, told["same"], told["n_changed"], len(told["digests"])) == (1, False, 2, 2)
    assert told["changed"][0] == {"row": 0, "weight": "volume", "a": -2.0, "b": -2.5}


def test_what_is_ranked_is_told(here, fireworld):
    weights = np.zeros((1, len(NAMES)))
    for name, own_targets in (("a.npz", True), ("b.npz", False)):
        RankingTeam(weights, own_targets).save(here / name)
    done = fireworld("policy", "diff", "a.npz", "b.npz")
    assert done.code == 1
    assert done.out == (
        "A ranks all burning buildings of the fire site, B the targets of the paper's four actions\n0 weights differ\n"
    )


def test_teams_that_come_with_fireworld(here, fireworld):
    shown = lines(fireworld("policy", "show", "paper-cooperative", "1193"))
    assert shown[0] == "paper-cooperative: 4 tables of 4320 states, with what the others do"
    assert any(line.startswith("state 1193: ") for line in shown)
    told = json.loads(fireworld("policy", "show", "paper-noncooperative", "--json").out)
    assert told["n_states"] == 270
    same = fireworld("policy", "diff", "paper-cooperative", team_path("paper-cooperative"))
    assert (same.code, same.out) == (0, "the same: 4320 states\n")


TEAM = "fireworld: TEAM: expected a team file (.npz) or one of "


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("show", "own.npz", "1193"),
            "fireworld: STATE: expected none: a ranking of targets has no states, got '1193'",
        ),
        (("show", "own.npz", "volume=high", "--json"), "fireworld: STATE: expected none: "),
        (("show", "paper-coperative"), TEAM),
        (("show", "paper-coperative"), "got 'paper-coperative'; try paper-cooperative"),
        (("show", "chief"), TEAM),
        (("show", "absent.npz"), "fireworld: absent.npz: expected a team file, got No such file or directory"),
        (("show", "policies.py"), "fireworld: policies.py: expected a team file (.npz), got BadZipFile"),
        (("diff", "own.npz", "absent.npz"), "fireworld: absent.npz: expected a team file, got No such file"),
        (("diff", "own.npz", "named.npz"), "fireworld: B: weights: expected as many rows as in A, 1, got 2 of them"),
        (
            ("diff", "own.npz", "paper-cooperative"),
            "fireworld: paper-cooperative: expected a ranking of targets, as in own.npz, got tables of actions",
        ),
        (
            ("diff", "paper-cooperative", "own.npz"),
            "fireworld: own.npz: expected tables of actions, as in paper-cooperative, got a ranking of targets",
        ),
        (
            ("diff", "own.npz", "own.npz", "--actions-only"),
            "fireworld: --actions-only: expected two teams with tables of actions, got two rankings",
        ),
    ],
)
def test_what_cannot_be_done(here, fireworld, words, message):
    done = fireworld("policy", *words)
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert message in done.err


def test_the_list(fireworld):
    shown = lines(fireworld("policy", "list"))
    assert shown[2].split() == ["easiest", "rule", "goes", "for", "the", "burning", "building", "that", "is", "coolest"]
    known = json.loads(fireworld("policy", "list", "--json").out)
    assert [one["name"] for one in known] == [line.split()[0] for line in shown[2:]]
    assert {one["kind"] for one in known} == {"rule", "team", "planner"}
    assert all(one["doc"] for one in known)
