"""Policies by name: the built-in ones, one's own from the current folder, and every mistake in one line."""

from __future__ import annotations

import hashlib
import json
import pickle
import sys

import pytest

from fireworld.errors import PolicyError
from fireworld.policy.asking import ask, name_of
from fireworld.policy.identity import digest_of_module
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import BUILT_IN, RULES, TEAM_ATTACHMENT, NamedPolicy, find_policy, policies
from fireworld.policy.protocol import Decision
from fireworld.policy.teams import team_names
from fireworld.policy.teams.team import load_team, parse_team
from fireworld.records import ACTIONS


def test_the_built_in_policies():
    assert list(BUILT_IN) == [*ACTIONS, "each-another", "random", "chief", "allocate"]
    loaded = {name: find_policy(name) for name in BUILT_IN}
    assert all(named.name == name and isinstance(named.policy, KernelPolicy) for name, named in loaded.items())
    assert len({named.digest for named in loaded.values()}) == len(BUILT_IN), "each does something else"
    assert find_policy("chief").digest == loaded["chief"].digest


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
    loaded = [find_policy(f"mine:{name}") for name in ("Mine", "made", "ready")]
    assert [name_of(named.policy) for named in loaded] == ["mine:Mine"] * 3
    assert [named.name for named in loaded] == ["mine:Mine", "mine:made", "mine:ready"]
    assert loaded[0].policy.decide(None).action == 2


def test_the_digest_is_that_of_the_source(here):
    source = "class A:\n    def decide(self, observation):\n        return None\n"
    for name, text in (("one", source), ("same", source), ("other", source + "\n")):
        (here / f"{name}.py").write_text(text)
    digests = [find_policy(f"{name}:A").digest for name in ("one", "same", "other")]
    assert digests[0] == digests[1] != digests[2]


def test_a_policy_in_a_package(here):
    (here / "team").mkdir()
    (here / "team" / "__init__.py").write_text("")
    (here / "team" / "north.py").write_text("class P:\n    def decide(self, observation):\n        return None\n")
    assert name_of(find_policy("team.north:P").policy) == "team.north:P"
    assert name_of(find_policy("team.north").policy) == "team.north:P"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("chef", "--policy: expected one of easiest, .*, got 'chef'; try chief$"),
        ("Random", "got 'Random'; try random$"),
        ("nearest", "try nearest-to-civilian or nearest-to-center or nearest-to-me$"),
        ("zzz", "FILE.py:CLASS or MODULE:CLASS names one of your own"),
        ("", "--policy: expected one of"),
    ],
)
def test_an_unknown_name(name, message):
    with pytest.raises(PolicyError, match=message):
        find_policy(name)


@pytest.mark.parametrize(
    ("source", "name", "message"),
    [
        (None, "absent:A", "--policy: absent: cannot be imported: ModuleNotFoundError: No module named 'absent'"),
        ("def", "broken:A", "--policy: broken: cannot be imported: SyntaxError: .*broken.py, line 1"),
        ("\n1 / 0", "broken:A", r"ZeroDivisionError: division by zero \(broken.py, line 2\)"),
        ("import sys\nsys.exit(3)", "broken:A", r"cannot be imported: SystemExit: 3 \(broken.py, line 2\)"),
        ("raise ValueError('two\\nlines')", "broken:A", "ValueError: two lines"),
        ("", "empty:A", "--policy: empty: expected a class of that name, got 'A'"),
        ("", "empty:", "--policy: empty: expected one policy class .a class with a method decide., got 'none'"),
        ("", ":A", "--policy: : cannot be imported: ValueError: Empty module name"),
        ("class A:\n    pass", "wrong:A", r"--policy: wrong:A: expected a policy with a method decide\(.*, got 'A'"),
        ("A = 3", "wrong:A", "expected a policy .*, got 'int'"),
        (
            "class A:\n    def __init__(self, table):\n        pass\n    def decide(self, observation):\n        pass",
            "needy:A",
            "--policy: needy:A: expected a value for table, as in table=VALUE, got 'none'",
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
        find_policy(name)
    assert "\n" not in str(caught.value)


NEAR = """
from fireworld.policy.protocol import Action, Decision

class Near:
    def __init__(self, k=1, near=True):
        self.k, self.near = k, near

    def decide(self, observation):
        return Action.NEAREST_TO_ME
"""
MORE = """
def made(k=1):
    return Near(k)

def nearest(observation, k=1):
    return k % 4

def always(observation):
    return "easiest"

ready = Near(7)
"""


def test_a_file(here):
    """Found by its path from the current folder, with the files beside it; it has the name that it was asked by."""
    (here / "inner").mkdir()
    (here / "inner" / "mine.py").write_text("from beside import K\n" + NEAR + "class Other(Near):\n    k = K\n")
    (here / "inner" / "beside.py").write_text("K = 5\n")
    named = find_policy("inner/mine.py:Near")
    assert (named.name, name_of(named.policy)) == ("inner/mine.py:Near", "mine:Near")
    content = (here / "inner" / "mine.py").read_bytes()
    assert named.digest == hashlib.sha256(content).hexdigest() == find_policy("mine:Near").digest
    assert find_policy(here / "inner" / "mine.py:Near").digest == named.digest
    assert sys.modules["mine"].Other.k == 5
    assert find_policy("inner/mine.py:Other").identity != named.identity


def test_files_of_one_name_are_two(here):
    for folder, k in (("old", 1), ("new", 2)):
        (here / folder).mkdir()
        (here / folder / "mine.py").write_text(NEAR.replace("k=1", f"k={k}"))
    old, new = find_policy("old/mine.py:Near"), find_policy("new/mine.py:Near")
    assert (old.policy.given.k, new.policy.given.k, find_policy("old/mine.py").policy.given.k) == (1, 2, 1)
    assert old.digest != new.digest


def test_a_file_of_a_librarys_name_replaces_nothing(here):
    (here / "json.py").write_text(NEAR)
    assert find_policy("json.py").policy.given.k == 1
    assert sys.modules["json"] is json


def test_a_file_that_changed_is_imported_again(here):
    (here / "mine.py").write_text(NEAR)
    before = find_policy("mine.py")
    assert type(find_policy("mine.py").policy.given) is type(before.policy.given), "it did not change"
    (here / "mine.py").write_text(NEAR.replace("k=1", "k=2"))
    after = find_policy("mine.py")
    assert (before.policy.given.k, after.policy.given.k) == (1, 2)
    assert before.digest != after.digest


def test_the_only_class_needs_no_name(here):
    (here / "mine.py").write_text(NEAR + "class _Hidden(Near): ...\nAlias = Near\nfrom collections import Counter\n")
    for name in ("mine", "mine.py", "mine.py:", "mine:", "./mine.py", "mine:k=1", "mine.py:k=1"):
        named = find_policy(name)
        assert (named.name, name_of(named.policy)) == (name, "mine:Near")
    assert find_policy("mine.py").identity == find_policy("mine:Near").identity
    (here / "two.py").write_text(NEAR + "class Far(Near): ...\n")
    wanted = r"^--policy: two.py: expected one policy class .*, got Near, Far; name one of them, as in :Near$"
    with pytest.raises(PolicyError, match=wanted):
        find_policy("two.py")
    with pytest.raises(PolicyError, match=wanted):
        find_policy("two")
    with pytest.raises(PolicyError, match=r"one of easiest.*, got 'three'; FILE.py:CLASS or MODULE:CLASS names "):
        find_policy("three")


def test_parameters(here):
    (here / "mine.py").write_text(NEAR + MORE)
    plain, other = find_policy("mine.py:Near"), find_policy("mine.py:Near:k=3,near=false")
    assert (other.name, other.policy.given.k, other.policy.given.near) == ("mine.py:Near:k=3,near=false", 3, False)
    names = ("mine:Near:near=false,k=3", "mine:Near:near=false", "mine:Near")
    given = ({}, {"k": 3}, {"k": 3, "near": False})
    for name, more in zip(names, given, strict=True):
        same = find_policy(name, parameters=more)
        assert same.digest == other.digest != plain.digest
        assert find_policy(same.name).digest == other.digest, "its name says it all"
    assert find_policy(names[1], parameters=given[1]).name == "mine:Near:near=false,k=3"
    assert len({find_policy(f"mine:Near{end}").identity for end in ("", ":k=1", ":k=2", ":k=2.0", ":k='2'")}) == 5


def test_parameters_and_a_digest_of_its_own(here):
    """What a policy says of itself does not hide what it was made with."""
    (here / "mine.py").write_text(NEAR + '    digest = "of a model"\n')
    named = [find_policy(f"mine:Near{end}") for end in ("", ":k=1", ":k=2")]
    assert named[0].identity == "of a model"
    assert len({one.identity for one in named}) == len({one.digest for one in named}) == 3


def test_functions_and_objects_in_a_module(here):
    (here / "mine.py").write_text(NEAR + MORE)
    assert find_policy("mine.py:made:k=5").policy.given.k == 5
    assert ask(find_policy("mine.py:always").policy, None) == Decision(0)
    assert ask(find_policy("mine.py:nearest:k=2").policy, None) == Decision(2)
    assert name_of(find_policy("mine.py:nearest:k=2").policy) == "mine:nearest"
    assert find_policy("mine.py:ready").policy.given.k == 7
    names = ("Near", "made", "nearest", "always", "ready")
    assert len({find_policy(f"mine.py:{name}").identity for name in names}) == 5


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("mine.py:Near:kk=3", "--policy: mine.py:Near: expected parameters k, near, got 'kk'; try k$"),
        ("mine.py:Neer", "--policy: mine.py: expected a class of that name, got 'Neer'; try Near$"),
        ("mine.py:Near:k", "--policy: mine.py:Near: expected parameters as in k=3,near=true, got 'k'$"),
        ("mine.py:Near:k=1,k=2", "--policy: mine.py:Near: expected every parameter once, got k twice$"),
        ("mine.py:made:kk=3", "--policy: mine.py:made: expected parameters k, got 'kk'; try k$"),
        ("mine.py:nearest:kk=3", "--policy: mine.py:nearest: expected parameters observation, k, got 'kk'; try k$"),
        ("mine.py:ready:k=3", "--policy: mine.py:ready: expected no parameters, got 'k'$"),
        ("chief:k=3", "--policy: chief: expected no parameters, got 'k'$"),
        ("easiest:action=3", "--policy: easiest: expected no parameters, got 'action'$"),
        ("best:k=3", "--policy: best: expected no parameters, got 'k'$"),
        ("team.npz:k=3", "--policy: team.npz: expected no parameters, got 'k'$"),
        ("absent.py", "--policy: absent.py: expected a file of Python code, got No such file or directory$"),
        ("absent.py:A", "--policy: absent.py: expected a file of Python code, got No such file or directory$"),
        ("a\0b.py", r"--policy: a\\x00b.py: expected a file of Python code, got embedded null byte$"),
        ("broken.py", r"--policy: broken.py: cannot be imported: ZeroDivisionError: .* \(broken.py, line 1\)$"),
        ("my.module", "--policy: my.module: cannot be imported: ModuleNotFoundError"),
        ("leaves.py", r"--policy: leaves.py: cannot be imported: GeneratorExit \(leaves.py, line 1\)$"),
        ("leaves:A", r"--policy: leaves: cannot be imported: GeneratorExit \(leaves.py, line 1\)$"),
    ],
)
def test_what_is_wrong_with_names(here, name, message):
    (here / "mine.py").write_text(NEAR + MORE)
    (here / "broken.py").write_text("1 / 0\n")
    (here / "leaves.py").write_text("raise GeneratorExit\n")
    for _ in range(2):
        with pytest.raises(PolicyError, match=f"^{message}") as caught:
            find_policy(name)
        assert "\n" not in str(caught.value)
    assert "broken" not in sys.modules


def test_no_code_is_evaluated(here):
    (here / "mine.py").write_text(NEAR)
    named = find_policy("mine.py:k=open('made').write()")
    assert named.policy.given.k == "open('made').write()"
    assert not (here / "made").exists()


class Own:
    def __init__(self, k=1):
        self.k = k

    def decide(self, observation):
        return self.k


def nearest(observation):
    return "nearest-to-me"


def test_what_is_given_in_python():
    file = digest_of_module(sys.modules[__name__])
    by_class, function = find_policy(Own), find_policy(nearest)
    assert (by_class.name, by_class.digest) == ("tests.policy.test_names:Own", file)
    assert (function.name, function.digest) == ("tests.policy.test_names:nearest", file)
    assert ask(function.policy, None) == Decision(3)
    three = find_policy(Own, parameters={"k": 3})
    assert (three.name, three.policy.given.k) == ("tests.policy.test_names:Own:k=3", 3)
    assert len({one.identity for one in (by_class, function, three)}) == 3
    assert find_policy("tests.policy.test_names:Own:k=3").identity == three.identity
    assert find_policy(by_class) is by_class


def test_what_is_given_in_python_with_parameters():
    with pytest.raises(
        PolicyError, match=r"^policy: tests.policy.test_names:Own: expected parameters k, got 'kk'; try k$"
    ):
        find_policy(Own, parameters={"kk": 3})
    with pytest.raises(PolicyError, match=r"^policy: expected no parameters, got 'k'$"):
        find_policy(Own(), parameters={"k": 3})
    with pytest.raises(PolicyError, match=r"^policy: chief: expected no parameters, got 'k'$"):
        find_policy(find_policy("chief"), parameters={"k": 3})
    with pytest.raises(PolicyError, match=r"^--policy: planner: expected every parameter once, got horizon twice$"):
        find_policy("planner:horizon=3", parameters={"horizon": 3})


def test_a_function_is_of_the_observation_or_makes_a_policy():
    def makes(*, k=1):
        return Own(k)

    def either(observation="none"):
        return 2

    assert find_policy(makes, parameters={"k": 2}).policy.given.k == 2
    assert ask(find_policy(either).policy, None) == Decision(2)


def test_policies_are_found_again_by_other_processes():
    given = ["chief", "best", "planner:horizon=5", "tests.policy.test_names:Own:k=3", Own, Own(4), nearest]
    for one in map(find_policy, given):
        assert one.can_be_found_again
        one.require_found_again("--jobs")
        again = pickle.loads(pickle.dumps(one))  # noqa: S301 - our own
        assert (again.name, again.digest, again.identity) == (one.name, one.digest, one.identity)
    again = pickle.loads(pickle.dumps(NamedPolicy("a", "b", find_policy("chief").policy)))  # noqa: S301 - our own
    assert (again.name, again.digest, again.can_be_found_again) == ("a", "b", True)

    def inner(observation): ...

    class Inner(Own): ...

    for given in (inner, Inner, Inner(), lambda observation: 0, Own().decide):  # noqa: ARG005 - a policy
        named = find_policy(given)
        assert not named.can_be_found_again
        with pytest.raises(
            PolicyError, match=r"^--jobs: expected a policy that other processes can import or unpickle, got '.*"
        ):
            named.require_found_again("--jobs")


def test_a_team_takes_its_file_along(tmp_path):
    team = load_team("paper-cooperative")
    named = find_policy(team)
    assert (named.name, named.digest) == ("team", find_policy("paper-cooperative").digest)
    assert parse_team(named.attachments[TEAM_ATTACHMENT], source="x").digest == team.digest
    assert named.trained_choices == "in-turn"
    assert pickle.loads(pickle.dumps(named)).digest == named.digest  # noqa: S301 - our own
    with pytest.raises(PolicyError, match=r"^policy: team: expected no parameters, got 'k'$"):
        find_policy(team, parameters={"k": 3})


def test_a_named_policy_shows_itself_shortly():
    assert repr(find_policy("best")).startswith("NamedPolicy(name='best', digest='")
    assert len(repr(find_policy("best"))) < 120


def test_the_list_of_policies():
    known = policies()
    assert [one.name for one in known if one.kind == "rule"] == list(BUILT_IN) == list(RULES)
    assert [one.name for one in known if one.kind == "team"] == team_names()
    assert [one.name for one in known if one.kind == "planner"] == ["planner"]
    assert {one.name: one.doc for one in known}["best-2026"] == "learned by search on the curriculum contested"
    assert all(find_policy(one.name).name == one.name for one in known)
