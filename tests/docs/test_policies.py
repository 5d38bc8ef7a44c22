"""The page on policies: its network is the one in the file, its test passes, its names are found."""

from __future__ import annotations

import sys

import pytest

from fireworld.policy.names import find_policy
from tests import command_line
from tests.docs.pages import ROOT, fenced

PAGE = ROOT / "docs" / "policies.md"


@pytest.fixture
def here(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(fenced(PAGE, "python")[0], encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    yield tmp_path
    sys.modules.pop("mine", None)


def test_of_several_classes_one_must_be_named(here, monkeypatch):
    done = command_line.call(monkeypatch, "run", "quick", "--policy", "mine.py")
    assert (done.code, done.out) == (2, "")
    assert "got SpreadOut, Steady" in done.err


@pytest.mark.slow
def test_its_python_runs(here):
    _, python, network, _, test = fenced(PAGE, "python")
    names = {"__name__": "__main__"}
    exec(python, names)  # noqa: S102 - our own page
    exec(network, names)  # noqa: S102 - the same
    assert find_policy("network.npz").digest == names["team"].policy().digest
    names = {}
    exec(test, names)  # noqa: S102 - our own page
    conformance = names["TestSteady"]()
    for name in dir(conformance):
        if name.startswith("test_"):
            getattr(conformance, name)()


def test_its_names_are_found(here):
    for name in ("mine.py:hottest", "mine.py:SpreadOut", "mine:Steady", "mine.py:Steady:period=5"):
        assert find_policy(name).name == name
