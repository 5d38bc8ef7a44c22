"""Maps and curves of two recordings that differ, as PNG files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

from fireworld_recorder.spread import differing_entities
from fireworld_viewer.pictures.figure_files import png_bytes
from fireworld_viewer.pictures.maps import draw_record
from fireworld_viewer.pictures.run_differences import draw_difference_curves, draw_difference_map
from fireworld_viewer.story.series import LABELS

if TYPE_CHECKING:
    from fireworld_recorder.diff import Difference
    from fireworld_recorder.match import Rules
    from fireworld_recorder.reader import Log
    from fireworld_recorder.spread import SpreadRow

_CURVES: Final = ("score", "n_burning", "n_burnt_out")


def draw_all(
    logs: tuple[Log, Log], difference: Difference, rules: Rules, rows: Sequence[SpreadRow]
) -> Mapping[str, bytes]:
    """Draw what there is to see of a difference.

    Args:
        logs: both recordings.
        difference: how they differ.
        rules: by which they differ.
        rows: of every step.

    Returns:
        PNG files: "curves" if there are rows, and "first-a", "first-b", "first-difference", "last-a", "last-b",
        "last-difference": maps of the steps where they first and last differ, if they differ in a step that both have.

    Raises:
        ViewError: matplotlib is not installed.
        LogError: a recording changed since it was opened.
    """
    images: dict[str, bytes] = {}
    for moment, row in zip(("first", "last"), _ends(difference.spread.rows), strict=False):
        images |= {f"{moment}-{name}": image for name, image in _draw_maps(logs, row.step, rules).items()}
    if rows:
        images["curves"] = _draw_curves(rows, difference)
    return images


def _ends(rows: Sequence[SpreadRow]) -> Sequence[SpreadRow]:
    """Return the first row and the last, if they are two."""
    return [*rows[:1], *rows[1:][-1:]]


def _draw_maps(logs: tuple[Log, Log], step: int, rules: Rules) -> dict[str, bytes]:
    """Draw one step of both runs, and what of it differs."""
    city, (a, b) = logs[0].city, (log.step(step) for log in logs)
    figures = {"difference": draw_difference_map(city, a, b, differing_entities(a, b, rules, city))}
    for name, record in (("a", a), ("b", b)):
        score = f"score {record.score.score:.4g} of {record.score.score_max:.0f}"
        figures[name] = draw_record(city, record, title=f"{name.upper()}: step {record.step}, {score}")
    return {name: png_bytes(figure) for name, figure in figures.items()}


def _draw_curves(rows: Sequence[SpreadRow], difference: Difference) -> bytes:
    """Draw score, burning and burnt out of both runs, and how many buildings differ."""
    curves = {}
    for name in _CURVES:
        both = [getattr(row, name) for row in rows]
        curves[LABELS[f"score.{name}"]] = [one.a for one in both], [one.b for one in both]
    n_buildings = {"in anything": [row.n_buildings for row in rows], "in fieryness": [row.n_states for row in rows]}
    first_step = None if difference.first is None else difference.first.step
    steps = [row.step for row in rows]
    return png_bytes(draw_difference_curves(steps, curves, n_buildings, first_step=first_step))
