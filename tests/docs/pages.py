"""The pages of the project, and what is to be found in them: headings, links, code."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])
README = ROOT / "README.md"
FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SILENT = " > /dev/null"
"""At the end of a command: its output is not shown."""
REDIRECTED = re.compile(r" > \S+$")
LINK = re.compile(r"\[[^\]\[]*\]\(([^()\s]+)\)")


def page_name(page: Path) -> str:
    """Name a page in the output of the tests."""
    return str(page.relative_to(ROOT))


def with_part(page: str, begin: str, end: str, part: str) -> str:
    """Return a page with another part between two marks, which stay."""
    head, _, rest = page.partition(begin)
    _, _, tail = rest.partition(end)
    return f"{head}{begin}{part}{end}{tail}"


def fenced(page: Path, language: str) -> list[str]:
    """Return the fenced blocks of one language."""
    return [code for found, code in FENCED.findall(page.read_text(encoding="utf-8")) if found == language]


def code(page: Path) -> list[str]:
    """Return what a page shows as code: lines of blocks, indented or fenced for a shell, and what is in backticks."""
    text = page.read_text(encoding="utf-8")
    fences = [
        line for language in ("", "sh", "console") for block in fenced(page, language) for line in block.splitlines()
    ]
    prose = FENCED.sub("", text)
    return fences + re.findall(r"^    (.+)$", prose, re.MULTILINE) + re.findall(r"`([^`\n]+)`", prose)


def commands(page: Path) -> list[list[str]]:
    """Return the words after `fireworld` of every command in a page's code, remarks left out, `&&` taken apart."""
    lines = [REDIRECTED.sub("", line.removeprefix("$ ")) for line in code(page)]
    parts = [part.strip() for line in lines for part in line.split("&&")]
    return [shlex.split(part, comments=True)[1:] for part in parts if part.startswith("fireworld ")]


def links(page: Path) -> list[str]:
    """Return the targets of all links, those in code left out."""
    text = re.sub(r"`[^`\n]*`", "", FENCED.sub("", page.read_text(encoding="utf-8")))
    return LINK.findall(text)


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as web pages of repositories make them."""
    headings = re.findall(r"^#+ (.+)$", FENCED.sub("", page.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
