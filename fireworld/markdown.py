"""Findings as Markdown, for the page of a job or a comment on a change: the cause first, then what is different."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final
from urllib.parse import quote

from fireworld.findings import VERDICTS, Finding, Verdict
from fireworld.shown import at_most

SHOWN: Final = 20
"""Findings that are shown in full; of more the headline."""
LINES_SHOWN: Final = 12
"""Lines on what changed; of more their number."""
WORDS: Final[Mapping[Verdict, str]] = {"same": "the same", "different": "different", "cannot": "could not be checked"}
_SPECIAL: Final = re.compile(r"([\\`*_{}\[\]<>#|~&$])")


def markdown_page(
    title: str, findings: Sequence[Finding], *, beside: Path | None = None, words: Mapping[Verdict, str] = WORDS
) -> str:
    """Write findings as Markdown, the worst first; of what is the same only what has a table to show.

    Args:
        title: what was checked.
        findings: what was found.
        beside: the folder of the file, from which links and pictures are named; None: the current one.
        words: for the verdicts.
    """
    ordered = [one for verdict in VERDICTS for one in findings if one.verdict == verdict]
    shown = [one for one in ordered if one.verdict != "same" or one.rows]
    counts = [(sum(one.verdict == verdict for one in findings), words[verdict]) for verdict in VERDICTS]
    counted = ", ".join(f"{n} {word}" for n, word in counts if n)
    parts = [f"## {escaped(title)}: {counted or 'nothing was checked'}"]
    for one in shown[:SHOWN]:
        parts += _section(one, beside or Path())
    parts += [f"- {escaped(one.name)}: {escaped(one.headline)}" for one in shown[SHOWN:]]
    return "\n\n".join(parts) + "\n"


def escaped(text: str) -> str:
    """Return text that Markdown shows as it is, on one line, and in which nobody is mentioned."""
    return _SPECIAL.sub(r"\\\1", " ".join(text.split())).replace("@", "&#64;")


def files_beside(page: Path) -> Path:
    """Return the folder of the pictures and pages that a Markdown file shows."""
    return page.with_name(f"{page.stem}-files")


def _section(finding: Finding, beside: Path) -> Iterator[str]:
    yield f"### {escaped(finding.name)}"
    head, *more = finding.cause or [""]
    if head:
        yield f"**{escaped(head)}**"
    if more:
        yield "\n".join(f"- {escaped(line)}" for line in at_most(more, LINES_SHOWN))
    yield escaped(finding.first or finding.headline)
    if finding.rows:
        yield markdown_table(finding.heads, finding.rows)
    if finding.picture:
        yield f"![{escaped(finding.name)}]({_target(finding.picture, beside)})"
    if finding.links:
        yield " · ".join(f"[{escaped(label)}]({_target(path, beside)})" for label, path in finding.links.items())


def markdown_table(heads: Sequence[str], rows: Sequence[Sequence[str]], *, n_text: int = 1) -> str:
    """Write a table; the first `n_text` columns are words, the others are numbers."""
    rule = ["---" if k < n_text else "---:" for k in range(len(heads))]
    cells = [[*map(escaped, heads)], rule, *([*map(escaped, row)] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in cells)


def _target(path: str, beside: Path) -> str:
    return quote(Path(os.path.relpath(path, beside)).as_posix())
