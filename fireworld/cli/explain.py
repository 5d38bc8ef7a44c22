"""`fireworld explain`: say which decisions make the difference between two recordings."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from fireworld.cli import INTERRUPTED
from fireworld.cli.compiling import announce_compilation
from fireworld.cli.explanation_text import Pair, as_json_content, own_targets, show
from fireworld.cli.progress import BAR, ELAPSED, bar
from fireworld.cli.replays import check_replay
from fireworld.interrupt import gentle_interrupt

if TYPE_CHECKING:
    from fireworld_recorder.reader import Log

    from fireworld.executors import Workers
    from fireworld.recording.explanation.search import ScoreAll
    from fireworld.recording.explanation.stretches import Stretch
    from fireworld.recording.explanation.worse_run import MakePolicy, WorseRun

BUDGET: Final = 200
SHOWN_MAX: Final = 20
N_THREADS: Final = 2
REPLAYS: Final = "replay {task.completed:.0f} of at most {task.total:.0f}"


@click.command()
@click.argument("first", metavar="A", type=click.Path(path_type=Path))
@click.argument("second", metavar="B", type=click.Path(path_type=Path))
@click.option(
    "--budget", default=BUDGET, show_default=True, metavar="N", type=click.IntRange(min=2), help="Replays at most."
)
@click.option(
    "--limit",
    default=SHOWN_MAX,
    show_default=True,
    metavar="N",
    type=click.IntRange(min=1),
    help="List N stretches at most.",
)
@click.option("--json", "as_json", is_flag=True, help="Write JSON, with all stretches.")
@click.pass_context
def command(context: click.Context, *, first: Path, second: Path, budget: int, limit: int, as_json: bool) -> None:
    """Say which decisions make up how much of the difference between the scores of recordings A and B.

    \b
    fireworld explain a.mcap b.mcap
    fireworld explain a.mcap b.mcap --budget 1000 --json

    A and B are runs of one scenario and seed. The run with the lower score is replayed, each time with one stretch of
    the other's decisions in it: steps in which one brigade took one action there and others here. After the stretch
    the brigades' own policy goes on, in a world that is another by then. Then all stretches are tried at once, then
    all but one, and those that explain most are narrowed down to the part that matters. The earliest stretches come
    first where the budget does not suffice for all.

    If the policy cannot be loaded again, what was recorded goes on instead; the answer says which.

    Exit code: 0 explained, or the scores are equal; 2 could not explain (another scenario or seed, a run that has not
    ended, a recording that does not replay); 130 interrupted (what is known so far is shown).
    """
    announce_compilation()
    from fireworld.executors import Workers
    from fireworld.recording.decisions import RecordedDecisions
    from fireworld.recording.explanation.search import explain
    from fireworld.recording.explanation.stretches import find_stretches
    from fireworld.recording.explanation.worse_run import prepare_worse_run
    from fireworld.recording.replay import build_recorded

    pair = _open_pair(first, second)
    if pair.worse_score == pair.better_score:
        _say_equal(pair, as_json=as_json)
        return
    _check_replays(pair)
    make_policy, why_recorded = _policy_of(pair.worse)
    better = RecordedDecisions(pair.better)
    run = prepare_worse_run(build_recorded(pair.worse.header), pair.worse, better, make_policy)
    stretches = find_stretches(run.recorded, better, n_brigades=run.n_brigades)
    with gentle_interrupt() as interrupted, bar("explain", budget, REPLAYS, BAR, ELAPSED) as advance:
        workers = Workers(N_THREADS if run.compiled else 1, interrupted)
        explanation = explain(
            stretches,
            worse_score=pair.worse_score,
            better_score=pair.better_score,
            budget=budget,
            score_all=_score_all(run, workers, advance),
        )
    targets = own_targets(pair, better)
    if as_json:
        known = as_json_content(
            pair, explanation, targets=targets, why_recorded=why_recorded, interrupted=interrupted.is_set()
        )
        click.echo(json.dumps(known, indent=2))
    else:
        show(pair, explanation, targets=targets, why_recorded=why_recorded, limit=limit)
    if interrupted.is_set():
        click.echo(f"interrupted after {explanation.n_replays} replays; more may be found", err=True)
        context.exit(INTERRUPTED)


def _open_pair(first: Path, second: Path) -> Pair:
    """Open two recordings that can be compared; of two equal ones the first counts as the worse."""
    from fireworld_recorder.reader import open_log

    from fireworld.recording.explanation.worse_run import check_comparable

    logs = open_log(first), open_log(second)
    lasts = [log.step(int(log.steps[-1])) if len(log) else None for log in logs]
    check_comparable((logs[0].header, logs[1].header), lasts, names=(str(first), str(second)))
    scores = [last.score.score for last in lasts if last is not None]
    worse = 0 if scores[0] <= scores[1] else 1
    return Pair(logs[worse], logs[1 - worse], worse_score=scores[worse], better_score=scores[1 - worse])


def _say_equal(pair: Pair, *, as_json: bool) -> None:
    if as_json:
        click.echo(json.dumps({"score": pair.worse_score, "difference": 0.0, "stretches": []}, indent=2))
    else:
        click.echo(f"both runs have the score {pair.worse_score:.6g}: there is no difference to explain")


def _check_replays(pair: Pair) -> None:
    """See that both runs are still what this simulator computes.

    Raises:
        LogError: one is not; names the first step.
    """
    from fireworld.recording.replay import Replay

    for log in (pair.worse, pair.better):
        check_replay(log, Replay(log), source=str(log.path))


def _policy_of(log: Log) -> tuple[MakePolicy | None, str]:
    """Return what makes the policy of a recording anew, or why that cannot be."""
    from fireworld.cli.fork import RECORDED
    from fireworld.errors import FireworldError
    from fireworld.recording.resume import recorded_policy

    if log.header.policy == RECORDED:
        return None, f"{log.path} is a fork in which recorded decisions went on"
    load = partial(recorded_policy, log.header, source=str(log.path))
    try:
        load()
    except FireworldError as error:
        return None, str(error).partition("; ")[0]
    return lambda: load().policy, ""


def _score_all(run: WorseRun, workers: Workers, advance: Callable[[], object]) -> ScoreAll:
    """Do replays at a time, until somebody interrupts."""

    def score_all(told: Sequence[Sequence[Stretch]]) -> list[float | None]:
        scores: list[float | None] = [None] * len(told)

        def keep(number: int, score: float) -> None:
            scores[number] = score
            advance()

        if not workers.stop.is_set():
            workers.run([partial(run.score, stretches) for stretches in told], keep)
        return scores

    return score_all
