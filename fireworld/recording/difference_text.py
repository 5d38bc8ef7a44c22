"""A comparison of two recordings in words and cells, for the terminal and pages, and as JUnit XML for CI servers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from xml.etree.ElementTree import Element, SubElement

from fireworld.cause import DIGEST_SHOWN
from fireworld.junit import clean, report
from fireworld.outcome import NOT_RECORDED, QUANTITIES
from fireworld.records import STEP_TOPICS, Snapshot

if TYPE_CHECKING:
    from fireworld_recorder.diff import RunComparison
    from fireworld_recorder.match import Rules
    from fireworld_recorder.spread import SpreadRow, ValuePair
    from fireworld_recorder.totals import Totals

    from fireworld.cause import Cause

COMMIT: Final = "/commit"
LENGTH: Final = "length"
"""The case of steps that only one run has."""
SPREAD_HEADS: Final = ("step", "buildings", "fieryness", "brigades", "civilians", "score", "burning", "burnt out")
SPREAD_NOTE: Final = "how many differ; fieryness: buildings in another state; score, burning, burnt out: B - A"


def head_lines(difference: RunComparison, cause: Cause) -> list[str]:
    """List what changed, and where the runs first differ; of runs that are the same, that first."""
    first = difference.first
    if first is None:
        return [verdict(difference), *(cause.lines if cause.changes else ())]
    return [*cause.lines, first.sentence]


def shortened(key: str, value: str | int) -> str:
    """Return a value of a header; of a digest as much as identifies it."""
    return str(value)[:DIGEST_SHOWN] if key.endswith("digest") else str(value)


def totals_rows(*totals: Totals) -> Iterator[tuple[str, ...]]:
    """Yield how runs came out, line by line: what is counted, then its value in each run."""
    yield "steps", *(str(one.n_steps) for one in totals)
    for quantity in QUANTITIES:
        unit = f", {quantity.unit}" if quantity.unit and quantity.unit not in quantity.label else ""
        yield quantity.label + unit, *(_number(getattr(one.outcome, quantity.name, None)) for one in totals)
    yield "score, at most", *(_number(getattr(one.outcome, "score_max", None)) for one in totals)


def change_lines(difference: RunComparison) -> list[str]:
    """List what is different in how the runs came out."""
    return [f"{label}: {b}, was {a}" for label, a, b in totals_rows(*difference.totals) if a != b]


def topic_rows(difference: RunComparison) -> Iterator[tuple[str, str, str]]:
    """Yield topic, the step at which it came to differ, and the number of steps in which it differs."""
    for topic, n in difference.n_steps_differing.items():
        yield topic, str(difference.first_by_topic[topic].step), str(n)


def spread_cells(row: SpreadRow) -> tuple[str, ...]:
    """Write one row of the table of how a difference spread."""
    counts = (row.step, row.n_buildings, row.n_states, row.n_brigades, row.n_civilians)
    return (*map(_number, counts), *map(_change, (row.score, row.n_burning, row.n_burnt_out)))


def spread_sentences(difference: RunComparison) -> Iterator[str]:
    """Yield how many entities of each kind a difference reached, and which was the first."""
    spread = difference.spread
    for kind, total in spread.n_entities.items():
        found, n_reached = spread.first_by_entity[kind], spread.n_reached[kind]
        if found is not None:
            yield f"{kind}s: {n_reached} of {total} differed at some step, the first at {found.sentence}"
        elif total:
            yield f"{kind}s: none of {total} differed"


def verdict(difference: RunComparison) -> str:
    """Return the first difference in words, or how many steps are the same."""
    first = difference.first
    return f"the same: {difference.n_steps_compared} steps" if first is None else first.sentence


def difference_junit(
    difference: RunComparison, rules: Rules, cause: Cause, *, names: tuple[str, str], file: str = ""
) -> bytes:
    """Write a comparison as a suite with a test case for each topic, in the order in which things happen.

    A topic that differs is a failure whose message, and text, is its first difference; one that is not compared is
    skipped. The class of all cases is made of the first recording's path, so that several goldens stay apart.

    Args:
        difference: what was found.
        rules: by which it was found.
        cause: what changed.
        names: paths of the two recordings, or what was run.
        file: the first recording's, "" if it has none.
    """
    parts = [re.sub(r"[^\w-]+", "_", part) for part in Path(names[0]).with_suffix("").parts]
    class_name = ".".join(["fireworld", "diff", *(part for part in parts if part.strip("_"))])
    topics = (*(topic.topic for topic in STEP_TOPICS), Snapshot.topic, COMMIT, LENGTH)
    cases = [_case(name, class_name, file, difference, rules) for name in topics]
    properties = {what: "; ".join(lines) for what, lines in cause.changes.items()}
    return report("fireworld diff", f"{names[0]} and {names[1]}", cases, properties)


def _case(name: str, class_name: str, file: str, difference: RunComparison, rules: Rules) -> Element:
    place = {"file": clean(file), "line": "1"} if file else {}
    case = Element("testcase", {"classname": class_name, "name": name.removeprefix("/"), **place, "time": "0"})
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


def _change(pair: ValuePair) -> str:
    if pair.a is None or pair.b is None:
        return "-"
    difference = pair.b - pair.a
    return f"{difference:+.4g}" if difference else "0"


def _number(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, float) and math.isnan(value):
        return NOT_RECORDED
    return f"{value:.6g}" if isinstance(value, float) else str(value)
