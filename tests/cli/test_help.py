"""Help is quick: no command's --help imports the simulator's or the viewer's libraries."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from fireworld.cli import COMMANDS

HEAVY = ("numba", "numpy", "scipy", "shapely", "rerun", "mcap", "matplotlib", "pyarrow", "yaml", "msgspec", "rich")
ASK = """
import contextlib, io, json, sys
from fireworld.cli import main
sys.argv = ["fireworld", *json.loads(sys.argv[1])]
with contextlib.redirect_stdout(io.StringIO()) as out:
    try:
        main()
    except SystemExit as stop:
        code = stop.code or 0
print(json.dumps([code, out.getvalue(), sorted(sys.modules)]))
"""


def ask(*words):
    """Call the command line in a process of its own; return exit code, output and the modules imported."""
    done = subprocess.run([sys.executable, "-c", ASK, json.dumps(words)], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def heavy(modules):
    return [name for name in HEAVY if name in modules]


def test_the_list_of_commands():
    code, out, modules = ask("--help")
    assert code == 0
    for name, summary in COMMANDS.items():
        assert f"  {name} " in out
        assert summary in out
    assert heavy(modules) == []
    assert not any(name.startswith("fireworld.cli.") for name in modules), "it imports no command"


@pytest.mark.parametrize("name", [*COMMANDS, "scenarios show", "scenarios check", "scenarios new"])
def test_the_help_of_a_command(name):
    code, out, modules = ask(*name.split(), "--help")
    assert code == 0
    assert out.startswith(f"Usage: fireworld {name} ")
    assert "-h, --help" in out
    assert heavy(modules) == []


def test_an_unknown_command():
    done = subprocess.run(
        [sys.executable, "-c", "from fireworld.cli import main; main()", "rum"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert "No such command 'rum'" in done.stderr


def test_recordings_are_read_without_the_simulator(tmp_path):
    """`info` and `diff` need no numba; the simulator is for those who run or replay."""
    _, _, modules = ask("info", str(tmp_path / "absent.mcap"))
    assert "mcap" in modules
    assert "numba" not in modules
