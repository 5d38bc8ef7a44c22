"""The benchmark of several trainings of a method: what its table says, of few fires and of many."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.learning_fires import table_of
from benchmarks.trainings import main, row_of


def test_fires_are_drawn_anew_or_seeds_where_fires_are_few():
    runs = np.random.default_rng(1).random((3, 12, 5))
    assert table_of(runs) == pytest.approx(runs.mean(axis=2))
    assert table_of(runs[:, :9]) == pytest.approx(runs[:, :9].mean(axis=1))


def test_a_row():
    runs = np.full((4, 10, 2), 0.95)
    runs[3] = 0.75
    name, mean, worst, best, low, more = row_of("larger", runs, runs - 0.1)
    assert (name, worst, best, low) == ("larger (10)", "0.75", "0.95", "1 of 4")
    assert mean.startswith("0.900 [0.")
    assert more == "+0.100 [+0.100, +0.100]"
    assert row_of("larger", runs, runs[:1])[-1].startswith("-0.050 [")
    assert len(row_of("larger", runs, None)) == 5


def test_the_table(monkeypatch, capsys):
    monkeypatch.setattr(
        "sys.argv", ["trainings", "chief", "random", "--than", "easiest", "--suites", "tests", "--seeds", "1"]
    )
    main()
    head, _, row = capsys.readouterr().out.strip().splitlines()
    assert [cell.strip() for cell in head.strip("|").split("|")][1:] == [
        "mean of 2",
        "worst",
        "best",
        "below 0.9",
        "more than easiest",
    ]
    assert row.startswith("| tests (3) | 0.")


def test_the_stages_of_a_curriculum(here, monkeypatch, capsys):
    (here / "two.yaml").write_text(
        "stages:\n"
        "  - {name: few, cooperation: true, base: quick, each: [{fires.0.n_buildings: 2}]}\n"
        "  - {name: many, cooperation: true, base: quick, each: [{fires.0.n_buildings: 9}, {fires.0.n_buildings: 8}]}\n"
    )
    monkeypatch.setattr("sys.argv", ["trainings", "chief", "random", "--curriculum", "two.yaml", "--seeds", "2"])
    main()
    head, _, few, many = capsys.readouterr().out.strip().splitlines()
    assert head.startswith("| stage (fires) | mean of 2 |")
    assert few.startswith("| few (1) | 0.")
    assert many.startswith("| many (2) | 0.")


def test_fires_drawn_like_those_of_a_curriculum(here, monkeypatch, capsys):
    (here / "one.yaml").write_text(
        "stages: [{name: few, cooperation: true, base: quick, each: [{fires.0.n_buildings: 2}, {brigades.n: 1}]}]\n"
    )
    for than in ([], ["--than", "easiest"]):
        words = ["chief", "random", *than, "--curriculum", "one.yaml", "--drawn", "3"]
        monkeypatch.setattr("sys.argv", ["trainings", *words])
        main()
        head, _, few, both = capsys.readouterr().out.strip().splitlines()
        assert head.startswith("| stage (fires) | mean of 2 |")
        assert few.startswith("| few (3) | 0.")
        assert both == few.replace("| few", "| all"), "there is one stage"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["chief", "random", "easiest", "--than", "chief", "random"], "--than: expected 1 or 3 teams, got 2"),
        (["planner"], "planner: not a policy that kernels follow"),
    ],
)
def test_what_it_does_not_take(monkeypatch, capsys, words, message):
    monkeypatch.setattr("sys.argv", ["trainings", *words])
    with pytest.raises(SystemExit):
        main()
    assert message in capsys.readouterr().err
