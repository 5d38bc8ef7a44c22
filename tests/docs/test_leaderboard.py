"""docs/leaderboard.md: its table of suites is up to date, and its board has the policies that come with fireworld."""

from __future__ import annotations

from fireworld.evaluation.suites import suites
from tests.docs.suites_table import PAGE, renew

TEXT = PAGE.read_text(encoding="utf-8")
POLICIES = (
    "chief",
    "each-another",
    "easiest",
    "random",
    "paper-cooperative",
    "ppo.npz",
    "best",
    "sarsa",
    "planner",
    "planner:over=best",
)


def test_its_suites_are_those_that_there_are():
    """`python -m tests.docs.suites_table` renews them."""
    assert renew(TEXT) == TEXT


def test_its_table_has_the_suites_and_the_policies():
    table = TEXT.partition("## The table")[2].partition("## JSON")[0]
    for one in suites():
        assert f" {one.name} ({len(one.scenarios)}) |" in table
    for policy in POLICIES:
        assert f"| `{policy}` |" in table
