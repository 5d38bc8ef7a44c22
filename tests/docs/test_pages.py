"""Every page: links lead somewhere, commands are real, citations are met."""

import re
import tomllib

import click
import pytest

from fireworld.cli import root
from fireworld.policy.names import BUILT_IN, PLANNERS
from fireworld.policy.teams import team_names
from fireworld.scenario import scenario_names
from tests.docs.pages import FENCED, PAGES, README, ROOT, anchors, commands, links, page_name

COMMANDS = [words for page in PAGES for words in commands(page)]
CITATION = re.compile(r"MODEL (?:section )?(\d+(?:\.\d)?(?:(?:-| and |, )\d+(?:\.\d)?)*)")
NUMBER = re.compile(r"\d+(?:\.\d)?")


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_relative_links_lead_somewhere(page):
    for link in links(page):
        if link.startswith("https://"):
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        assert target.exists(), link
        if anchor:
            assert anchor in anchors(target), link


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_no_heading_comes_twice(page):
    text = FENCED.sub("", page.read_text(encoding="utf-8"))
    headings = [] if page.name == "CHANGELOG.md" else re.findall(r"^#+ .*$", text, re.MULTILINE)
    assert sorted(headings) == sorted(set(headings))


@pytest.mark.parametrize("page", [page for page in PAGES if page.parent.name == "docs"], ids=page_name)
def test_the_readme_leads_to_every_page(page):
    assert page_name(page) in links(README)


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_commands_are_real(words):
    command, rest = root, list(words)
    while isinstance(command, click.Group) and rest and not rest[0].startswith("-"):
        name = rest.pop(0)
        command = command.get_command(click.Context(command), name)
        assert command is not None, name
    if not rest or {"--help", "--version"} & set(rest):
        return  # a command is only named, or its help
    try:
        given = command.make_context(words[0], rest, parent=click.Context(root, **root.context_settings)).params
    except (click.BadOptionUsage, click.MissingParameter):  # named with an option or two, nothing to be called
        known = {name for option in command.params for name in option.opts}
        assert {word for word in rest if word.startswith("-")} <= known
        return
    scenario, policy = given.get("scenario"), given.get("policy")
    assert scenario in {None, "NAME", *scenario_names()} or scenario.endswith(".yaml")
    assert policy in {None, *BUILT_IN, *PLANNERS, *team_names()} or ":" in policy or policy.endswith((".npz", ".py"))


def test_the_model_has_every_section_that_code_cites():
    page = (ROOT / "docs" / "model.md").read_text(encoding="utf-8")
    sections = set(re.findall(r"^#+ (\d+(?:\.\d)?)", page, re.MULTILINE))
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "fireworld").rglob("*.py")]
    cited = {number for text in sources for group in CITATION.findall(text) for number in NUMBER.findall(group)}
    assert cited
    assert cited <= sections, cited - sections


def test_the_architecture_names_folders_that_exist():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ((?:`[^`]+`(?:, )?)+) \|", page, re.MULTILINE)
    named = [path for row in rows for path in re.findall(r"`([^`]+)`", row)]
    assert len(named) > 10
    for path in named:
        assert (ROOT / path).exists(), path


def test_the_architecture_shows_the_layers_that_are_enforced():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    block = page.partition("Imports go down only, and never between neighbours of one line:\n\n```text\n")[2].partition(
        "```"
    )[0]
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (layers,) = (
        found["layers"] for found in settings["tool"]["importlinter"]["contracts"] if found["type"] == "layers"
    )
    assert [set(line.split()) for line in block.splitlines()] == [set(layer.split(" | ")) for layer in layers]
