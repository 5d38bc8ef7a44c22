"""What identifies a policy made in a notebook, in a script or as an object: what it does, no less, and nothing else."""

from __future__ import annotations

import importlib
import linecache
import subprocess
import sys
from itertools import count

import numpy as np
import pytest

from fireworld.errors import PolicyError
from fireworld.policy.identity import covering, digest_of, digest_of_module, modules_brought_in
from fireworld.policy.names import find_policy


class Notebook:
    """Runs cells as a notebook does: their text can be looked up, and what they make is in __main__."""

    numbers = count(1)

    def __init__(self):
        self.names = {"__name__": "__main__", "np": np}

    def run(self, text):
        file = f"<cell-{next(self.numbers)}>"
        linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
        exec(compile(text, file, "exec"), self.names)  # noqa: S102 - what a notebook does

    def digest(self, text, then=""):
        """Run a cell; return the digest of what an expression then is, by default of `A`."""
        self.run(f"{text}\nfound = {then or 'A'}\n")
        return digest_of(self.names["found"])


@pytest.fixture
def notebook():
    return Notebook()


CLASS = "class A:\n    k = 3\n    def decide(self, observation):\n        return self.k\n"


def test_a_class_is_its_text(notebook):
    found = notebook.digest(CLASS)
    assert len(found) == 64
    assert notebook.digest(CLASS) == Notebook().digest("\n\n" + CLASS) == found
    changes = ("k = 4", "k = 3\n    l = 1", "k = 3\n    @property\n    def l(self):\n        return 1")
    others = [notebook.digest(CLASS.replace("k = 3", change)) for change in changes]
    others.append(notebook.digest(CLASS.replace("return self.k", "return 1 + self.k")))
    assert len({found, *others, ""}) == len(others) + 2


def test_what_a_class_inherits_counts(notebook):
    heir = "class B(A):\n    pass\n"
    assert notebook.digest(CLASS + heir, "B") != notebook.digest(CLASS.replace("3", "4") + heir, "B")


def test_what_a_function_names_counts(notebook):
    text = "K = 3\ndef helper():\n    return [K for _ in range(3)]\ndef f(observation):\n    return helper()\n"
    found = notebook.digest(text, "f")
    assert notebook.digest(text, "f") == found
    for change in (("K = 3", "K = 4"), ("return [K", "return 1 + [K"), ("range(3)", "range(4)")):
        assert notebook.digest(text.replace(*change), "f") not in {found, ""}
    assert notebook.digest(text + "world = object()\n", "f") == found, "what it does not name does not count"
    assert notebook.digest("def f(o):\n    return g(o)\ndef g(o):\n    return f(o)\n", "f")


def test_attributes_of_what_it_sees_are_no_names(notebook):
    text = "world = object()\ndef f(observation):\n    return observation.world and np.argmax([1])\n"
    assert notebook.digest(text, "f")


def test_a_lambda_is_its_own_part_of_a_line(notebook):
    """Two in one line differ, and what else stands in the line does not count."""
    notebook.run("two = [lambda o: 'easiest', lambda o: 'nearest-to-me']")
    first, second = notebook.digest("", "two[0]"), notebook.digest("", "two[1]")
    assert len({first, second, ""}) == 3
    assert notebook.digest("", "dict(policy=lambda o: 'easiest', seed=3)['policy']") == first
    assert notebook.digest("", "lambda o, p=1: 'easiest'") != first
    assert notebook.digest("", "lambda o: ('é' and\n  o.step) % 4") not in {
        notebook.digest("", "lambda o: o.step % 4"),
        "",
    }


ONE_VALUE = "class A:\n    def __init__(self, k):\n        self.NAME = k\n    def decide(self, o):\n        return 1"
DATA = "from dataclasses import dataclass\n@dataclass\nclass A:\n    k: int = 1"


@pytest.mark.parametrize(
    ("text", "one", "other"),
    [
        ("def make(k):\n    def inner(o):\n        return k\n    return inner", "make(1)", "make(2)"),
        ("def f(o, k=1):\n    return k", "f", "type(f)(f.__code__, globals(), 'f', (2,))"),
        ("def f(o, *, k=1):\n    return k", "f", "[setattr(f, '__kwdefaults__', {'k': 2}), f][1]"),
        ("from functools import partial\ndef f(o, k):\n    return k", "partial(f, k=1)", "partial(f, k=2)"),
        (ONE_VALUE.replace("NAME", "k"), "A(1)", "A(2)"),
        (ONE_VALUE.replace("NAME", "_k"), "A(1)", "A(2)"),
        (ONE_VALUE, "A(1)", "A(True)"),
        (ONE_VALUE, "A({1: [2.0, (None, {'x'})]})", "A({1: [2.0, (None, {'y'})]})"),
        (ONE_VALUE, "A(np.zeros(2))", "A(np.ones(2))"),
        (ONE_VALUE, "A(np.zeros(2))", "A(np.zeros(2, int))"),
        (ONE_VALUE, "A(1).decide", "A(2).decide"),
        (ONE_VALUE, "A(A(1).decide)", "A(A(2).decide)"),
        (DATA, "A()", "A(2)"),
        (DATA, "A", "A()"),
        (DATA.replace("@dataclass", "@dataclass(slots=True)"), "A()", "A(2)"),
        (DATA + "\nclass B(A): ...\nb = B()", "[setattr(b, 'k', A(1)), b][1]", "[setattr(b, 'k', A(2)), b][1]"),
    ],
)
def test_values_count(notebook, text, one, other):
    first = notebook.digest(text, one)
    assert len({first, notebook.digest(text, other), ""}) == 3
    assert notebook.digest(text, one) == first


@pytest.mark.parametrize(
    "text",
    [
        "A = __import__('random').Random()",
        "rng = np.random.default_rng()\ndef A(o):\n    return int(rng.integers(4))",
        "class A:\n    rng = np.random.default_rng()\n    def decide(self, o):\n        return 1",
        "class B:\n    def decide(self, o):\n        return 1\nA = B()\nA.model = object()",
        "class B:\n    def decide(self, o):\n        return 1\nA = B()\nA.models = np.array([object()])",
        "values = []\nvalues.append(values)\ndef A(o):\n    return values",
        "exec('def A(o):\\n    return 1')",
        "A = eval('lambda o: 1')",
        "class B(dict):\n    def decide(self, o):\n        return 1\nA = B({1: object()})",
        "A = len",
        "A = np.add",
    ],
)
def test_what_cannot_be_told(notebook, text):
    assert notebook.digest(text) == ""


def test_what_cannot_be_told_has_no_identity(notebook):
    notebook.run("class B:\n    def decide(self, o):\n        return 1\nA = B()\nA.model = object()")
    named = find_policy(notebook.names["A"])
    assert (named.name, named.digest, named.identity) == ("__main__:B", "", "")
    with pytest.raises(PolicyError, match=r"^--results: expected a policy whose source .*digest., got '__main__:B'$"):
        named.require_identity("--results")
    notebook.run("A.digest = 'model 7'")
    named = find_policy(notebook.names["A"])
    assert (named.digest, named.identity, named.require_identity("--results")) == ("model 7",) * 3
    assert not named.can_be_found_again


class InAFile:
    def __init__(self, k=1):
        self.k = k

    def decide(self, observation):
        return self.k


def test_objects_of_a_class_in_a_file():
    digests = [find_policy(given).digest for given in (InAFile, InAFile(), InAFile(2))]
    assert len({*digests, ""}) == 4
    assert find_policy(InAFile(2)).digest == digests[2]
    assert len({find_policy(given).identity for given in (InAFile, InAFile(), InAFile(2))}) == 3


SCRIPT = """
from fireworld.policy.names import find_policy

class A:
    def decide(self, observation):
        return 1

print(*(find_policy(given).digest for given in (A, A(), lambda seen: "easiest")), sep=",")
assert find_policy(find_policy(A).name).digest == find_policy(A).digest, "its recordings can be forked here"
"""


@pytest.mark.slow
def test_scripts(tmp_path):
    """A script that is run, in whatever folder; what comes from standard input has no source."""
    digests = []
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "script.py"
        path.write_text(SCRIPT + f"# in {folder}\n")
        done = subprocess.run([sys.executable, str(path)], capture_output=True, text=True, check=True)
        digests.append(done.stdout.strip().split(","))
    assert digests[0] == digests[1]
    assert [len(digest) for digest in digests[0]] == [64] * 3
    done = subprocess.run([sys.executable, "-"], input=SCRIPT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ",,"


def test_a_digest_covers_values():
    assert covering("abc", {}) == covering("abc", []) == "abc"
    assert covering("", {"k": 1}) == ""
    assert covering("abc", {"k": 1, "l": 2}) == covering("abc", {"l": 2, "k": 1}) != covering("abc", {"k": 1})


def test_what_others_import_of_a_package_is_not_brought_in(tmp_path, monkeypatch):
    """Whoever imports a module of a package makes it an attribute of the package, which its other modules belong to."""
    package = tmp_path / "brought_in_by"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "mine.py").write_text("def decide(observation):\n    return 1\n")
    (package / "other.py").write_text("")
    (package / "named.py").write_text("import brought_in_by.other\n\n\ndef decide(observation):\n    return 1\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    mine = importlib.import_module("brought_in_by.mine")
    before = digest_of_module(mine)
    other = importlib.import_module("brought_in_by.other")
    assert digest_of_module(mine) == before
    assert other in modules_brought_in(importlib.import_module("brought_in_by.named"))
