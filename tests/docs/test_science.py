"""docs/science.md: its tables are those of its figures, and what it says of them in words is what they say."""

from __future__ import annotations

import json

import pytest

from benchmarks.learning import PAGE, RESULTS, page_with, tables
from fireworld.records import ACTIONS

FOUND = json.loads(RESULTS.read_text(encoding="utf-8"))
TEAMS = {team["name"]: team for team in FOUND["teams"]}
DIFFERENCES = {(entry["team"], entry["than"]): entry for entry in FOUND["differences"]}
GROUPS = ("tests", "contested", "larger")


def test_the_tables_are_made_of_the_figures():
    page = PAGE.read_text(encoding="utf-8")
    assert page_with(page, tables(FOUND)) == page


def test_as_much_was_measured_as_it_says():
    assert FOUND["n_fires"] == {"tests": 3, "contested": 80, "larger": 80}
    assert FOUND["n_seeds"] == 20
    assert TEAMS["own-cooperative"]["n_trainings"] == TEAMS["own-alone"]["n_trainings"] == 20


@pytest.mark.parametrize("group", GROUPS)
@pytest.mark.parametrize("other", [*ACTIONS, "each-another", "random", "chief", "best-joint"])
def test_the_best_is_above_every_rule(group, other):
    assert DIFFERENCES["own-cooperative", other][group]["low"] > 0


def test_what_is_said_of_the_others():
    mean = {name: {group: team[group]["mean"] for group in GROUPS} for name, team in TEAMS.items()}
    assert mean["own-cooperative"]["tests"] > 0.99
    assert mean["own-cooperative"]["contested"] > 0.93
    assert mean["planner"]["tests"] > 0.95
    best_rule = max(mean[rule]["contested"] for rule in (*ACTIONS, "each-another", "random", "chief"))
    for failed in ("paper-cooperative", "paper-noncooperative", "sarsa-fires-4320", "distilled-4320"):
        assert mean[failed]["contested"] < best_rule
    for group in GROUPS:
        assert DIFFERENCES["named-cooperative", "best-joint"][group]["low"] > 0


def test_what_is_said_of_cooperation():
    low, mean = (
        {(kind, group): DIFFERENCES[f"{kind}-cooperative", f"{kind}-alone"][group][key] for kind, group in PLACES}
        for key in ("low", "mean")
    )
    assert all(value > 0 for value in mean.values())
    assert {place for place in PLACES if low[place] <= 0} == {("own", "contested")}
    assert max(mean, key=lambda place: mean[place]) == ("named", "tests")
    assert DIFFERENCES["own-cooperative", "own-half-cooperative"]["contested"]["low"] > 0


PLACES = [(kind, group) for kind in ("own", "named") for group in GROUPS]
