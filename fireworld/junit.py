"""JUnit XML, which CI servers show: the frame around the test cases of `diff`, `golden` and `compare`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

_FORBIDDEN: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML cannot hold; a file's name can."""
_COUNTED: Final = {"failures": "failure", "errors": "error", "skipped": "skipped"}


def report(command: str, name: str, cases: Sequence[Element], properties: Mapping[str, str] | None = None) -> bytes:
    """Return a report of one suite.

    Args:
        command: what made it.
        name: of the suite.
        cases: `testcase` elements; what they hold is counted.
        properties: of the suite, by name.
    """
    counts = {"tests": str(len(cases))}
    counts |= {plural: str(sum(case.find(kind) is not None for case in cases)) for plural, kind in _COUNTED.items()}
    root = Element("testsuites", {"name": command, **counts})
    suite = SubElement(root, "testsuite", {"name": clean(name), **counts})
    if properties:
        listed = SubElement(suite, "properties")
        for key, value in properties.items():
            SubElement(listed, "property", {"name": key, "value": clean(value)})
    suite.extend(cases)
    indent(root)
    text: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def clean(text: str) -> str:
    """Replace what XML cannot hold."""
    return _FORBIDDEN.sub("?", text)
