"""The files that a public project has: they are well-formed, and what they name is there."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import fireworld
from fireworld.reproduction import paper
from tests.docs.pages import ROOT, code

GITHUB = ROOT / ".github"
CONTRIBUTING = ROOT / "CONTRIBUTING.md"
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
TARGETS = set(re.findall(r"^([a-z-]+):", MAKEFILE, re.MULTILINE))
CHANGES = 10
"""Changes of which CONTRIBUTING names the one place."""


def read(path):
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def test_the_citation_is_of_this_version_and_of_the_paper():
    citation = read(ROOT / "CITATION.cff")
    assert {"cff-version", "message", "title", "authors"} <= set(citation)
    assert citation["version"] == fireworld.__version__
    (reference,) = citation["references"]
    said = " ".join(paper.__doc__.split())
    assert f": {reference['title']}. {reference['collection-title']}," in said
    authors = ", ".join(f"{author['given-names']} {author['family-names']}" for author in reference["authors"])
    assert f" {authors}: " in said
    assert f"LNCS {reference['volume']}, {reference['publisher']['name']} {reference['year']}." in said


def test_the_workflow_calls_the_script_and_keeps_its_reports():
    steps = read(GITHUB / "workflows" / "ci.yml")["jobs"]["test"]["steps"]
    (script,) = [step["run"] for step in steps if "run" in step]
    assert os.access(ROOT / script, os.X_OK)
    (kept,) = [step["with"]["path"] for step in steps if "upload" in step.get("uses", "")]
    assert f"make --no-print-directory --keep-going test PYTEST=--junitxml={kept}/" in (ROOT / script).read_text()


@pytest.mark.parametrize("name", ["bug", "feature"])
def test_issue_templates_are_forms(name):
    form = read(GITHUB / "ISSUE_TEMPLATE" / f"{name}.yml")
    assert {"name", "description", "body"} <= set(form)
    names = [part["id"] for part in form["body"]]
    assert len(names) == len(set(names))
    assert {part["type"] for part in form["body"]} <= {"textarea", "input", "checkboxes", "dropdown"}
    assert all(part["attributes"]["label"] for part in form["body"])


def test_hooks_are_the_projects_own_ruff():
    (repository,) = read(ROOT / ".pre-commit-config.yaml")["repos"]
    assert repository["repo"] == "local"
    for hook in repository["hooks"]:
        program, *words = hook["entry"].split()
        assert program == ".venv/bin/ruff"
        assert f"$(BIN)/ruff {words[0]} " in MAKEFILE
    assert {"format", "check"} == {hook["entry"].split()[1] for hook in repository["hooks"]}


def test_contributing_names_files_and_targets_that_exist():
    text = CONTRIBUTING.read_text(encoding="utf-8")
    named = {path for path in re.findall(r"`(\.?\w[\w-]*(?:/[\w.-]+)+)`", text) if "NAME" not in path}
    assert len(named) > 20
    missing = {path for path in named if not (ROOT / path).exists()}
    assert not missing
    called = {line.split()[1] for line in code(CONTRIBUTING) if line.startswith("make ")}
    assert {"check", "test"} <= called <= TARGETS


def test_every_change_has_one_place():
    section = CONTRIBUTING.read_text(encoding="utf-8").partition("\n## What do I change?\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (.+) \| `([^`]+)` \|$", section, re.MULTILINE)
    assert len(rows) == CHANGES
    assert all((ROOT / place).exists() for _, place in rows if "NAME" not in place)


def test_make_help_lists_every_target():
    done = subprocess.run(["make", "help"], capture_output=True, text=True, check=True, cwd=ROOT)  # noqa: S607 - ours
    assert set(re.findall(r"^  make ([a-z-]+)", done.stdout, re.MULTILINE)) == TARGETS


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_shell_learns_to_complete(shell):
    source = f"_FIREWORLD_COMPLETE={shell}_source fireworld"
    assert any(source in line for line in code(ROOT / "docs" / "cli.md"))
    assert "_fireworld_completion" in completion(f"{shell}_source")


def test_commands_are_completed():
    assert "plain,recover" in completion("bash_complete", COMP_WORDS="fireworld rec", COMP_CWORD="1").split()


def completion(instruction, **variables):
    program = Path(sys.executable).with_name("fireworld")
    found = os.environ | variables | {"_FIREWORLD_COMPLETE": instruction}
    return subprocess.run([program], capture_output=True, text=True, check=True, env=found).stdout


def test_a_demonstration_installs_what_it_shows_and_ends_with_files_to_look_at():
    rules = dict(re.findall(r"^([\w./-]+:[^\n]*)\n((?:\t[^\n]*\n)+)", MAKEFILE, re.MULTILINE))
    demo = next(recipe for head, recipe in rules.items() if head.startswith("demo: .venv/.demo "))
    installs = next(recipe for head, recipe in rules.items() if head.startswith(".venv/.demo: "))
    assert re.findall(r"--editable (\S+)", installs) == ["'.[view]'"]
    assert " MB are downloaded" in installs
    shown = demo.partition("Next:")
    assert all(f"$(DEMO).{ending} " in shown[0].rpartition("--force")[2] for ending in ("mcap", "html", "rrd"))
    assert shown[2].count("@echo") == 3
    assert any(head.startswith(".venv/.installed: .venv/.demo") for head in rules)
