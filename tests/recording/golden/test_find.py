"""Goldens by name and by expression; many at a time."""

from __future__ import annotations

import json

import pytest

from fireworld.errors import OutputError
from fireworld.recording.golden.find import matcher

NAMES = ("quick", "quick-planner", "test-1-hard", "TEST-2")


@pytest.mark.parametrize(
    ("expression", "wanted"),
    [
        ("quick", [0, 1]),
        ("not quick", [2, 3]),
        ("test", [2, 3]),
        ("quick and not planner", [0]),
        ("planner or hard", [1, 2]),
        ("not (planner or hard)", [0, 3]),
        ("NOT quick AND hard", [2]),
        ("hard or quick and planner", [1, 2]),
    ],
)
def test_expressions(expression, wanted):
    matches = matcher(expression)
    assert [number for number, name in enumerate(NAMES) if matches(name)] == wanted


@pytest.mark.parametrize("expression", ["", " ", "and", "a b", "a and", "(a", "a)", "not", "()", "or a"])
def test_what_is_no_expression(expression):
    with pytest.raises(OutputError, match="-k: expected parts of names joined by and, or, not"):
        matcher(expression)


@pytest.fixture
def three(here, golden):
    """Three goldens."""
    for name in ("one", "two", "three"):
        end = ("--digest-only",) if name == "three" else ()
        assert golden("add", "quick", "--policy", "mine:Policy", "--steps", 2, "--name", name, *end).code == 0
    return here


def checked(done):
    """Names of the goldens that were checked."""
    return [one["name"] for one in json.loads(done.out)]


def test_by_name(three, golden):
    assert checked(golden("check", "two", "one", "--json")) == ["one", "two"]
    assert checked(golden("check", "-k", "t and not w", "--json")) == ["three"]
    assert checked(golden("check", "--dir", "recordings/golden", "one", "--json")) == ["one"]
    assert checked(golden("check", "recordings/golden", "one", "--json")) == ["one"]
    assert checked(golden("check", "recordings/golden", "-k", "two", "--json")) == ["two"]
    (three / "one").mkdir()
    assert checked(golden("check", "one", "--json")) == ["one"], "a golden before a folder of that name"
    done = golden("check", "ones")
    assert done.code == 2
    assert "expected the name of a golden, got 'ones'; try one" in done.err
    done = golden("check", "-k", "four")
    assert done.code == 2
    assert "-k: expected the name of a golden to match, got 'four'" in done.err


@pytest.mark.slow
def test_many_at_a_time(three, golden, change_policy):
    golden("add", "quick", "--train", "--set", "n_episodes_max=1", "--name", "training")
    golden("add", "quick", "--policy", "easiest", "--steps", 2, "--name", "other")
    change_policy("EASIEST")
    alone, many = golden("check", "--keep", "new"), golden("check", "--keep", "new", "--force", "--jobs", 2)
    assert (alone.code, alone.out) == (many.code, many.out)
    assert alone.out.count("policy changed; ") == 3


def test_the_table_breaks_no_word_at_80_columns(three, golden, change_policy, monkeypatch):
    change_policy("EASIEST")
    monkeypatch.setenv("COLUMNS", "80")
    out = golden("check").out
    assert max(map(len, out.splitlines())) <= 80
    assert out.count(" different") == 3
    assert "scenario, seed and simulator are the same" in " ".join(out.split())
