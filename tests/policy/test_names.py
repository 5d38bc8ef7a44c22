"""Policies by name: the built-in ones, one's own from the current folder, and every mistake in one line."""

from __future__ import annotations

import pytest

from fireworld.errors import PolicyError
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import BUILT_IN, load_policy
from fireworld.records import ACTIONS


def test_the_built_in_policies():
    assert list(BUILT_IN) == [*ACTIONS, "each-another", "random", "chief"]
    loaded = {name: load_policy(name) for name in BUILT_IN}
    assert all(named.name == name and isinstance(named.policy, KernelPolicy) for name, named in loaded.items())
    assert len({named.digest for named in loaded.values()}) == len(BUILT_IN), "each does something else"
    assert load_policy("chief").digest == loaded["chief"].digest


def test_a_policy_of_ones_own(here):
    (here / "mine.py").write_text(
        "from fireworld.policy.protocol import Decision\n"
        "class Mine:\n"
        "    def decide(self, observation):\n"
        "        return Decision(2)\n"
        "def made():\n"
        "    return Mine()\n"
        "ready = Mine()\n"
    )
    loaded = [load_policy(f"mine:{name}") for name in ("Mine", "made", "ready")]
    assert [type(named.policy).__name__ for named in loaded] == ["Mine"] * 3
    assert [named.name for named in loaded] == ["mine:Mine", "mine:made", "mine:ready"]
    assert loaded[0].policy.decide(None).action == 2


def test_the_digest_is_that_of_the_source(here):
    source = "class A:\n    def decide(self, observation):\n        return None\n"
    for name, text in (("one", source), ("same", source), ("other", source + "\n")):
        (here / f"{name}.py").write_text(text)
    digests = [load_policy(f"{name}:A").digest for name in ("one", "same", "other")]
    assert digests[0] == digests[1] != digests[2]


def test_a_policy_in_a_package(here):
    (here / "team").mkdir()
    (here / "team" / "__init__.py").write_text("")
    (here / "team" / "north.py").write_text("class P:\n    def decide(self, observation):\n        return None\n")
    assert type(load_policy("team.north:P").policy).__name__ == "P"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("chef", "--policy: expected one of easiest, .*, got 'chef'; try chief$"),
        ("Random", "got 'Random'; try random$"),
        ("nearest", "try nearest-to-civilian or nearest-to-center or nearest-to-me$"),
        ("zzz", "MODULE:CLASS names one of your own"),
        ("", "--policy: expected one of"),
    ],
)
def test_an_unknown_name(name, message):
    with pytest.raises(PolicyError, match=message):
        load_policy(name)


@pytest.mark.parametrize(
    ("source", "name", "message"),
    [
        (None, "absent:A", "--policy: absent: cannot be imported: ModuleNotFoundError: No module named 'absent'"),
        ("def", "broken:A", "--policy: broken: cannot be imported: SyntaxError: .*broken.py, line 1"),
        ("\n1 / 0", "broken:A", r"ZeroDivisionError: division by zero \(broken.py, line 2\)"),
        ("import sys\nsys.exit(3)", "broken:A", r"cannot be imported: SystemExit: 3 \(broken.py, line 2\)"),
        ("raise ValueError('two\\nlines')", "broken:A", "ValueError: two lines"),
        ("", "empty:A", "--policy: empty: expected a class of that name, got 'A'"),
        ("", "empty:", "--policy: empty: expected a class of that name, got ''"),
        ("", ":A", "--policy: : cannot be imported: ValueError: Empty module name"),
        ("class A:\n    pass", "wrong:A", r"--policy: wrong:A: expected a policy with a method decide\(.*, got 'A'"),
        ("A = 3", "wrong:A", "expected a policy .*, got 'int'"),
        (
            "class A:\n    def __init__(self, table):\n        pass\n    def decide(self, observation):\n        pass",
            "needy:A",
            "--policy: needy:A: cannot be made: TypeError: .*missing 1 required positional argument: 'table'",
        ),
        (
            "class A:\n    def __init__(self):\n        raise OSError('no table')",
            "needy:A",
            r"OSError: no table \(needy",
        ),
    ],
)
def test_what_is_wrong_with_ones_own(here, source, name, message):
    if source is not None:
        (here / f"{name.partition(':')[0]}.py").write_text(source)
    with pytest.raises(PolicyError, match=message) as caught:
        load_policy(name)
    assert "\n" not in str(caught.value)
