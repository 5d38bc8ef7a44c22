"""The page: data, style and program in one HTML file, and a frame that holds it inside another page."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.resources import files
from typing import Final

from fireworld.errors import one_line
from fireworld.records import Recording
from fireworld_viewer.play.columns import Columns
from fireworld_viewer.play.look import look
from fireworld_viewer.play.run_columns import add_city, add_run
from fireworld_viewer.story.steps import common_steps, steps_of

SCRIPTS: Final = (
    "colour", "numbers", "unpack", "run", "player", "view", "spots", "glyphs", "map", "pick",
    "curves", "timeline", "team", "chosen", "legend", "keys", "main",
)  # fmt: skip
"""The parts of the program, each after those that it uses."""
FRAME_HEIGHT: Final = 900
_LEVEL: Final = 9
_IMPORT: Final = re.compile(r"^import [^;]*;\n", re.MULTILINE)
_EXPORT: Final = re.compile(r"^export ", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class FirstDifference:
    """Where two runs first differ."""

    step: int
    sentence: str


def play_page(
    recordings: Sequence[Recording],
    *,
    names: Sequence[str],
    damages: Sequence[str | None] = (None, None),
    first: FirstDifference | None = None,
    start: int | None = None,
) -> str:
    """Write the page of one recording, or of two of one city.

    Args:
        recordings: steps that can be read often, at least one each.
        names: of the recordings.
        damages: what is wrong with each, or None.
        first: where two first differ; None if they are the same.
        start: the step that it opens at, unless its address names one; the first if left out.

    Raises:
        ViewError: a recording has no steps, or the cities differ.
    """
    steps_of(recordings)
    titles = [one_line(one.header.title) for one in recordings]
    data = base64.b64encode(_data(recordings, names, damages, first, start)).decode()
    script, style = program(), _text("play.css")
    parts = {
        "title": escape(f"fireworld: {' against '.join(titles)}"),
        "policy": f"default-src 'none'; script-src {_hash(script)}; style-src {_hash(style)}; base-uri 'none'",
        "style": style,
        "data": data,
        "script": script,
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _text("play.html"))


def frame(page: str, *, height: int = FRAME_HEIGHT, label: str = "a run that plays") -> str:
    """Return HTML that shows the page inside another one, in a frame of its own.

    Args:
        page: what `play_page` wrote.
        height: in pixels.
        label: what screen readers call it.
    """
    box = f"width:100%;height:{height}px;border:0"
    return f'<iframe title="{escape(label)}" style="{box}" srcdoc="{escape(page)}"></iframe>'


@cache
def program() -> str:
    """Return the program, its parts joined to one: without imports, since what they name is in the same text."""
    parts = [_EXPORT.sub("", _IMPORT.sub("", _text(f"{name}.js"))) for name in SCRIPTS]
    return "\n".join(parts)


def _data(
    recordings: Sequence[Recording],
    names: Sequence[str],
    damages: Sequence[str | None],
    first: FirstDifference | None,
    start: int | None,
) -> bytes:
    """Pack everything that is shown: the length of the words, the words as JSON, the columns; deflated."""
    columns = Columns()
    city = add_city(columns, recordings[0].city)
    runs = [
        {**add_run(columns, recording, f"{index}."), "name": one_line(name), "damage": damage and one_line(damage)}
        for index, (recording, name, damage) in enumerate(zip(recordings, names, damages, strict=False))
    ]
    if len(recordings) > 1:
        _add_steps(columns, *recordings)
    words = {
        "look": look(),
        "city": city,
        "runs": runs,
        "first": first and {"step": first.step, "sentence": one_line(first.sentence)},
        "start": start,
        "columns": columns.table,
    }
    text = json.dumps(words, separators=(",", ":"), allow_nan=False).encode()
    packer = zlib.compressobj(_LEVEL)
    packed = [packer.compress(part) for part in (len(text).to_bytes(4, "little"), text, *columns.parts)]
    return b"".join([*packed, packer.flush()])


def _add_steps(columns: Columns, first: Recording, second: Recording) -> None:
    """Add the steps of either run, and the row of each run with its state there."""
    for column, numbers in zip(("steps", "rowA", "rowB"), common_steps(first.steps, second.steps), strict=True):
        columns.add(f"both.{column}", numbers)


def _hash(text: str) -> str:
    """Return how the policy of the page names a text that the browser may execute or apply; it may no other."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


@cache
def _text(name: str) -> str:
    return (files("fireworld_viewer.play") / name).read_text(encoding="utf-8")
