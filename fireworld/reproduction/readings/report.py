"""What a study of readings leaves in its folder: effects and the specification curve as CSV and figure, and pages."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Final

from fireworld_viewer.pictures.figure_files import png_bytes
from fireworld_viewer.pictures.specification import draw_specification

from fireworld.files import write_file
from fireworld.html_page import html_figure, html_page, html_table, text_cell
from fireworld.markdown import escaped, markdown_table
from fireworld.reproduction.readings.choices import OpenChoice
from fireworld.reproduction.readings.effects import Effect
from fireworld.reproduction.readings.findings import findings_text
from fireworld.reproduction.readings.study import ReadingsStudy

PAGE: Final = "readings.html"
MARKDOWN: Final = "readings.md"
EFFECTS: Final = "readings-effects.csv"
CURVE: Final = "readings-curve.csv"
FIGURE: Final = "readings-curve.png"
SAID_OF_CURVE: Final = (
    "What cooperation adds in each reading, with its 95 % interval over trainings, if there are three or more."
)
SAID_OF_EFFECTS: Final = "Of the other level against ours, all other choices balanced, over the readings of the design."
EFFECT_HEADS: Final = ("on what cooperation adds", "on the team with cooperation", "on the team without")


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
    write_file(folder / MARKDOWN, markdown_text(study))
    write_file(folder / PAGE, _page(study, image))
    return folder / PAGE


def _effects(study: ReadingsStudy) -> str:
    lines = ["choice,level,of,effect,low_95,high_95"]
    of_all = {
        "difference": study.effects,
        "cooperative": study.level_effects,
        "non_cooperative": study.control_effects,
    }
    for of, effects in of_all.items():
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


def markdown_text(study: ReadingsStudy) -> str:
    """Return what was found as Markdown: how much was tried, findings, main effects, and the figure beside it."""
    said = "\n".join(f"* {escaped(one)}" for one in findings_text(study))
    rows = [
        (choice.name, choice.ours, choice.screen[1], *(effect.text() for effect in effects))
        for choice, *effects in _by_choice(study)
    ]
    parts = [
        _size_text(study),
        said,
        markdown_table(("choice", "ours", "other", *EFFECT_HEADS), rows, n_text=3),
        SAID_OF_EFFECTS,
        f"![{SAID_OF_CURVE}]({FIGURE})",
    ]
    return "\n\n".join(parts) + "\n"


def _by_choice(study: ReadingsStudy) -> Iterator[tuple[OpenChoice, Effect, Effect, Effect]]:
    return zip(study.choices, study.effects, study.level_effects, study.control_effects, strict=True)


def _size_text(study: ReadingsStudy) -> str:
    size = study.size
    return (
        f"{len(study.readings)} readings, {size.trainings} trainings of each, {size.seeds} seeds a test. "
        "Share of the greatest score, mean over the three tests with four brigades."
    )


def _page(study: ReadingsStudy, image: bytes) -> str:
    rows = [
        [
            *map(text_cell, (choice.name, escape(choice.sentence), choice.ours, choice.screen[1])),
            *(effect.text() for effect in effects),
        ]
        for choice, *effects in _by_choice(study)
    ]
    said = "".join(f"<li>{escape(one)}</li>" for one in findings_text(study))
    body = [
        "<h1>The paper in every reading</h1>",
        f"<p>{_size_text(study)}</p>",
        f"<h2>Findings</h2><ul>{said}</ul>",
        "<h2>Main effects</h2>",
        html_table(["choice", "the paper", "ours", "other", *EFFECT_HEADS], rows, n_text=4),
        f"<p>{SAID_OF_EFFECTS}</p>",
        "<h2>All readings</h2>",
        html_figure(image, SAID_OF_CURVE),
    ]
    return html_page("fireworld: readings", body)
