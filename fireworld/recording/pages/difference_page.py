"""A comparison of two recordings as one HTML page: the first difference, maps, curves and how it spread."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fireworld.cli.difference_text import SPREAD_HEADS, SPREAD_NOTE, reached, shortened, spread_cells, totals_rows
from fireworld.html_page import html_figure, html_mark, html_page, html_table, text_cell
from fireworld.records import PHASES

if TYPE_CHECKING:
    from fireworld_recorder.diff import Difference
    from fireworld_recorder.reader import Log

_STYLE: Final = """
.maps { grid-template-columns: repeat(2, 1fr); } .first { font-size: 1.25rem; margin: .8rem 0 1.2rem; }
td.text { overflow-wrap: anywhere; }
"""
_HEADER: Final = ("scenario", "scenario_digest", "seed", "policy", "policy_digest", "fireworld_version", "forked_from")


def difference_page(
    logs: tuple[Log, Log], difference: Difference, images: Mapping[str, bytes], *, names: tuple[str, str]
) -> str:
    """Write the page; it needs no other file.

    Args:
        logs: both recordings.
        difference: how they differ.
        images: PNG files by name, from `draw_all`; what is missing is left out.
        names: what the recordings are called.
    """
    first = difference.first
    verdict = html_mark("the same", "good") if first is None else html_mark("different", "bad")
    sentence = f"{difference.n_steps_compared} steps are the same" if first is None else first.sentence
    body = [
        f"<h1>{escape(Path(names[1]).name)} against {escape(Path(names[0]).name)}</h1>",
        f'<p class="first">{verdict} {escape(sentence)}</p>',
        *(f'<p class="caveat">{escape(f"{name}: {log.damage}; nothing is compared beyond")}</p>'
          for log, name in zip(logs, names, strict=True) if log.damage is not None),
        _header(logs, difference, names),
        *_maps("The first difference", "first", images),
        *_spread(difference),
        *_curves(images),
        *_maps("The last step of both", "last", images),
        *_topics(difference),
    ]  # fmt: skip
    return html_page(f"fireworld: {names[1]} against {names[0]}", body, style=_STYLE)


def _header(logs: tuple[Log, Log], difference: Difference, names: tuple[str, str]) -> str:
    """Say what was compared, and what both came to."""
    rows = [["recording", *names]]
    for key in _HEADER:
        values = [shortened(key, getattr(log.header, key)) for log in logs]
        if any(values):
            rows.append([key.replace("_", " "), *values])
    rows.append(["digest", *(log.digest[:12] for log in logs)])
    rows += [list(row) for row in totals_rows(difference)]
    marked = [
        [label, *(f"<b>{escape(value)}</b>" if a != b else escape(value) for value in (a, b))] for label, a, b in rows
    ]
    return html_table(["", "A", "B"], [[text_cell(label), a, b] for label, a, b in marked])


def _maps(title: str, moment: str, images: Mapping[str, bytes]) -> Iterator[str]:
    captions = {"a": "A", "b": "B", "difference": "What differs between the two maps, and out of sight"}
    shown = [
        html_figure(images[f"{moment}-{name}"], caption)
        for name, caption in captions.items()
        if f"{moment}-{name}" in images
    ]
    if shown:
        yield f"<h2>{title}</h2>"
        yield f'<div class="maps">{"".join(shown)}</div>'


def _spread(difference: Difference) -> Iterator[str]:
    if difference.spread.rows:
        yield "<h2>How it spread</h2>"
        yield "".join(f"<p>{escape(sentence)}</p>" for sentence in reached(difference))
        yield html_table(SPREAD_HEADS, [spread_cells(row) for row in difference.spread.rows], n_text=0)
        yield f"<p>{escape(SPREAD_NOTE[0].upper() + SPREAD_NOTE[1:])}.</p>"


def _curves(images: Mapping[str, bytes]) -> Iterator[str]:
    if "curves" in images:
        yield "<h2>Curves</h2>"
        yield html_figure(
            images["curves"], "Score, burning and burnt-out buildings of both, and buildings that differ."
        )


def _topics(difference: Difference) -> Iterator[str]:
    """Say of each topic when it came to differ, how often it does, and where that began."""
    if not difference.n_steps_differing:
        return
    yield "<h2>Topics</h2>"
    heads = ["topic", "phase", "first difference", "steps that differ", "of"]
    rows = []
    for topic, n in difference.n_steps_differing.items():
        place = difference.first_by_topic[topic]
        cells = (topic, PHASES.get(topic, place.phase), place.sentence)
        rows.append([*(text_cell(escape(cell)) for cell in cells), str(n), str(difference.n_steps_compared)])
    yield html_table(heads, rows, n_text=3)
