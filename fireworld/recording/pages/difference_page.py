"""A comparison of two recordings as one HTML page: the first difference, maps, curves and how it spread."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fireworld_recorder.spread import differing_entities
from fireworld_viewer.pictures.differences import draw_difference_curves, draw_difference_map
from fireworld_viewer.pictures.figure_files import png_bytes
from fireworld_viewer.pictures.maps import draw_record
from fireworld_viewer.story.series import LABELS

from fireworld.html_page import compared_row, html_credit, html_figure, html_mark, html_page, html_table, text_cell
from fireworld.recording.difference_text import (
    SPREAD_HEADS,
    SPREAD_NOTE,
    shortened,
    spread_cells,
    spread_sentences,
    totals_rows,
)
from fireworld.records import PHASES

if TYPE_CHECKING:
    from fireworld_recorder.diff import RunComparison

    from fireworld.recording.difference import Difference

_STYLE: Final = """
.maps { grid-template-columns: repeat(2, 1fr); } .first { font-size: 1.25rem; margin: .8rem 0 1.2rem; }
td.text { overflow-wrap: anywhere; }
"""
_CURVES: Final = ("score", "n_burning", "n_burnt_out")
_CURVES_CAPTION: Final = "Score, burning and burnt-out buildings of both, and buildings that differ."
_CAPTIONS: Final = {"a": "A", "b": "B", "difference": "What differs between the two maps, and out of sight"}
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
    body = difference_body(compared, _draw_all(compared))
    return html_page(f"fireworld: {b} against {a}", [title, *body], style=_STYLE)


def difference_body(compared: Difference, images: Mapping[str, bytes]) -> list[str]:
    """Write what stands below the title; images are PNG files by name, and left out where missing."""
    difference, first, cause = compared.found, compared.first, compared.cause
    verdict = html_mark("the same", "good") if first is None else html_mark("different", "bad")
    sentence = f"{difference.n_steps_compared} steps are the same" if first is None else first.sentence
    return [
        f'<p class="first">{verdict} {escape(sentence)}</p>',
        *(f"<p>{escape(line.strip())}</p>" for line in (cause.lines if first or cause.changes else ())),
        *(f'<p class="caveat">{escape(f"{name}: {run.damage}; nothing is compared beyond")}</p>'
          for run, name in zip(compared.runs, compared.names, strict=True) if run.damage is not None),
        _header(compared),
        *_maps("The first difference", "first", images),
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


def _maps(title: str, moment: str, images: Mapping[str, bytes]) -> Iterator[str]:
    named = {f"{moment}-{name}": caption for name, caption in _CAPTIONS.items()}
    shown = [html_figure(images[name], caption) for name, caption in named.items() if name in images]
    if shown:
        yield f"<h2>{title}</h2>"
        yield f'<div class="maps">{"".join(shown)}</div>'


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
    for moment, row in zip(("first", "last"), [*rows[:1], *rows[1:][-1:]], strict=False):
        images |= {f"{moment}-{name}": image for name, image in _draw_maps(difference, row.step).items()}
    if difference.rows:
        images["curves"] = _draw_curves(difference)
    return images


def _draw_maps(difference: Difference, step: int) -> dict[str, bytes]:
    """Draw one step of both runs, and what of it differs."""
    city, (a, b) = difference.runs[0].city, (run.step(step) for run in difference.runs)
    figures = {"difference": draw_difference_map(city, a, b, differing_entities(a, b, difference.rules, city))}
    for name, record in (("a", a), ("b", b)):
        score = f"score {record.score.score:.4g} of {record.score.score_max:.0f}"
        figures[name] = draw_record(city, record, title=f"{name.upper()}: step {record.step}, {score}")
    return {name: png_bytes(figure) for name, figure in figures.items()}


def _draw_curves(difference: Difference) -> bytes:
    """Draw score, burning and burnt out of both runs, and how many buildings differ."""
    rows, curves = difference.rows, {}
    for name in _CURVES:
        both = [getattr(row, name) for row in rows]
        curves[LABELS[f"score.{name}"]] = [one.a for one in both], [one.b for one in both]
    n_buildings = {"in anything": [row.n_buildings for row in rows], "in fieryness": [row.n_states for row in rows]}
    first_step = None if difference.first is None else difference.first.step
    steps = [row.step for row in rows]
    return png_bytes(draw_difference_curves(steps, curves, n_buildings, first_step=first_step))
