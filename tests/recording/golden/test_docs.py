"""docs/ci.md: its policy, its tests, its script and its workflow do what it says, in a project made of them."""

from __future__ import annotations

import re
import shlex
import subprocess

import pytest
import yaml

from tests import command_line
from tests.docs.pages import ROOT, fenced

pytestmark = pytest.mark.slow

PAGE = ROOT / "docs" / "ci.md"
POLICY, TESTS = fenced(PAGE, "python")
(SCRIPT,) = fenced(PAGE, "sh")
(SAMPLE,) = fenced(PAGE, "text")
(WORKFLOW,) = fenced(PAGE, "yaml")


@pytest.fixture
def documented(project):
    """The project of the page."""
    project.makepyfile(my_policy=POLICY)
    project.makefile(".sh", ci=SCRIPT)
    (project.path / "tests").mkdir()
    (project.path / "tests" / "test_my_policy.py").write_text(TESTS)
    return project


def test_its_tests_store_and_hold_and_fail_as_shown(documented):
    assert documented.runpytest_inprocess("--fireworld-update").ret == 0
    assert len([*documented.path.glob("tests/recordings/*.mcap")]) == 3
    assert documented.runpytest_inprocess().ret == 0
    documented.makepyfile(my_policy=POLICY.replace("free[0]", "free[-1]"))
    result = documented.runpytest_inprocess()
    result.assert_outcomes(failed=3)
    lines = [line.strip("\n").replace("[", "[[]").replace("...", "*") for line in SAMPLE.splitlines()]
    result.stdout.fnmatch_lines(lines)


def test_its_script_runs(documented, monkeypatch):
    """Command by command, in this process; the goldens and the baseline are made as the page says."""
    fireworld = [shlex.split(line) for line in re.findall(r"^    fireworld (.*)$", PAGE.read_text(), re.MULTILINE)]
    (documented.path / "recordings").mkdir()
    assert len(fireworld) == 2
    for words in fireworld:
        done = command_line.call(monkeypatch, *words)
        assert done.code == 0, done.err
    documented.runpytest_inprocess("--fireworld-update")
    (documented.path / "reports").mkdir()
    codes = {}
    for line in SCRIPT.splitlines():
        words = shlex.split(line, comments=True)
        if words[:3] == ["python", "-m", "pytest"]:
            codes["pytest"] = documented.runpytest_inprocess(*words[3:]).ret
        elif words[:1] == ["fireworld"]:
            codes[words[1]] = command_line.call(monkeypatch, *words[1:]).code
    assert codes == {"pytest": 0, "golden": 0, "run": 0, "diff": 1}
    assert {path.name for path in (documented.path / "reports").iterdir()} == {
        "pytest.xml",
        "golden.xml",
        "new-policy.mcap",
    }


@pytest.mark.parametrize(
    ("failing", "code", "wanted"),
    [
        ("none", 0, 0),
        ("pytest", 1, 1),
        ("golden", 1, 1),
        ("golden", 2, 2),
        ("run", 2, 2),
        ("diff", 1, 0),
        ("diff", 2, 1),
    ],
)
def test_its_script_stops_where_it_says(tmp_path, failing, code, wanted):
    """With commands that do nothing but fail: a difference is let pass, a fault is not."""
    for name in ("python", "fireworld"):
        stub = tmp_path / name
        stub.write_text(f'#!/bin/sh\ncase " $* " in *" {failing} "*) exit {code};; esac\n')
        stub.chmod(0o755)
    (tmp_path / "ci.sh").write_text(SCRIPT)
    environment = {"PATH": f"{tmp_path}:/usr/bin:/bin"}
    assert subprocess.run(["/bin/sh", "ci.sh"], cwd=tmp_path, env=environment, check=False).returncode == wanted


def test_its_workflow_calls_the_script_and_keeps_the_reports():
    steps = yaml.safe_load(WORKFLOW)["jobs"]["check"]["steps"]
    assert "sh ci.sh" in [step.get("run") for step in steps]
    (upload,) = [step for step in steps if step.get("uses", "").startswith("actions/upload-artifact@")]
    assert (upload["if"], upload["with"]["path"]) == ("always()", "reports")
    assert "mkdir -p reports\n" in SCRIPT
