"""One word for one thing: the glossary has each of them once; words that are out stay out of pages and sources."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fireworld.records import ACTIVITIES, PHASES
from tests.docs.pages import PAGES, ROOT, page_name

GLOSSARY = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| ([^|]+) \| (.+) \|$", GLOSSARY, re.MULTILINE)
MEANINGS = {word: meaning for words, meaning in ROWS for word in words.split(", ")}

WORDS = (
    *("scenario", "city", "world", "state", "step", "phase", "brigade", "building", "civilian", "refuge", "hydrant"),
    *("fire site", "policy", "team", "table team", "ranking team", "decision", "action", "target", "own target"),
    *("observation", "reward", "score", "return", "outcome", "run", "session", "seed", "random draw"),
    *("common random numbers", "episode", "curriculum", "stage", "method", "hyperparameter", "checkpoint", "team file"),
    *("log", "recording", "record", "topic", "field", "commit", "snapshot", "digest", "hash chain"),
    *("golden recording", "fork", "replay", "verify", "recover", "explanation", "span", "difference", "tolerance"),
    *("metric", "delta", "margin", "gate", "verdict", "override", "resume", "results file", "reproduction"),
    *("repetition", "executor", "kernel", "observer", "plan", "preset", "parameter", "trace", "conformance"),
)
"""What the product is spoken of with."""

OUT = {
    "luck": r"\bluck\b",  # random draws; the same random draws (common random numbers)
    "B less A": r"(?-i:\bless [AB]\b)",  # B - A
    "told": r"\btold\b",  # say what happens: is printed, is written, knows
    "tells": r"\btells\b",  # the same; "cannot tell" is a verdict
    "go on": r"\b(?:go|goes|going|gone) on\b",  # continue, resume
    "meets the same": r"\bmeets? the same\b",  # sees
    "held against": r"\bh(?:eld|olds?) (?:\w+ )?against\b",  # compared with
    "figures of a method": r"\bfigures? of (?:the|a) method\b|\bour figures\b",  # hyperparameters, values
    "of no account": r"\bof no account\b",  # ignored
    "mend": r"\bmend(?:s|ed|ing)?\b",  # fix
}
"""Words that are out, and how to find them; docs/cli.md is the help of every command."""
TO_REWORD = Path(__file__).with_name("to_reword.txt")
"""Where they still are: a line `PAGE: WORD` for each; empty when all pages are reworded."""


def test_every_word_is_defined_once():
    words = [word for words, _ in ROWS for word in words.split(", ") if words != "word"]
    assert len(words) == len(set(words))
    missing = set(WORDS) - set(words)
    assert not missing
    assert all(len(meaning) > 10 for word, meaning in MEANINGS.items() if word != "word")


def test_every_part_is_in_order():
    parts = GLOSSARY.split("\n## ")[1:]
    assert len(parts) > 3
    for part in parts:
        words = re.findall(r"^\| ([^|]+) \|", part, re.MULTILINE)[1:]
        assert words[0] != "---"
        assert words == sorted(words, key=lambda word: word.replace("-", " ").lower())


def test_what_is_listed_is_what_is_recorded():
    assert MEANINGS["activity"].endswith(": " + ", ".join(ACTIVITIES))
    phases = [phase.strip() for phase in MEANINGS["phase"].partition(": ")[2].split(",")]
    assert phases == [phase for phase in dict.fromkeys(PHASES.values()) if phase in phases]


def words_out(text: str) -> set[str]:
    """Name the words that are out and yet in a text."""
    return {name for name, pattern in OUT.items() if re.search(pattern, text, re.IGNORECASE)}


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_words_that_are_out_are_on_no_page(page):
    allowed = {line.partition(": ")[2] for line in to_reword() if line.partition(": ")[0] == page_name(page)}
    assert words_out(page.read_text(encoding="utf-8")) <= allowed


def test_words_that_are_out_are_in_no_source():
    sources = [path for folder in ("fireworld", "recorder", "viewer") for path in (ROOT / folder).rglob("*.py")]
    found = {page_name(path): words_out(path.read_text(encoding="utf-8")) for path in sources}
    assert len(found) > 200
    assert {name: words for name, words in found.items() if words} == {}


def test_what_is_to_be_reworded_is_named_rightly():
    named = [line.partition(": ") for line in to_reword()]
    assert {page for page, _, _ in named} <= {page_name(page) for page in PAGES}
    assert {word for _, _, word in named} <= set(OUT)
    assert to_reword() == sorted(set(to_reword()))


def to_reword() -> list[str]:
    """Return the lines of the list."""
    return TO_REWORD.read_text(encoding="utf-8").splitlines()


def test_the_test_would_notice():
    said = "Both meet the same luck; figures of the method go on. B less A is told."
    assert words_out(said) == {"luck", "B less A", "told", "go on", "meets the same", "figures of a method"}
