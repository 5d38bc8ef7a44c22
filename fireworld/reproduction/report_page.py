"""The report of a reproduction as one HTML page: findings, tables, graphs and maps, with every image in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Final

from fireworld.evaluation.statistics import Estimate
from fireworld.html_page import html_figure, html_mark, html_page, html_table, text_cell
from fireworld.reproduction.findings import caveat, findings, tally
from fireworld.reproduction.paper_tables import (
    APART,
    NEAR,
    WITHIN,
    PaperCell,
    PaperPair,
    PaperTables,
    TeamShare,
    cells_of,
)
from fireworld.reproduction.study import ALONE, TEAMS, TOGETHER, Study

_MARKS: Final = {
    WITHIN: "good", NEAR: "fair", APART: "bad",
    "reproduced": "good", "partly": "fair", "not reproduced": "bad", "open": "open", "yes": "good", "no": "bad",
}  # fmt: skip
_METHOD: Final = Path(__file__).with_name("method.html")
_CLAIMS: Final = {True: ("as the paper says", "good"), False: ("the other way", "bad"), None: ("open", "open")}


def report_page(study: Study, tables: PaperTables, images: Mapping[str, bytes]) -> str:
    """Write the page; images are PNG files by the names of `recordings.pictures`, and left out where missing."""
    body = [
        "<h1>Does the paper reproduce?</h1>",
        f"<p>{_introduction(study)}</p>",
        *([f'<p class="caveat">{escape(warning)}</p>'] if (warning := caveat(study)) else []),
        "<h2>Findings</h2>",
        _findings(study, tables),
        "<h2>Table 1: training scenarios with four brigades</h2>",
        _trainings(tables),
        "<h2>Table 2: three tests, four brigades</h2>",
        _pairs(tables.tests),
        "<h2>Table 3: the tests with other numbers of brigades</h2>",
        _pairs(tables.more_brigades),
        "<h2>Controls</h2>",
        _controls(tables),
        "<h2>Convergence</h2>",
        _image(images, "returns", "Return of each episode. Thick: mean over repetitions; thin: each of them."),
        _image(images, "policy-changes", "States in which the best action of a brigade changed."),
        "<h2>The city before and after</h2>",
        *(_maps(images, row.scenario) for row in tables.world.tests),
        "<h2>How it was measured</h2>",
        " ".join(_METHOD.read_text(encoding="utf-8").split()),
    ]
    return html_page("fireworld: reproduction", body)


def _introduction(study: Study) -> str:
    n_runs = sum(len(row.seeds) for teams in study.outcomes.values() for rows in teams.values() for row in rows)
    return (
        "A. Abdolmaleki, M. Movahedi, N. Lau, L. P. Reis: <i>A Distributed Cooperative Reinforcement Learning Method "
        "for Decision Making in Fire Brigade Teams</i> (RoboCup 2012), repeated in "
        f"{escape(study.world.description, quote=False)}: "
        f"<b>{study.n_repetitions}</b> trainings, each tested on <b>{len(study.seeds)}</b> seeds, {n_runs} test runs "
        "in all. Means are followed by their 95&nbsp;% interval over repetitions and seeds."
    )


def _findings(study: Study, tables: PaperTables) -> str:
    rows = []
    for one in findings(study, tables):
        cells = one.question, html_mark(one.verdict, _MARKS[one.verdict]), escape(one.text)
        rows.append([text_cell(cell) for cell in cells])
    return html_table(["question", "answer", "numbers"], rows, n_text=3)


def _trainings(tables: PaperTables) -> str:
    rows = []
    for place, converged in enumerate(tables.converged):
        episode, score = tables.trainings[2 * place : 2 * place + 2]
        rows.append([
            text_cell(episode.scenario), *_compared(episode, digits=0), f"{100 * converged.mean:.0f} %",
            *_compared(score, digits=2), _maximum(score),
        ])  # fmt: skip
    heads = ["scenario", "convergence episode: paper", "ours", "", "settled", "score: paper", "ours", "", "of"]
    note = (
        f"{tally(tables.trainings)}. The score is that of the last episode; the episode is 130 where nothing settled."
    )
    return html_table(heads, rows) + f"<p>{escape(note[0].upper() + note[1:])}</p>"


def _pairs(pairs: Sequence[PaperPair]) -> str:
    rows = []
    for pair in pairs:
        digits = 2 if pair.without.quantity == "score" else 0
        claim, mark = _CLAIMS[pair.claim_holds]
        rows.append([
            text_cell(pair.without.scenario), text_cell(pair.without.quantity), *_compared(pair.without, digits=digits),
            *_compared(pair.together, digits=digits), _spread(pair.difference, digits=digits, sign=True),
            html_mark(claim, mark), _maximum(pair.without),
        ])  # fmt: skip
    heads = [
        "scenario", "", "without: paper", "ours", "", "with: paper", "ours", "", "with - without", "", "of",
    ]  # fmt: skip
    counted = tally(cells_of(pairs))
    return html_table(heads, rows, n_text=2) + f"<p>{escape(counted[0].upper() + counted[1:])}.</p>"


def _controls(tables: PaperTables) -> str:
    parts = ["<p>Share of the greatest score.</p>"]
    for table, shares in ((tables.world.table_2, tables.shares), (tables.world.table_3, tables.shares_more_brigades)):
        heads = ["team", "", *(row.scenario for row in table), "mean", "typical run"]
        parts.append(html_table(heads, [_share(row) for row in shares], n_text=2))
    return "\n".join([*parts, "<p>A typical run is the mean of the middle half of all runs.</p>"])


def _share(row: TeamShare) -> list[str]:
    name = f"<b>{row.team}</b>" if row.team in {ALONE, TOGETHER} else row.team
    shares = [_spread(found, digits=2) for found in (*row.by_scenario, row.mean)]
    return [text_cell(name), text_cell(escape(TEAMS[row.team])), *shares, f"{row.mean.interquartile_mean:.2f}"]


def _maps(images: Mapping[str, bytes], scenario: str) -> str:
    captions = {"before": "before", ALONE: "after: without cooperation", TOGETHER: "after: with cooperation"}
    shown = [_image(images, f"{scenario}-{name}", caption) for name, caption in captions.items()]
    return f'<h3>{scenario}</h3><div class="maps">{"".join(shown)}</div>' if any(shown) else ""


def _compared(cell: PaperCell, *, digits: int) -> list[str]:
    """Three cells: the paper's value, ours, the verdict."""
    return [f"{cell.paper:g}", _spread(cell.ours, digits=digits), html_mark(cell.verdict, _MARKS[cell.verdict])]


def _spread(found: Estimate, *, digits: int, sign: bool = False) -> str:
    value, _, interval = found.text(digits=digits, sign=sign).partition(" ")
    return f'{value} <span class="interval">{interval}</span>'


def _maximum(cell: PaperCell) -> str:
    return "" if cell.ours_max is None else f"{cell.ours_max:.0f}"


def _image(images: Mapping[str, bytes], name: str, caption: str) -> str:
    return html_figure(images[name], caption) if name in images else ""
