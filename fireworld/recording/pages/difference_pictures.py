"""Maps and curves of two recordings that differ, as PNG files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from fireworld_recorder.spread import differing_entities
from fireworld_viewer.pictures.figure_files import png_bytes
from fireworld_viewer.pictures.maps import draw_record
from fireworld_viewer.pictures.run_differences import draw_difference_curves, draw_difference_map
from fireworld_viewer.story.series import LABELS

if TYPE_CHECKING:
    from fireworld.recording.difference import Difference

_CURVES: Final = ("score", "n_burning", "n_burnt_out")


def draw_all(difference: Difference) -> Mapping[str, bytes]:
    """Draw two runs where they differ.

    Args:
        difference: how the runs differ.

    Returns:
        PNG files: "curves" if the runs do not have one digest, and "first-a", "first-b", "first-difference", "last-a",
        "last-b", "last-difference": maps of the steps where they first and last differ, if both have such a step.

    Raises:
        ViewError: matplotlib is not installed.
        LogError: a recording changed since it was opened.
    """
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
