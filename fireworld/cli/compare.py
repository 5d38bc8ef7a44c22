"""`fireworld compare`: is a policy better than another, with a verdict and a gate for CI."""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path
from typing import Final

import click

from fireworld.cli.compiling import announce_compilation
from fireworld.cli.installed import check_matplotlib
from fireworld.cli.options import executor_of, first_seed_option, jobs_option, on_option
from fireworld.cli.progress import runs_bar
from fireworld.cli.reporting import check_reporting, print_annotations, reporting_options
from fireworld.outcome import METRICS

TESTS: Final = "test-1,test-2,test-3"
EXIT_CODES: Final = {"not worse": 0, "worse": 1, "cannot tell": 3}


@click.command()
@click.argument("policy_a", metavar="POLICY_A")
@click.argument("policy_b", metavar="POLICY_B")
@click.option(
    "--scenarios",
    metavar="NAMES",
    default=TESTS,
    show_default=True,
    help="Scenarios, suites or YAML files, with commas.",
)
@click.option(
    "--seeds", "n_seeds", metavar="N", default=100, show_default=True, type=click.IntRange(1, 10_000),
    help="Runs of each policy in each scenario.",
)  # fmt: skip
@first_seed_option(1)
@jobs_option
@on_option
@click.option("--set", "settings", metavar="KEY=VALUE", multiple=True, help="Set a key of all scenarios; repeatable.")
@click.option("--gate", is_flag=True, help="Turn the verdict into the exit code.")
@click.option(
    "--gate-metric", type=click.Choice([metric.name for metric in METRICS]),
    help="What is judged.  [default: score]",
)  # fmt: skip
@click.option(
    "--margin", metavar="X", type=click.FloatRange(min=0), help="A loss up to X counts as not worse.  [default: 0]"
)
@click.option(
    "--results", metavar="FILE.parquet", type=click.Path(path_type=Path), help="Take known runs from here, and add new."
)
@click.option("--junit", metavar="FILE.xml", type=click.Path(path_type=Path), help="Write a JUnit report.")
@click.option("--plot", metavar="FILE.png", type=click.Path(path_type=Path), help="Draw every paired difference.")
@reporting_options
@click.option("--force", is_flag=True, help="Replace existing files.")
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
    on: str | None,
    settings: tuple[str, ...],
    gate: bool,
    gate_metric: str | None,
    margin: float | None,
    results: Path | None,
    junit: Path | None,
    plot: Path | None,
    summary: Path | None,
    annotate: str | None,
    force: bool,
    as_json: bool,
) -> None:
    """Compare POLICY_B, the new one, with POLICY_A, the reference: is it better?

    \b
    fireworld compare chief nearest-to-civilian                the three tests, 100 seeds
    fireworld compare old.npz new.npz --results runs.parquet   what is known is not run again
    fireworld compare chief my:Policy --gate --margin 0.01     for CI: exit code 1 if worse
    fireworld compare chief random --scenarios quick,own.yaml --seeds 30 --plot difference.png
    fireworld compare chief my:Policy --scenarios contested,larger --seeds 20   suites: a row each
    fireworld compare chief my:Policy --on dask://head:8786    on a cluster

    Policies are named as for `fireworld run --policy`. Both run every scenario with the same seeds, so they see the
    same random draws (common random numbers), and are compared run by run: score as a share of its maximum, buildings
    burnt out, time to complete and civilians alive, each with the 95 % interval of the difference B - A and the
    probability P that a run of B is the better one.

    Exit code: 0; with --gate 0 not worse (the interval does not reach below -margin), 1 worse (it lies wholly below
    zero, and reaches below -margin), 3 cannot tell; 2 could not compare; 130 interrupted (--results keeps every run
    that is done).
    """
    check_reporting(annotate=annotate, as_json=as_json)
    if not (gate or junit or summary or annotate) and (margin is not None or gate_metric is not None):
        raise click.UsageError("--margin and --gate-metric go with --gate, --junit, --summary or --annotate.")
    if force and not (junit or plot or summary):
        raise click.UsageError("--force goes with --junit, --plot or --summary.")
    from fireworld.evaluation.compare import compare
    from fireworld.executors import n_cores
    from fireworld.files import check_output, check_outputs, written_beside
    from fireworld.scenario import split_settings
    from fireworld.scenario.yaml_text import read_yaml

    check_outputs([path for path in (junit, plot, summary) if path is not None], force=force)
    if plot:
        check_output(plot, force=force, endings=(".png", ".svg", ".pdf"))
        check_matplotlib("--plot")
    announce_compilation()
    with runs_bar(results) as on_run:
        comparison = compare(
            [policy_a, policy_b],
            scenarios=[name.strip() for name in scenarios.split(",")],
            seeds=n_seeds,
            first_seed=first_seed,
            set={key: read_yaml(text, source=f"--set {key}") for key, text in split_settings(settings).items()},
            executor=executor_of(on, jobs) or n_cores(),
            results=results,
            metric=gate_metric or METRICS[0].name,
            margin=margin or 0.0,
            on_run=on_run,
        )
    for warning in comparison.warnings:
        click.echo(warning, err=True)
    with ExitStack() as both:  # or none
        if junit is not None:
            both.enter_context(written_beside(junit)).write_bytes(comparison.junit())
        if plot is not None:
            comparison.save_figure(plot, force=force)
        if summary is not None:
            comparison.save_summary(summary, force=force)
    if as_json:
        click.echo(json.dumps(comparison.to_dict(gate=gate), indent=2))
    else:
        click.echo("\n".join([repr(comparison), comparison.sentence, *([comparison.gate] if gate else [])]))
    if annotate:
        print_annotations(comparison.findings(), cannot="warning")
    context.exit(EXIT_CODES[comparison.judgement] if gate else 0)
