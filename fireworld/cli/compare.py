"""`fireworld compare`: two policies on the same luck, with a verdict and a gate for CI."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from fireworld.cli import INTERRUPTED
from fireworld.cli.compiling import announce_compilation
from fireworld.cli.installed import check_matplotlib
from fireworld.cli.options import SEED_MAX
from fireworld.cli.progress import BAR, COUNT, DESCRIPTION, LEFT, bar
from fireworld.interrupt import gentle_interrupt

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fireworld.cli.comparison_text import Comparison
    from fireworld.evaluation.contest import Contest
    from fireworld.simulation.built import BuiltScenario

TESTS: Final = "test-1,test-2,test-3"
METRIC_NAMES: Final = ("score", "burnt-out", "time", "civilians")
SEEDS: Final = 100
UNLIMITED: Final = 10_000
EXIT_CODES: Final = {"not worse": 0, "worse": 1, "cannot tell": 3}


@click.command()
@click.argument("policy_a", metavar="POLICY_A")
@click.argument("policy_b", metavar="POLICY_B")
@click.option(
    "--scenarios", metavar="NAMES", default=TESTS, show_default=True, help="Shipped names or YAML files, with commas."
)
@click.option(
    "--seeds", "n_seeds", metavar="N", default=SEEDS, show_default=True, type=click.IntRange(1, 10_000),
    help="Runs of each policy in each scenario.",
)  # fmt: skip
@click.option(
    "--first-seed", metavar="N", default=1, show_default=True, type=click.IntRange(0, SEED_MAX),
    help="Seeds are counted from here.",
)  # fmt: skip
@click.option("--jobs", metavar="N", type=click.IntRange(1, 1000), help="Runs at a time.  [default: cores]")
@click.option("--set", "settings", metavar="KEY=VALUE", multiple=True, help="Set a key of all scenarios; repeatable.")
@click.option("--gate", is_flag=True, help="Turn the verdict into the exit code.")
@click.option("--gate-metric", type=click.Choice(METRIC_NAMES), help="What --gate and --junit judge.  [default: score]")
@click.option(
    "--margin", metavar="X", type=click.FloatRange(min=0), help="A loss up to X counts as not worse.  [default: 0]"
)
@click.option(
    "--results", metavar="FILE.parquet", type=click.Path(path_type=Path), help="Take known runs from here, and add new."
)
@click.option("--junit", metavar="FILE.xml", type=click.Path(path_type=Path), help="Write a JUnit report.")
@click.option("--plot", metavar="FILE.png", type=click.Path(path_type=Path), help="Draw every paired difference.")
@click.option("--force", is_flag=True, help="Replace existing files of --junit and --plot.")
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.pass_context
def command(
    context: click.Context,
    *,
    policy_a: str,
    policy_b: str,
    scenarios: str,
    n_seeds: int,
    first_seed: int,
    jobs: int | None,
    settings: tuple[str, ...],
    gate: bool,
    gate_metric: str | None,
    margin: float | None,
    results: Path | None,
    junit: Path | None,
    plot: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Tell whether POLICY_B, the new one, is better than POLICY_A, the reference.

    \b
    fireworld compare chief nearest-to-civilian                the three tests, 100 seeds
    fireworld compare old.npz new.npz --results runs.parquet   what is known is not run again
    fireworld compare chief my:Policy --gate --margin 0.01     for CI: exit code 1 if worse
    fireworld compare chief random --scenarios quick,own.yaml --seeds 30 --plot difference.png

    Policies are named as for `fireworld run --policy`. Both run every scenario with the same seeds, so they meet the
    same luck, and are compared run by run: score as a share of its maximum, buildings burnt out, time to complete and
    civilians alive, each with the 95 % interval of the difference B - A and the probability P that a run of B is the
    better one.

    Exit code: 0; with --gate 0 not worse (the interval does not reach below -margin), 1 worse (it lies wholly below
    zero, and reaches below -margin), 3 cannot tell; 2 could not compare; 130 interrupted (--results keeps every run
    that is done).
    """
    if not (gate or junit) and (margin is not None or gate_metric is not None):
        raise click.UsageError("--margin and --gate-metric go with --gate or --junit.")
    if margin is not None and not math.isfinite(margin):
        raise click.UsageError(f"--margin: expected a finite number, got {margin}.")
    if force and not (junit or plot):
        raise click.UsageError("--force goes with --junit or --plot.")
    if first_seed + n_seeds - 1 > SEED_MAX:
        raise click.UsageError(f"--first-seed: seeds end at {SEED_MAX}.")
    _check_outputs([path for path in (junit, plot) if path is not None], force=force, plot=plot is not None)
    announce_compilation()
    contest = _prepare(
        (policy_a, policy_b),
        scenarios,
        settings,
        seeds=range(first_seed, first_seed + n_seeds),
        results=results,
        jobs=jobs or os.cpu_count() or 1,
    )
    if not _carry_out(contest):
        context.exit(INTERRUPTED)
    found = _compare(contest, metric=gate_metric or METRIC_NAMES[0], margin=margin or 0.0)
    _write(found, junit=junit, plot=plot, force=force)
    _show(found, gate=gate, as_json=as_json)
    context.exit(EXIT_CODES[found.gate.judgement] if gate else 0)


def _check_outputs(paths: Sequence[Path], *, force: bool, plot: bool) -> None:
    """See that everything can be written, before any run.

    Raises:
        OutputError: a file exists, or its folder does not.
        ViewError: matplotlib is not installed.
    """
    from fireworld.errors import OutputError

    for path in paths:
        if path.exists() and not force:
            raise OutputError(f"{path}: exists already; try --force")
        if path.is_dir() or not path.parent.is_dir():
            raise OutputError(f"{path}: cannot be written: {'is a folder' if path.is_dir() else 'no such folder'}")
    if plot:
        check_matplotlib("--plot")


def _prepare(
    policies: tuple[str, str],
    scenarios: str,
    settings: Sequence[str],
    *,
    seeds: range,
    results: Path | None,
    jobs: int,
) -> Contest:
    """Find policies, scenarios and earlier results."""
    from fireworld.evaluation.contest import Contest, enter
    from fireworld.evaluation.results import open_archive
    from fireworld.policy.names import note_on_team

    contestants = enter(policies[0]), enter(policies[1])
    archive = open_archive(results)
    stages = _build_scenarios(scenarios, settings)
    said = {
        note_on_team(contestant.named, built.scenario.brigades.n, choices=built.scenario.choices): None
        for contestant in contestants
        for built in stages.values()
    }
    for note in filter(None, said):
        click.echo(note, err=True)
    return Contest(stages=stages, contestants=contestants, seeds=seeds, archive=archive, jobs=jobs)


def _build_scenarios(names: str, settings: Sequence[str]) -> dict[str, BuiltScenario]:
    """Build the scenarios, each once.

    Raises:
        ScenarioError: one of them cannot be read or built, or comes twice.
    """
    from fireworld.errors import ScenarioError, expected
    from fireworld.scenario import load_scenario, split_settings
    from fireworld.simulation.built import CityCache

    values = split_settings(settings)
    cities = CityCache()
    stages: dict[str, BuiltScenario] = {}
    seen: dict[str, str] = {}
    for name in (part.strip() for part in names.split(",")):
        scenario = load_scenario(name).with_settings(values)
        if scenario.digest in seen:
            got = f"{name} a second time" if name in stages else f"{name}, which is the same as {seen[scenario.digest]}"
            raise ScenarioError(expected("--scenarios", "", "each scenario once", got))
        seen[scenario.digest] = name
        stages[name] = cities.build(scenario)
    return stages


def _carry_out(contest: Contest) -> bool:
    """Make the runs that are missing, under a bar where people watch; False if interrupted."""
    path, n_missing = contest.archive.path, sum(map(len, contest.missing()))
    if n_missing < contest.n_runs:
        click.echo(f"{contest.n_runs - n_missing} of {contest.n_runs} runs are known from {path}", err=True)
    kept = f"they are kept in {path}" if path is not None else "with --results they would have been kept"
    n_done, how = 0, "interrupted"
    try:
        with gentle_interrupt() as interrupted, bar("runs", n_missing, DESCRIPTION, BAR, COUNT, LEFT) as advance:

            def on_run() -> None:
                nonlocal n_done
                n_done += 1
                advance()

            if contest.carry_out(interrupted, on_run):
                return True
    except KeyboardInterrupt:
        how = "interrupted within a run"
    click.echo(f"{how}; {n_done} of {n_missing} runs were done: {kept}", err=True)
    return False


def _compare(contest: Contest, *, metric: str, margin: float) -> Comparison:
    from fireworld.cli.comparison_text import Comparison, Gate
    from fireworld.evaluation.paired import compare_outcomes, judge, over_all
    from fireworld.evaluation.results import simulator_version

    a, b = contest.contestants
    pairings = compare_outcomes(contest.outcomes(a), contest.outcomes(b), same_policy=contest.same_policy)
    return Comparison(
        policies=(a.text, b.text),
        digests=(a.identity, b.identity),
        scenarios=[(name, built.scenario.digest) for name, built in contest.stages.items()],
        seeds=contest.seeds,
        version=simulator_version(),
        same_policy=contest.same_policy,
        pairings=pairings,
        gate=Gate(metric, margin, judge(over_all(pairings, metric), margin=margin)),
    )


def _write(found: Comparison, *, junit: Path | None, plot: Path | None, force: bool) -> None:
    """Write the files that were asked for.

    Raises:
        OutputError: one of them cannot be written.
    """
    if junit is not None:
        from fireworld.cli.comparison_text import junit as to_junit
        from fireworld.files import write_file

        write_file(junit, to_junit(found))
    if plot is not None:
        from fireworld_viewer.pictures.figure_files import save_figure

        from fireworld.cli.comparison_text import scopes
        from fireworld.evaluation.figures import draw_differences

        title = f"{found.policies[1]} (B) against {found.policies[0]} (A), {len(found.seeds)} seeds"
        save_figure(draw_differences(scopes(found), title=title), plot, force=force)


def _show(found: Comparison, *, gate: bool, as_json: bool) -> None:
    from rich.console import Console

    from fireworld.cli import comparison_text as text

    if as_json:
        click.echo(json.dumps(text.as_json(found, gated=gate), indent=2))
        return
    table = text.table(found)
    natural = Console(width=UNLIMITED).measure(table).maximum
    Console(highlight=False, width=max(Console().width, natural)).print(table)  # no figure is ever cut off
    for note in text.notes(found):
        click.echo(note)
    click.echo(text.sentence(found))
    if gate:
        click.echo(text.gate_line(found))
