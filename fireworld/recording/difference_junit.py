"""A comparison of two recordings as JUnit XML, which CI servers show: a test case for each topic."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final
from xml.etree.ElementTree import Element, SubElement

from fireworld.junit import clean, report
from fireworld.records import STEP_TOPICS, Snapshot

if TYPE_CHECKING:
    from fireworld_recorder.diff import RunComparison
    from fireworld_recorder.match import Rules

COMMIT: Final = "/commit"
LENGTH: Final = "length"
"""The case of steps that only one run has."""


def difference_junit(difference: RunComparison, rules: Rules, *, names: tuple[str, str]) -> bytes:
    """Write a comparison as a suite with a test case for each topic, in the order in which things happen.

    A topic that differs is a failure whose message, and text, is its first difference; one that is not compared is
    skipped. The class of all cases is made of the first recording's path, so that several goldens stay apart.

    Args:
        difference: what was found.
        rules: by which it was found.
        names: paths of the two recordings, or what was run.
    """
    class_name = ".".join(["fireworld", "diff", *_words(names[0])])
    cases = [_case(name, class_name, difference, rules) for name in _names()]
    properties = {key: f"{b}, was {a}" for key, (a, b) in difference.header.items()}
    return report("fireworld diff", f"{names[0]} and {names[1]}", cases, properties)


def _names() -> Iterator[str]:
    yield from (topic.topic for topic in STEP_TOPICS)
    yield from (Snapshot.topic, COMMIT, LENGTH)


def _case(name: str, class_name: str, difference: RunComparison, rules: Rules) -> Element:
    case = Element("testcase", {"classname": class_name, "name": name.removeprefix("/"), "time": "0"})
    failure = _failure(name, difference)
    if failure is not None:
        sentence, details = failure
        message = {"message": clean(sentence), "type": "difference"}
        SubElement(case, "failure", message).text = clean(f"{sentence}\n{details}")
    elif not _is_compared(name, rules):
        SubElement(case, "skipped", {"message": "left out by --ignore or --tolerance"})
    return case


def _failure(name: str, difference: RunComparison) -> tuple[str, str] | None:
    """Return the first difference of a topic and how often it differs, or None."""
    if name == LENGTH:
        first, (a, b) = difference.first, difference.totals
        if first is not None and first.phase == LENGTH:
            return first.sentence, f"{b.n_steps} steps, was {a.n_steps}"
        return (f"{b.n_steps} steps, was {a.n_steps}", "") if a.n_steps != b.n_steps else None
    if name not in difference.first_by_topic:
        return None
    n = difference.n_steps_differing[name]
    return difference.first_by_topic[name].sentence, f"differs in {n} of {difference.n_steps_compared} steps"


def _is_compared(name: str, rules: Rules) -> bool:
    if name == LENGTH:
        return True
    if name == Snapshot.topic:
        return rules.snapshots
    return bool(rules.endings if name == COMMIT else rules.fields[name])


def _words(path: str) -> list[str]:
    """Return the parts of a path as words of a class name, which dots separate."""
    parts = [re.sub(r"[^\w-]+", "_", part) for part in Path(path).with_suffix("").parts]
    return [part for part in parts if part.strip("_")]
