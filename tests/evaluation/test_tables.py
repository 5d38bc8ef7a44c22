"""Verdicts, findings, CSV files and the page, on a study whose every value is known."""

from __future__ import annotations

import csv
import io
import re

import pytest

from fireworld.evaluation.statistics import Estimate
from fireworld.reproduction import paper
from fireworld.reproduction.csv_files import CSV_FILES, csv_files
from fireworld.reproduction.findings import caveat, findings, tally
from fireworld.reproduction.paper_tables import APART, NEAR, WITHIN, PaperCell, cells_of, make_tables
from fireworld.reproduction.recordings import draw_policy_changes, draw_returns
from fireworld.reproduction.report_page import report_page
from fireworld.reproduction.study import ALONE, TOGETHER
from tests.evaluation import synthetic


@pytest.mark.parametrize(
    ("mean", "low", "high", "verdict"),
    [
        (90.0, 80.0, 110.0, WITHIN),
        (300.0, 100.0, 400.0, WITHIN),
        (80.0, 75.0, 99.0, NEAR),
        (125.0, 125.0, 125.0, NEAR),
        (126.0, 125.0, 127.0, APART),
        (10.0, 0.0, 20.0, APART),
    ],
)
def test_the_verdict_of_a_cell(mean, low, high, verdict):
    ours = Estimate(mean, low, high, mean, 2, 3)
    assert PaperCell("test-1", "score", ALONE, 100.0, ours).verdict == verdict


def cells_in(tables):
    return [*tables.trainings, *cells_of([*tables.tests, *tables.more_brigades])]


def test_cells_hold_the_papers_values_beside_ours():
    tables = make_tables(synthetic.study())
    assert len(cells_in(tables)) == 16 + 18 + 18
    cell = tables.tests[0].together
    assert (cell.scenario, cell.quantity, cell.team) == ("test-1", "time to complete", TOGETHER)
    assert (cell.paper, cell.ours.mean) == (290, 436.0)
    assert [pair.without.verdict for pair in tables.tests[:2]] == [WITHIN, WITHIN]
    assert [share.mean for share in tables.converged] == [1.0] * 8
    assert tables.trainings[0].ours.mean == 31.5


def test_what_cooperation_changes():
    better = make_tables(synthetic.study(together=0.75, alone=0.5))
    scores = [pair for pair in better.tests if pair.without.quantity == "score"]
    assert [pair.claim_holds for pair in scores] == [True] * 3
    assert [pair.claim_holds for pair in better.tests if pair not in scores] == [None] * 6
    worse = make_tables(synthetic.study(together=0.25, alone=0.5))
    assert [pair.claim_holds for pair in worse.tests if pair.without.quantity == "score"] == [False] * 3


@pytest.mark.parametrize(
    ("together", "verdict", "against_random"),
    [(0.75, "reproduced", "yes"), (0.5, "not reproduced", "open"), (0.25, "not reproduced", "no")],
)
def test_findings_follow_the_numbers(together, verdict, against_random):
    study = synthetic.study(together=together)
    found = findings(study, make_tables(study))
    assert found[0].verdict == verdict
    assert f"{together - 0.5:+.2f}" in found[0].text
    assert "in the paper it is +0.60" in found[0].text
    (random,) = [finding for finding in found if "random actions" in finding.question]
    assert random.verdict == against_random
    (uncontrolled,) = [finding for finding in found if "uncontrolled" in finding.question]
    assert uncontrolled.verdict == "reproduced"
    assert "410 / 541 / 570" in uncontrolled.text
    assert found[-1].verdict == "not reproduced"
    assert "25 %" in found[-1].text


def test_every_cell_is_counted_once():
    cells = cells_in(make_tables(synthetic.study()))
    numbers = re.search(r"paper's (\d+) values (\d+) lie .* to (\d+) more .* to (\d+) it is not", tally(cells))
    total, *parts = map(int, numbers.groups())
    assert total == len(cells) == sum(parts)


def test_small_studies_carry_a_caveat():
    assert "2 repetitions and 3 seeds" in caveat(synthetic.study())
    assert caveat(synthetic.study(n_repetitions=20, n_seeds=20)) is None


def test_csv_files_are_the_same_every_time_and_complete():
    study = synthetic.study()
    texts = csv_files(study, make_tables(study))
    assert texts == csv_files(synthetic.study(), make_tables(synthetic.study()))
    assert tuple(texts) == CSV_FILES
    rows = {name: [*csv.DictReader(io.StringIO(text))] for name, text in texts.items()}
    assert all(None not in row and None not in row.values() for found in rows.values() for row in found)
    assert [len(rows[f"table-{number}.csv"]) for number in (1, 2, 3)] == [16, 18, 18]
    assert len(rows["runs.csv"]) == 6 * 3 * (7 * 2 + 9)
    assert rows["table-2.csv"][0] | {"low_95": "436.0", "verdict": WITHIN} == rows["table-2.csv"][0]
    episodes = [row for row in rows["episodes.csv"] if row["scenario"] == "train-1" and row["team"] == TOGETHER]
    assert [row["repetitions"] for row in episodes] == ["2"] * 31 + ["1"]


def test_the_page_is_whole_and_needs_nothing_else():
    study = synthetic.study()
    tables = make_tables(study)
    page = report_page(study, tables, {"returns": b"\x89PNG", "test-1-before": b"\x89PNG"})
    assert not re.search(r"(?:src|href)=\"(?!data:)", page)
    assert page.count("data:image/png;base64,") == 2
    for tag in ("table", "tr", "td", "span", "figure", "p", "h2"):
        assert len(re.findall(rf"<{tag}[ >]", page)) == page.count(f"</{tag}>"), tag
    for row in (*paper.TESTS.table_1, *paper.TESTS.tests):
        assert row.scenario in page
    for finding in findings(study, tables):
        assert finding.question in page
    assert "a claim about learning" in page


def test_convergence_graphs_show_every_scenario():
    for draw in (draw_returns, draw_policy_changes):
        figure = draw(synthetic.study())
        assert [panel.get_title(loc="left") for panel in figure.axes] == [row.scenario for row in paper.TESTS.table_1]
        assert len(figure.axes[0].lines) == 2 * (2 + 1) + 1
