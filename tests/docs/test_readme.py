"""The README: its policy runs, its targets exist, and its commands print what it says."""

import json
import re
import sys

import pytest
from click.testing import CliRunner

from fireworld.cli.run import command
from tests.docs import transcripts
from tests.docs.pages import README, ROOT, code, fenced


def test_its_policy_runs(tmp_path, monkeypatch):
    example = next(block for block in fenced(README, "python") if "class SpreadOut" in block)
    (tmp_path / "my_policy.py").write_text(example, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)  # puts sys.path back afterwards
    monkeypatch.delitem(sys.modules, "my_policy", raising=False)
    result = CliRunner().invoke(command, ["quick", "--policy", "my_policy:SpreadOut", "--json"], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["policy"] == "my_policy:SpreadOut"


def test_what_it_does_from_python_runs(tmp_path, monkeypatch, capsys):
    example = next(block for block in fenced(README, "python") if "import fireworld as fw" in block)
    monkeypatch.chdir(tmp_path)
    exec(compile(example, str(README), "exec"), {"__name__": "readme"})  # noqa: S102 - what a reader would type
    shown = capsys.readouterr().out
    assert shown.startswith("<Run test-1, readme:<lambda>, seed 3: score ")
    assert "brigade 0 chose easiest, was nearest-to-civilian" in shown
    assert "Outcome(steps=100," in shown
    assert "A: chief, B: best, seeds 1 to 10" in shown


def test_its_make_targets_exist():
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    named = {line.split()[1] for line in code(README) if line.startswith("make ")}
    assert {"demo", "test"} <= named
    assert named <= targets


@pytest.mark.slow
def test_its_transcripts_are_current():
    page = README.read_text(encoding="utf-8")
    assert transcripts.renew(page) == page, "run `make docs`"
