"""--debug: the traceback of what is one line without it; a fault of fireworld itself has no verdict's exit code."""

from __future__ import annotations

import sys

import click
import pytest

from fireworld import cli
from fireworld.cli import COMMANDS, root

pytestmark = pytest.mark.slow

BROKEN = "class A:\n    def decide(self, observation):\n        return {}['key']\n"


@pytest.fixture
def broken(here):
    (here / "broken.py").write_text(BROKEN)
    yield here
    sys.modules.pop("broken", None)


@pytest.mark.parametrize(
    "words",
    [
        ("--debug", "run", "quick", "--policy", "broken.py"),
        ("run", "quick", "--policy", "broken.py", "--debug"),
    ],
)
def test_the_traceback_of_an_error(broken, fireworld_process, words):
    done = fireworld_process(*words)
    assert (done.code, done.out) == (2, "")
    assert "return {}['key']" in done.err
    line = "fireworld: policy broken:A: step 1, brigade 0: KeyError: 'key' (broken.py, line 3)"
    assert done.err.splitlines()[-1] == line
    done = fireworld_process(*(word for word in words if word != "--debug"))
    assert (done.code, done.err.splitlines()[-1]) == (2, line)
    assert "Traceback" not in done.err


def test_by_the_environment(here, fireworld_process, monkeypatch):
    words = ("scenarios", "show", "quik")
    for value, shown in (("1", True), ("0", False), ("", False)):
        monkeypatch.setenv("FIREWORLD_DEBUG", value)
        done = fireworld_process(*words)
        assert done.code == 2
        assert ("Traceback" in done.err) is shown


def commands(command, words=()):
    yield words, command
    if isinstance(command, click.Group):
        for name in command.list_commands(None):
            yield from commands(command.get_command(None, name), (*words, name))


def test_every_command_takes_it():
    found = dict(commands(root))
    assert {words[0] for words in found if words} == set(COMMANDS)
    assert ("policy", "list") in found
    for command in found.values():
        assert [parameter.name for parameter in command.params].count("debug") == 1


@pytest.mark.parametrize("words", [(), ("--debug",)])
@pytest.mark.parametrize("fault", [ZeroDivisionError("two\nlines"), OSError(5, "disk"), RecursionError()])
def test_a_fault_of_our_own(here, capsys, monkeypatch, words, fault):
    """Not exit code 1, which says that recordings differ."""

    def fail(*_, **__):
        raise fault

    monkeypatch.setattr(root, "main", fail)
    monkeypatch.setattr(sys, "argv", ["fireworld", *words, "diff", "a.mcap", "b.mcap"])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    err = capsys.readouterr().err
    assert stop.value.code == 2
    assert err.splitlines()[-1].startswith(f"fireworld: internal error: {type(fault).__name__}")
    assert err.endswith("; run it again with --debug\n")
    assert ("Traceback" in err) == bool(words)
    assert bool(words) or err.count("\n") == 1
