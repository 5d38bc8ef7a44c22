"""Annotations: lines on the output by which a CI server marks files, each with what is wrong there."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from fireworld.findings import Finding

FORMS: Final = ("github",)
"""Whose workflow commands can be written."""
_IN_TEXT: Final = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
_IN_PROPERTY: Final = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A", ":": "%3A", ",": "%2C"})


def annotation_lines(findings: Iterable[Finding], *, cannot: str = "error") -> list[str]:
    """Return a workflow command of GitHub's for each finding that is not the same, to be printed line by line.

    Args:
        findings: what was found.
        cannot: level of what is neither the same nor different: error, warning or notice.
    """
    levels = {"different": "error", "cannot": cannot}
    return [_command(one, levels[one.verdict]) for one in findings if one.verdict != "same"]


def _command(finding: Finding, level: str) -> str:
    places = {"file": finding.file, "line": str(finding.line)} if finding.file else {}
    properties = {**places, "title": finding.name}
    listed = ",".join(f"{key}={text.translate(_IN_PROPERTY)}" for key, text in properties.items())
    message = "\n".join([finding.headline, *finding.cause])
    return f"::{level} {listed}::{message.translate(_IN_TEXT)}"
