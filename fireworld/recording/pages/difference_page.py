"""A comparison of two recordings as one HTML page: the first difference, maps, curves and how it spread."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from fireworld_recorder.spread import differing_entities
from fireworld_viewer.pictures.curves import draw_pair_curves
from fireworld_viewer.pictures.differences import decided_otherwise, draw_difference_map
from fireworld_viewer.pictures.extent import fire_extent, widened
from fireworld_viewer.pictures.figure_files import plain_style, png_bytes
from fireworld_viewer.pictures.maps import draw_steps
from fireworld_viewer.play.page import frame
from fireworld_viewer.story.series import action_name
from fireworld_viewer.story.steps import select_steps

from fireworld.html_page import compared_row, html_credit, html_figure, html_mark, html_page, html_table, text_cell
from fireworld.recording.difference_text import (
    SPREAD_HEADS,
    SPREAD_NOTE,
    shortened,
    spread_cells,
    spread_sentences,
    totals_rows,
)
from fireworld.recording.pages.play import page_of_difference
from fireworld.records import PHASES, Recording, StepRecord, StoredRun

if TYPE_CHECKING:
    from fireworld_recorder.diff import RunComparison

    from fireworld.recording.difference import Difference

_STYLE: Final = ".first { font-size: 1.25rem; margin: .8rem 0 1.2rem; } .difference img { width: 56rem; }"
_CURVES_CAPTION: Final = "Both runs, and how many buildings differ. Dotted: the first difference."
_MAPS_CAPTION: Final = "Both runs at this step, where it burns."
_DIFFERENCE_CAPTION: Final = (
    "What differs. In color: buildings in another state. A light shade: those that differ in a number only, as in the "
    "warmth of the air around them."
)
_HEADER: Final = (
    "scenario",
    "scenario_digest",
    "seed",
    "policy",
    "policy_digest",
    "fireworld_version",
    "simulator_digest",
    "forked_from",
)


def difference_page(compared: Difference) -> str:
    """Write the page, which needs no other file; ViewError without matplotlib, LogError if a recording changed."""
    a, b = compared.names
    title = f"<h1>{escape(Path(b).name)} against {escape(Path(a).name)}</h1>"
    has_both = not compared.known_same and all(len(run.steps) for run in compared.runs)
    played = played_difference(compared) if has_both else ""
    body = difference_body(compared, _draw_all(compared), played=played)
    return html_page(f"fireworld: {b} against {a}", [title, *body], style=_STYLE)


def played_difference(compared: Difference) -> str:
    """Return the page on which both runs play, at their first difference; ViewError where one has no steps."""
    return page_of_difference(compared.runs, None if compared.known_same else compared.found)


def difference_body(compared: Difference, images: Mapping[str, bytes], *, played: str = "") -> list[str]:
    """Write what stands below the title; images are PNG files by name, `played` a page; left out where missing."""
    difference, first, cause = compared.found, compared.first, compared.cause
    verdict = html_mark("the same", "good") if first is None else html_mark("different", "bad")
    sentence = f"{difference.n_steps_compared} steps are the same" if first is None else first.sentence
    return [
        f'<p class="first">{verdict} {escape(sentence)}</p>',
        *(f"<p>{escape(line.strip())}</p>" for line in (cause.lines if first or cause.changes else ())),
        *(f'<p class="caveat">{escape(f"{name}: {run.damage}; nothing is compared beyond")}</p>'
          for run, name in zip(compared.runs, compared.names, strict=True) if run.damage is not None),
        _header(compared),
        *_maps("The first difference", "first", images, list(_decisions(compared)) if images else []),
        *(["<h2>Play both</h2>", frame(played, label="both runs, side by side")] if played else []),
        *_spread(difference),
        *(["<h2>Curves</h2>", html_figure(images["curves"], _CURVES_CAPTION)] if "curves" in images else []),
        *_maps("The last step of both", "last", images),
        *_topics(difference),
        *html_credit(run.city.attribution for run in compared.runs),
    ]  # fmt: skip


def _header(compared: Difference) -> str:
    """Write what was compared, and how both runs came out."""
    runs = compared.runs
    rows: list[Sequence[str]] = [("recording", *compared.names)]
    for key in _HEADER:
        values = [shortened(key, getattr(run.header, key)) for run in runs]
        if any(values):
            rows.append([key.replace("_", " "), *values])
    rows += [("digest", *(run.digest[:12] for run in runs)), *totals_rows(*compared.totals)]
    return html_table(["", "A", "B"], [compared_row(label, values) for label, *values in rows])


def _maps(title: str, moment: str, images: Mapping[str, bytes], words: Sequence[str] = ()) -> Iterator[str]:
    if f"{moment}-both" in images:
        yield f"<h2>{title}</h2>"
        yield from (f"<p>{escape(line)}</p>" for line in words)
        yield html_figure(images[f"{moment}-both"], _MAPS_CAPTION)
        yield f'<div class="difference">{html_figure(images[f"{moment}-difference"], _DIFFERENCE_CAPTION)}</div>'


def _decisions(compared: Difference) -> Iterator[str]:
    """Write what brigades decided in either run at the first difference, where that is another decision."""
    first = compared.first
    if first is None or first.step is None or not all(first.step in run.steps for run in compared.runs):
        return
    a, b = (run.step(first.step) for run in compared.runs)
    for brigade in decided_otherwise(a, b):
        yield f"Brigade {brigade}: " + "; ".join(
            f"{name} {_decision(run, record, brigade)}"
            for name, run, record in zip("AB", compared.runs, (a, b), strict=True)
        )


def _decision(run: StoredRun, record: StepRecord, brigade: int) -> str:
    action, target = int(record.decisions.action[brigade]), int(record.decisions.target[brigade])
    if action < 0:
        return "made no choice"
    known = 0 <= target < len(run.city.building_id)
    return f"chose {action_name(action)}" + (f" → building {run.city.building_id[target]}" if known else "")


def _spread(difference: RunComparison) -> Iterator[str]:
    if difference.spread.rows:
        yield "<h2>How it spread</h2>"
        yield "".join(f"<p>{escape(sentence)}</p>" for sentence in spread_sentences(difference))
        yield html_table(SPREAD_HEADS, [spread_cells(row) for row in difference.spread.rows], n_text=0)
        yield f"<p>{escape(SPREAD_NOTE[0].upper() + SPREAD_NOTE[1:])}.</p>"


def _topics(difference: RunComparison) -> Iterator[str]:
    """Write of each topic when it came to differ, how often it does, and where that began."""
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


def _draw_all(difference: Difference) -> Mapping[str, bytes]:
    """Draw curves of the runs, if their digests differ, and maps of the steps where they first and last differ."""
    images: dict[str, bytes] = {}
    rows = difference.spread.rows
    runs = [select_steps(run) for run in difference.runs] if difference.rows else []  # each file is read once
    with plain_style():
        part = fire_extent(runs) if runs else None
        for moment, row in zip(("first", "last"), [*rows[:1], *rows[1:][-1:]], strict=False):
            images[f"{moment}-both"] = png_bytes(draw_steps(runs, [row.step]))
            city, (a, b) = difference.runs[0].city, (run.step(row.step) for run in difference.runs)
            differing = differing_entities(a, b, difference.rules, city)
            crew = np.column_stack([b.brigades.x_m, b.brigades.y_m])[decided_otherwise(a, b)]
            around = widened(part, crew, city)
            images[f"{moment}-difference"] = png_bytes(draw_difference_map(city, a, b, differing, part=around))
        if difference.rows:
            images["curves"] = _draw_curves(difference, runs)
    return images


def _draw_curves(difference: Difference, runs: Sequence[Recording]) -> bytes:
    """Draw the curves of both runs, and how many buildings differ."""
    steps = [row.step for row in difference.rows]
    n_buildings = {
        "in anything": (steps, [row.n_buildings for row in difference.rows]),
        "in their state": (steps, [row.n_states for row in difference.rows]),
    }
    first_step = None if difference.first is None else difference.first.step
    more = {"buildings that differ": n_buildings}
    return png_bytes(draw_pair_curves(runs, more=more, first_step=first_step))
