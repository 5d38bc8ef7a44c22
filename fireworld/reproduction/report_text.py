"""The report of a reproduction as text: the paper's Tables 1 to 3 beside ours, and what was found."""

from __future__ import annotations

from typing import Final

from fireworld.reproduction.findings import caveat, findings
from fireworld.reproduction.paper_tables import APART, NEAR, WITHIN, PaperCell, PaperTables
from fireworld.reproduction.study import Study
from fireworld.shown import text_table

_MARKS: Final = {WITHIN: "=", NEAR: "~", APART: "x"}
_QUANTITIES: Final = {"convergence episode": "episodes", "time to complete": "time"}
_HEADS: Final = ("scenario", "quantity", "without cooperation", "with")


def report_text(study: Study, tables: PaperTables) -> str:
    """Return the report."""
    lines = [
        "paper: ours [95 % interval]",
        text_table(_HEADS, _rows(tables), "<<>>"),
        "= the paper's value is in it, ~ our mean is within 25 % of it, x neither",
        "",
        "findings",
        *(f"  {finding.question} {finding.verdict}" for finding in findings(study, tables)),
    ]
    return "\n".join([*lines, *filter(None, [caveat(study)])])


def _rows(tables: PaperTables) -> list[list[str]]:
    rows = [[cell.scenario, _quantity(cell), "", _compared(cell)] for cell in tables.trainings]
    for pair in (*tables.tests, *tables.more_brigades):
        scenario = pair.without.scenario.replace("-brigades-", ", ")
        rows.append([scenario, _quantity(pair.without), _compared(pair.without), _compared(pair.together)])
    return rows


def _quantity(cell: PaperCell) -> str:
    return _QUANTITIES.get(cell.quantity, cell.quantity)


def _compared(cell: PaperCell) -> str:
    digits = 1 if cell.quantity == "score" else 0
    return f"{_MARKS[cell.verdict]} {cell.paper:.3g}: {cell.ours.text(digits=digits)}"
