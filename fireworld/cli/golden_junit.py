"""The results of checking golden recordings as JUnit XML, which CI systems show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

from fireworld.junit import clean, report

if TYPE_CHECKING:
    from fireworld.recording.golden.check import Checked


def junit_xml(results: Sequence[Checked]) -> bytes:
    """Write results as a suite of test cases: a difference is a failure, what cannot be run an error."""
    return report("fireworld golden", "fireworld golden", [_case(checked) for checked in results])


def _case(checked: Checked) -> Element:
    from fireworld.recording.golden.check import changes

    case = Element("testcase", {"classname": "golden", "name": clean(checked.name), "time": "0"})
    if checked.result != "same":
        kind = "error" if checked.difference is None else "failure"
        fault = SubElement(case, kind, {"message": clean(checked.sentence), "type": checked.result})
        lines = changes(checked.difference) if checked.difference is not None else ()
        fault.text = clean("\n".join((checked.sentence, *lines)))
    return case
