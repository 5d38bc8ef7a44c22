"""How teams that learned fare on fires that they never saw: every experiment of docs/science.md, failures included.

`python benchmarks/learning.py` trains and tests everything, hours of computing; what is done is kept in the folder that
`--keep` names, so that it can be interrupted and goes on. `--quick` is a small one to see how it works, a minute or
two; nothing can be claimed from it. `--write` renews docs/science.md and the figures beside it.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import click
import numpy as np

ROOT: Final = Path(__file__).parents[1]
if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))  # to be called by its path

from benchmarks.learning_fires import Fires, fires_by_group, shares, table_of  # noqa: E402
from benchmarks.learning_teams import FULL, QUICK, Contestant, Trained, contestants  # noqa: E402
from fireworld.cli.options import executor_of, on_option  # noqa: E402
from fireworld.evaluation.statistics import Estimate, estimate, paired_difference  # noqa: E402
from fireworld.executors import AnyExecutor  # noqa: E402
from fireworld.kernels.arrays import Array  # noqa: E402
from fireworld.simulation.built import CityCache  # noqa: E402

RESULTS: Final = ROOT / "docs" / "science.json"
PAGE: Final = ROOT / "docs" / "science.md"
FIRST_SEED: Final = 1001
BEST: Final = "own-cooperative"
PAIRS: Final = (
    *((BEST, rule) for rule in ("easiest", "nearest-to-civilian", "nearest-to-center", "nearest-to-me")),
    *((BEST, rule) for rule in ("each-another", "random", "chief", "best-joint", "own-alone", "own-half-cooperative")),
    ("own-half-cooperative", "own-half-alone"),
    ("own-half-cooperative", "named-cooperative"),
    ("named-cooperative", "best-joint"),
    ("named-cooperative", "nearest-to-civilian"),
    ("named-cooperative", "named-alone"),
    ("linear-4320", "linear-270"),
    ("paper-cooperative", "paper-noncooperative"),
)
"""Whose scores are compared, run by run."""


@dataclass(frozen=True)
class Scores:
    """Scores of a contestant on a group of fires."""

    shares: Array  # (trainings, fires, seeds)

    @property
    def table(self) -> Array:
        """(trainings, units): units are the fires, or the seeds where there are few fires."""
        return table_of(self.shares)


def measure(
    contestant: Contestant, fires: Fires, seeds: range, folder: Path, executor: AnyExecutor = None
) -> dict[str, Scores]:
    """Train and test a contestant, or fetch what was measured before."""
    found = {}
    if isinstance(contestant.make, Trained):
        contestant.make.prepare(range(1, contestant.n + 1))
    for group, stages in fires.items():
        path = folder / f"{contestant.name}-{group}.npy"
        if not path.exists():
            n_seeds = None if group == "tests" else contestant.n_seeds
            teams = [contestant.make(number, group) for number in range(1, contestant.n + 1)]
            np.save(path, np.array([shares(stages, team, seeds[:n_seeds], executor) for team in teams]))
        found[group] = Scores(np.load(path))
    return found


def summary(measured: dict[str, dict[str, Scores]], all_teams: list[Contestant]) -> dict[str, object]:
    """Put everything that the page says into plain values."""

    def plain(one: Estimate) -> dict[str, float]:
        return {key: round(asdict(one)[key], 4) for key in ("mean", "low", "high")}

    teams = [
        {
            "name": team.name,
            "what": team.what,
            "n_trainings": team.n,
            **{group: plain(estimate(scores.table)) for group, scores in measured[team.name].items()},
        }
        for team in all_teams
    ]
    differences = []
    for name, other in PAIRS:
        entry: dict[str, object] = {"team": name, "than": other}
        for group, scores in measured[name].items():
            rival = measured[other][group]
            n_seeds = min(scores.shares.shape[2], rival.shares.shape[2])
            a, b = (Scores(one.shares[:, :, :n_seeds]).table for one in (scores, rival))
            n = min(len(a), len(b)) if len(b) > 1 else len(a)
            entry[group] = plain(paired_difference(a[:n], b[:n]))
        differences.append(entry)
    n_fires = {group: scores.shares.shape[1] for group, scores in measured[BEST].items()}
    n_seeds_all = measured[BEST]["tests"].shares.shape[2]
    return {"n_fires": n_fires, "n_seeds": n_seeds_all, "teams": teams, "differences": differences}


def tables(results: dict[str, object]) -> str:
    """Write the results as the tables of the page."""
    groups = list(results["n_fires"])  # type: ignore[call-overload]
    heads = [f"{group} ({results['n_fires'][group]} fires)" for group in groups]  # type: ignore[index]

    def cell(one: dict[str, float]) -> str:
        return f"{one['mean']:.3f} [{one['low']:.3f}, {one['high']:.3f}]"

    lines = ["| team | what it is | trainings | " + " | ".join(heads) + " |", "|---|---|---|" + "---|" * len(groups)]
    for team in results["teams"]:  # type: ignore[attr-defined]
        cells = " | ".join(cell(team[group]) for group in groups)
        lines.append(f"| {team['name']} | {team['what']} | {team['n_trainings']} | {cells} |")
    lines += ["", "| difference, run by run | " + " | ".join(heads) + " |", "|---|" + "---|" * len(groups)]
    for entry in results["differences"]:  # type: ignore[attr-defined]
        cells = " | ".join(cell(entry[group]) for group in groups)
        lines.append(f"| {entry['team']} - {entry['than']} | {cells} |")
    return "\n".join(lines) + "\n"


BEGIN, END = "<!-- tables: made by benchmarks/learning.py -->\n", "<!-- end of tables -->\n"


def page_with(text: str, made: str) -> str:
    """Put tables into the page between its two marks."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return before + BEGIN + "\n" + made + "\n" + END + after


@click.command(help=__doc__)
@click.option("--quick", is_flag=True, help="Small trainings, few fires and seeds.")
@click.option(
    "--keep", metavar="DIR", type=click.Path(path_type=Path), help="Keep teams and scores here, and go on from them."
)
@click.option("--write", is_flag=True, help="Renew docs/science.md.")
@click.option("--only", metavar="NAME", multiple=True, help="Train and test these alone; no tables.")
@click.option("--jobs", metavar="N", type=click.IntRange(1, 1000), help="Trainings or runs at a time.  [default: 2]")
@on_option
def main(
    *, quick: bool, keep: Path | None, write: bool, only: tuple[str, ...], jobs: int | None, on: str | None
) -> None:
    """Run the experiments."""
    if write and quick:
        raise click.UsageError("--write: a quick run has nothing to say.")
    with TemporaryDirectory() as passing:
        folder = keep or Path(passing)
        (folder / "teams").mkdir(parents=True, exist_ok=True)
        (folder / "scores").mkdir(exist_ok=True)
        cities, executor = CityCache(), executor_of(on, jobs)
        fires = fires_by_group(cities, n_fires=4 if quick else None)
        seeds = range(FIRST_SEED, FIRST_SEED + (2 if quick else 20))
        teams = contestants(QUICK if quick else FULL, fires, folder / "teams", cities, executor)
        measured = {}
        for team in teams:
            if only and team.name not in only:
                continue
            measured[team.name] = measure(team, fires, seeds, folder / "scores", executor)
            means = ", ".join(f"{group} {scores.shares.mean():.3f}" for group, scores in measured[team.name].items())
            click.echo(f"{team.name}: {means}", err=True)
    if only:
        return
    results = summary(measured, teams)
    click.echo(tables(results))
    if write:
        RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
        PAGE.write_text(page_with(PAGE.read_text(encoding="utf-8"), tables(results)), encoding="utf-8")


if __name__ == "__main__":
    main()
