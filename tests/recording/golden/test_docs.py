"""docs/ci.md and action.yml: what they show runs as a job would, in a project made of the page."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from tests import command_line
from tests.docs.pages import ROOT, fenced
from tests.recording.golden.conftest import CACHE

pytestmark = pytest.mark.heavy

PAGE = ROOT / "docs" / "ci.md"
POLICY, TESTS = fenced(PAGE, "python")
(SCRIPT,) = fenced(PAGE, "sh")
SAMPLE, ANNOTATION = fenced(PAGE, "text")
WORKFLOW, WITH_ACTION, GITLAB = map(yaml.safe_load, fenced(PAGE, "yaml"))
ACTION = yaml.safe_load((ROOT / "action.yml").read_text())
COMMANDS = re.findall(r"^    fireworld (.*)$", PAGE.read_text(), re.MULTILINE)
STUB = """#!/bin/sh
case " $* " in *" {failing} "*) {then};; esac
for word; do case $1,$word in diff,*.mcap) ;; *,reports/*.xml|*,reports/*.mcap) echo done > "$word";; esac; done
"""
"""A command that writes its reports and does nothing, unless it is the one that fails."""


@pytest.fixture
def documented(project):
    """The project of the page."""
    project.makepyfile(my_policy=POLICY)
    project.makefile(".sh", ci=SCRIPT)
    (project.path / "tests").mkdir()
    (project.path / "tests" / "test_my_policy.py").write_text(TESTS)
    return project


@pytest.fixture
def repository(documented, monkeypatch):
    """The project with its goldens and its baseline, made as the page says."""
    assert len(COMMANDS) == 2
    (documented.path / "recordings").mkdir()
    for line in COMMANDS:
        done = command_line.call(monkeypatch, *shlex.split(line))
        assert done.code == 0, done.err
    documented.runpytest_inprocess("--fireworld-update")
    return documented.path


def break_policy(folder):
    """Let the policy choose otherwise."""
    (folder / "my_policy.py").write_text(POLICY.replace("free[0]", "free[-1]"))
    for compiled in folder.rglob("my_policy*.pyc"):
        compiled.unlink()


def job(folder, script, environment, *, words=("/bin/sh",)):
    """Run a script as a job does: with the commands of the environment that is tested, and nothing of this one."""
    base = {"PATH": f"{Path(sys.executable).parent}:/usr/bin:/bin", "XDG_CACHE_HOME": CACHE, "HOME": str(folder)}
    base |= {key: os.environ[key] for key in ("LD_LIBRARY_PATH", "TMPDIR") if key in os.environ}
    path = folder.parent / "script.sh"
    path.write_text(script)
    done = subprocess.run(
        [*words, path], cwd=folder, env={**base, **environment}, capture_output=True, text=True, check=False
    )
    assert "Traceback" not in done.stderr, done.stderr
    return done


def test_its_tests_store_and_hold_and_fail_as_shown(documented):
    assert documented.runpytest_inprocess("--fireworld-update").ret == 0
    assert len([*documented.path.glob("tests/recordings/*.mcap")]) == 3
    assert documented.runpytest_inprocess().ret == 0
    break_policy(documented.path)
    result = documented.runpytest_inprocess("--fireworld-annotate", "github")
    result.assert_outcomes(failed=3)
    lines = [line.strip("\n").replace("[", "[[]").replace("...", "*") for line in SAMPLE.splitlines()]
    result.stdout.fnmatch_lines(lines)
    result.stdout.fnmatch_lines([ANNOTATION.strip().replace("...", "*")])


def test_its_script_is_green_where_nothing_changed(repository):
    done = job(repository, SCRIPT, {})
    assert done.returncode == 0, done.stdout + done.stderr
    assert "::" not in [line[:2] for line in done.stdout.splitlines()]
    names = {path.name for path in (repository / "reports").iterdir()}
    assert names == {
        "pytest.xml", "pytest.md", "golden.xml", "golden.md", "new-policy.mcap", "diff.xml", "diff.md", "diff-files"
    }  # fmt: skip


def test_its_script_runs_all_parts_and_keeps_what_differs(repository):
    break_policy(repository)
    page = repository / "job.md"
    done = job(repository, SCRIPT, {"GITHUB_ACTIONS": "true", "GITHUB_STEP_SUMMARY": str(page)})
    assert done.returncode == 1
    told = [line for line in done.stdout.splitlines() if line.startswith("::error ")]
    assert len(told) == 4
    check_reports(repository, page)
    assert {path.suffix for path in (repository / "reports" / "new" / "tests").iterdir()} == {".mcap", ".html", ".png"}
    assert "## diff: 1 different" in page.read_text()
    assert job(repository, SCRIPT, {}).returncode == 1, "reports of before are in nobody's way"


def check_reports(folder, page):
    """Check what a job with a broken policy leaves: reports, summaries and what differs, with links that lead there."""
    reports = folder / "reports"
    for name, n in (("pytest.xml", 3), ("golden.xml", 1)):
        failures = list(ElementTree.parse(reports / name).iter("failure"))
        assert len(failures) == n
        assert all(failure.get("message").startswith("policy changed; ") or n == 3 for failure in failures)
    text = page.read_text()
    assert "## recordings of tests: 3 different" in text
    assert "## golden check: 1 different" in text
    assert text.count("**changed: policy: ") >= 4
    for link in re.findall(r"\]\(([^)]*)\)", (reports / "golden.md").read_text() + (reports / "pytest.md").read_text()):
        assert (reports / link).is_file(), link
    assert {"hard.mcap", "hard.html", "hard.png", "hard-difference.html"} < {
        path.name for path in (reports / "new").iterdir()
    }


@pytest.mark.parametrize(
    ("failing", "then", "wanted"),
    [
        ("none", "", 0),
        ("pytest", "exit 1", 1),
        ("golden", "exit 1", 1),
        ("golden", "exit 2", 2),
        ("run", "exit 2", 2),
        ("diff", "echo done > reports/diff.xml; exit 1", 0),
        ("diff", "exit 1", 3),
        ("diff", "exit 2", 2),
        ("pytest", "kill -9 $$", 137),
        ("golden", "exit 0", 3),
        ("pytest", "exit 0", 3),
        ("diff", "exit 0", 3),
    ],
)
@pytest.mark.parametrize("words", [("/bin/sh",), ("/bin/sh", "-e")])
def test_the_worst_part_is_the_exit_code(tmp_path, failing, then, wanted, words):
    """With commands that do nothing but fail; one that ends well without its report did not finish."""
    here = tmp_path / "here"
    here.mkdir()
    for name in ("python", "fireworld"):
        stub = tmp_path / name
        stub.write_text(STUB.format(failing=failing, then=then))
        stub.chmod(0o755)
    done = job(here, SCRIPT, {"PATH": f"{tmp_path}:/usr/bin:/bin"}, words=words)
    assert done.returncode == wanted
    left = {path.name for path in (here / "reports").iterdir()}
    failed = {"pytest": "pytest.xml", "golden": "golden.xml", "run": "new-policy.mcap"}.get(failing)
    assert left == {"pytest.xml", "golden.xml", "new-policy.mcap", "diff.xml"} - (
        {failed} | ({"diff.xml"} if failing == "diff" and wanted else set())
    )


def test_its_workflow_calls_the_script_and_keeps_the_reports():
    steps = WORKFLOW["jobs"]["check"]["steps"]
    assert "sh ci.sh" in [step.get("run") for step in steps]
    (upload,) = [step for step in steps if step.get("uses", "").startswith("actions/upload-artifact@")]
    assert (upload["if"], upload["with"]["path"]) == ("always()", "reports")
    assert "mkdir reports " in SCRIPT


def test_its_gitlab_job_runs_the_script_and_keeps_the_reports(repository, tmp_path):
    policies = GITLAB["policies"]
    assert policies["artifacts"]["when"] == "always"
    assert policies["artifacts"]["paths"] == ["reports"]
    break_policy(repository)
    folder = without_pip(tmp_path)
    (repository / "requirements.txt").write_text("fireworld\n")
    # As its runner does, which stops at the first command that fails.
    done = job(repository, "set -e\n" + "\n".join(policies["script"]), {"PATH": f"{folder}:/usr/bin:/bin"})
    assert done.returncode == 1
    assert (folder / "pip").read_text() == "-m pip install -r requirements.txt\n"
    for name in policies["artifacts"]["reports"]["junit"]:
        assert list(ElementTree.parse(repository / name).iter("failure"))
    assert "::error" not in done.stdout


def without_pip(tmp_path):
    """Make a folder of commands: the installed ones, but what python would install is only written down."""
    folder = tmp_path / "commands"
    folder.mkdir()
    (folder / "fireworld").symlink_to(Path(sys.executable).parent / "fireworld")
    python = folder / "python"
    python.write_text(
        f'#!/bin/sh\ncase "$*" in "-m pip "*) echo "$*" >> {folder}/pip; exit 0;; esac\nexec {sys.executable} "$@"\n'
    )
    python.chmod(0o755)
    return folder


def inputs(**given):
    """The inputs of the action, those of its own if not given."""
    return {name: str(given.pop(name, one["default"])) for name, one in ACTION["inputs"].items()}


def filled(text, values):
    """Fill in what GitHub does."""
    known = {f"inputs.{name}": value for name, value in values.items()} | {"github.action_path": "/somewhere/fireworld"}
    return re.sub(r"\$\{\{ (.*?) \}\}", lambda found: known[found[1]], text)


def run_action(folder, commands, values):
    """Run the steps of the action as GitHub does; after one that fails those only that always run."""
    page, code, outs = folder / "job.md", 0, {}
    for step in ACTION["runs"]["steps"]:
        if "run" not in step or (code and step.get("if") != "always()"):
            continue
        assert step["shell"] == "sh"
        assert "${{" not in step["run"], "what a pull request says must not get into a script"
        env = {name: filled(text, values) for name, text in step["env"].items()}
        env |= {"GITHUB_ACTIONS": "true", "GITHUB_STEP_SUMMARY": str(page), "PATH": f"{commands}:/usr/bin:/bin"}
        done = job(folder, step["run"], env, words=("/bin/sh", "-e"))
        code = code or done.returncode
        outs[step["name"]] = done.stdout
    return code, outs, page


def test_the_action(repository, tmp_path):
    commands = without_pip(tmp_path)
    (repository / "requirements.txt").write_text("numpy\n")
    code, outs, page = run_action(repository, commands, inputs())
    assert code == 0, outs
    assert (commands / "pip").read_text().splitlines() == [
        "-m pip install --quiet /somewhere/fireworld[figures] pytest",
        "-m pip install --quiet -r requirements.txt",
    ]
    assert page.read_text() == "## golden check: 1 the same\n## recordings of tests: 3 the same\n"
    break_policy(repository)
    page.unlink()
    code, outs, page = run_action(repository, commands, inputs(tests="tests -q"))
    assert code == 1
    told = [line for line in outs["Check"].splitlines() if line.startswith("::error ")]
    assert [line.partition(",")[0] for line in told] == [
        *["::error file=tests/test_my_policy.py"] * 3,
        "::error file=recordings/golden/hard.txt",
    ]
    check_reports(repository, page)
    code, outs, _ = run_action(repository, commands, inputs(tests="", goldens="no-such"))
    assert code == 2
    code, outs, _ = run_action(repository, commands, inputs(tests="", goldens=""))
    assert code == 0


def test_the_action_is_used_as_it_is(repository):
    (use,) = [step for step in WITH_ACTION["jobs"]["check"]["steps"] if "/fireworld@" in step["uses"]]
    assert set(use["with"]) <= set(ACTION["inputs"])
    values = inputs(**use["with"])
    steps = ACTION["runs"]["steps"]
    assert [step["uses"].partition("@")[0] for step in steps if "uses" in step] == [
        "actions/setup-python", "actions/cache", "actions/upload-artifact"
    ]  # fmt: skip
    upload = steps[-1]
    assert (upload["if"], filled(upload["with"]["path"], values)) == ("always()", "reports")
    assert steps[-2]["if"] == "always()"
