"""What a study of readings leaves in its folder: effects and the specification curve as CSV and figure, and a page."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Final

from fireworld_viewer.pictures.figure_files import png_bytes
from fireworld_viewer.pictures.specification import draw_specification

from fireworld.files import write_file
from fireworld.html_page import html_figure, html_page, html_table, text_cell
from fireworld.reproduction.readings.findings import findings_text
from fireworld.reproduction.readings.study import ReadingsStudy

PAGE: Final = "readings.html"
EFFECTS: Final = "readings-effects.csv"
CURVE: Final = "readings-curve.csv"
FIGURE: Final = "readings-curve.png"


def write_readings(study: ReadingsStudy, folder: Path) -> Path:
    """Write everything; return the page. Errors as for `write_file`."""
    write_file(folder / EFFECTS, _effects(study))
    write_file(folder / CURVE, _curve(study))
    estimates = [(one.mean, *((one.low, one.high) if one.can_tell else (one.mean,) * 2)) for one in study.estimates]
    names, others = (
        [choice.name for choice in study.choices],
        [
            [study.level(number, choice) != choice.ours for choice in study.choices]
            for number in range(len(study.readings))
        ],
    )
    label = "cooperative - non-cooperative"
    image = png_bytes(draw_specification(estimates, names, others, label=label))
    write_file(folder / FIGURE, image)
    write_file(folder / PAGE, _page(study, image))
    return folder / PAGE


def _effects(study: ReadingsStudy) -> str:
    lines = ["choice,level,of,effect,low_95,high_95"]
    for of, effects in (("difference", study.effects), ("cooperative", study.level_effects)):
        for choice, one in zip(study.choices, effects, strict=True):
            lines.append(f"{choice.name},{choice.screen[1]},{of},{one.mean!r},{one.low!r},{one.high!r}")
    return "\n".join(lines) + "\n"


def _curve(study: ReadingsStudy) -> str:
    lines = ["reading,mean,low_95,high_95," + ",".join(choice.name for choice in study.choices)]
    found = study.estimates
    for number in sorted(range(len(found)), key=lambda n: (found[n].mean, n)):
        levels = (study.level(number, choice) for choice in study.choices)
        one = found[number]
        ends = f"{one.low!r},{one.high!r}" if one.can_tell else ","
        lines.append(f"{number},{one.mean!r},{ends}," + ",".join(levels))
    return "\n".join(lines) + "\n"


def _page(study: ReadingsStudy, image: bytes) -> str:
    rows = [
        [*map(text_cell, (choice.name, escape(choice.sentence), choice.ours, choice.screen[1])),
         effect.text(), level.text()]
        for choice, effect, level in zip(study.choices, study.effects, study.level_effects, strict=True)
    ]  # fmt: skip
    heads = ["choice", "the paper", "ours", "other", "on what cooperation adds", "on the cooperative team"]
    said = "".join(f"<li>{escape(one)}</li>" for one in findings_text(study))
    size = study.size
    body = [
        "<h1>The paper in every reading</h1>",
        f"<p>{len(study.readings)} readings, {size.trainings} trainings of each, {size.seeds} seeds a test.</p>",
        "<p>Share of the greatest score, mean over the three tests with four brigades.</p>",
        f"<h2>Findings</h2><ul>{said}</ul>",
        "<h2>Main effects</h2>",
        html_table(heads, rows, n_text=4),
        "<p>Of the other level against ours, all other choices balanced, over the readings of the design.</p>",
        "<h2>All readings</h2>",
        html_figure(
            image,
            "What cooperation adds in each reading, with its 95 % interval over trainings, if there are three or more.",
        ),
    ]
    return html_page("fireworld: readings", body)
