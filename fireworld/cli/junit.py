"""JUnit's XML, which CI systems show: the results of checking golden recordings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement, indent, tostring

if TYPE_CHECKING:
    from fireworld.cli.goldens import Checked


def junit_xml(results: Sequence[Checked]) -> bytes:
    """Write results as a suite of test cases: a difference is a failure, what cannot be run an error."""
    from fireworld.cli.goldens import changes

    outcomes = [checked.result for checked in results]
    counts = {
        "tests": len(outcomes),
        "failures": outcomes.count("different"),
        "errors": outcomes.count("cannot"),
        "skipped": 0,
    }
    suites = Element("testsuites")
    suite = SubElement(suites, "testsuite", {"name": "fireworld golden"} | {key: str(n) for key, n in counts.items()})
    for checked in results:
        case = SubElement(suite, "testcase", {"classname": "golden", "name": _clean(checked.name)})
        if checked.result != "same":
            kind = "error" if checked.difference is None else "failure"
            fault = SubElement(case, kind, {"message": _clean(checked.sentence), "type": checked.result})
            lines = changes(checked.difference) if checked.difference is not None else ()
            fault.text = "\n".join(map(_clean, (checked.sentence, *lines)))
    indent(suites)
    text: str = tostring(suites, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n'.encode()


def _clean(line: str) -> str:
    """Replace what XML cannot hold; the name of a file may have anything in it."""
    return "".join(character if character.isprintable() else "?" for character in line)
