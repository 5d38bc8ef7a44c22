"""`fireworld fork`: go on from a step of a recording with another decision or policy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from fireworld.cli import INTERRUPTED
from fireworld.cli.compiling import announce_compilation
from fireworld.cli.options import record_options
from fireworld.cli.replays import check_replay

if TYPE_CHECKING:
    from fireworld_recorder.reader import Log

    from fireworld.policy.names import NamedPolicy
    from fireworld.policy.protocol import Decision
    from fireworld.recording.fork import Change, Swap
    from fireworld.records import MemoryRecording

RECORDED: Final = "recorded"
"""Names the policy that decides as is recorded, whatever happens."""


@click.command()
@click.argument("log", metavar="LOG", type=click.Path(path_type=Path))
@click.option("--at", "step", required=True, metavar="STEP", type=click.IntRange(min=0), help="Go on after this step.")
@click.option(
    "--policy",
    metavar="POLICY",
    help="Who goes on: a policy as for `fireworld run`, which begins anew here, or `recorded`: the decisions recorded "
    "in LOG, whatever happens.  [default: LOG's policy, which remembers what it saw]",
)
@click.option(
    "--decide",
    "decided",
    metavar="BRIGADE=ACTION",
    multiple=True,
    help="What a brigade does in step STEP+1, unasked: one of the four actions, or own-target:BUILDING, a burning "
    "building of its fire site; repeatable.",
)
@click.option(
    "--swap",
    "swapped",
    metavar="OTHER:BRIGADE",
    multiple=True,
    help="From step STEP+1 on that brigade does what it did in the recording OTHER, of the same scenario and seed; "
    "repeatable.",
)
@record_options
@click.option("--json", "as_json", is_flag=True, help="Write the outcome as JSON.")
@click.pass_context
def command(
    context: click.Context,
    *,
    log: Path,
    step: int,
    policy: str | None,
    decided: tuple[str, ...],
    swapped: tuple[str, ...],
    output: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Take the recorded run LOG up again after STEP, let something be otherwise, and show how it ends then.

    \b
    fireworld fork a.mcap --at 14 --decide 2=nearest-to-me --record b.mcap
    fireworld fork a.mcap --at 14 --decide 2=own-target:301 --record b.mcap
    fireworld fork a.mcap --at 14 --policy planner --record b.mcap
    fireworld fork a.mcap --at 14 --swap other.mcap:2 --record b.mcap
    fireworld diff a.mcap b.mcap

    The steps up to STEP are copied, and those from the last snapshot before it are computed again and compared. What
    comes after is decided anew: once a decision is another, so is the world, and what is recorded no longer answers
    it. So the policy is asked, the luck stays the same. If nothing is changed the fork is the same as LOG, to the bit.

    A swapped brigade that may choose where it had no choice in OTHER (it refilled there, or OTHER has ended) goes on
    with what it last did there.

    Exit code: 0 forked, 2 could not fork (among others: LOG does not replay to what is recorded), 130 interrupted (the
    recording keeps every step done).
    """
    if force and output is None:
        raise click.UsageError("--force goes with --record.")
    announce_compilation()
    from fireworld_recorder.reader import open_log

    from fireworld.cli.run import carry_out, outcome_of, show_outcome
    from fireworld.policy.asking import begin
    from fireworld.policy.names import note_on_team
    from fireworld.recording.fork import Change, prepare_fork
    from fireworld.recording.replay import build_recorded
    from fireworld.recording.resume import has_memory, resume

    original = open_log(log)
    beginning = recorded_up_to(original, step)
    named = _policy(original, policy)
    change = Change(named, decided=_decided(decided, original), swaps=_swaps(swapped))
    _check_told_once(change)
    remembering = named if policy is None and has_memory(named.policy) else None
    stage = build_recorded(original.header)
    resumed = resume(stage, beginning, source=str(log), remembering=remembering)
    check_replay(resumed.recorded, resumed.replayed, source=str(log))
    if remembering is None:
        begin(named.policy, resumed.world.city_arrays, n_brigades=resumed.world.n_brigades, seed=original.header.seed)
    run = prepare_fork(resumed, change, original, list(beginning), digest=original.digest, source=str(log))
    note = note_on_team(named, resumed.world.n_brigades, choices=stage.scenario.choices)
    if note:
        click.echo(note, err=True)
    last, digest = carry_out(run, output=output, force=force, quiet=as_json)
    outcome = outcome_of(run, last, digest=digest, output=output)
    before = original.step(int(original.steps[-1])).score.score
    if as_json:
        click.echo(
            json.dumps({**outcome, "forked_from": run.header.forked_from, "score_of_original": before}, indent=2)
        )
    else:
        show_outcome(outcome)
        same = "; the same run" if digest == original.digest else f", where the score was {before:.3f}"
        click.echo(f"forked from {log} after step {step}{same}")
    context.exit(INTERRUPTED if outcome["ended"] == "interrupted" else 0)


def recorded_up_to(log: Log, step: int) -> MemoryRecording:
    """Read the steps of a log up to one of them.

    Raises:
        LogError: the log has no such step.
    """
    from itertools import takewhile

    from fireworld.errors import LogError, expected
    from fireworld.records import MemoryRecording

    if step not in log.steps:
        held = f"a step of {log.path}, {log.steps[0]} to {log.steps[-1]}" if len(log) else f"steps in {log.path}"
        raise LogError(expected("--at", "", held, step if len(log) else "none"))
    return MemoryRecording(log.header, log.city, [*takewhile(lambda record: record.step <= step, log)])


def _policy(log: Log, name: str | None) -> NamedPolicy:
    """Return who goes on."""
    from fireworld.policy.names import NamedPolicy, find_policy
    from fireworld.recording.decisions import RecordedDecisions
    from fireworld.recording.resume import recorded_policy

    if RECORDED in {name, log.header.policy if name is None else None}:
        return NamedPolicy(RECORDED, log.digest, RecordedDecisions(log))
    return find_policy(name) if name is not None else recorded_policy(log.header, source=str(log.path))


def _decided(texts: tuple[str, ...], log: Log) -> dict[int, Decision]:
    """Read BRIGADE=ACTION, and BRIGADE=own-target:BUILDING.

    Raises:
        PolicyError: there is no such action or building, or a building where none belongs.
    """
    decided: dict[int, Decision] = {}
    for text in texts:
        number, _, order = text.partition("=")
        if not (number.isascii() and number.isdecimal() and order):
            raise click.UsageError(f"--decide: expected BRIGADE=ACTION as in 2=nearest-to-me, got {text!r}")
        if int(number) in decided:
            raise click.UsageError(f"--decide: expected one action for brigade {int(number)}, got two")
        decided[int(number)] = _decision(number, order, log)
    return decided


def _decision(number: str, order: str, log: Log) -> Decision:
    from difflib import get_close_matches

    from fireworld.errors import PolicyError, expected
    from fireworld.policy.protocol import Action, Decision
    from fireworld.records import ACTION_NAMES

    name, colon, building = order.partition(":")
    if name not in ACTION_NAMES:
        near = [one for one in ACTION_NAMES if name in one] or get_close_matches(name, ACTION_NAMES, n=1)
        hint = "try " + " or ".join(near) if near else ""
        raise PolicyError(expected("--decide", number, "one of " + ", ".join(ACTION_NAMES), name, hint))
    action = Action(ACTION_NAMES.index(name))
    if action != Action.OWN_TARGET:
        if colon:
            hint = "a brigade goes for a building with own-target:BUILDING"
            raise PolicyError(expected("--decide", number, f"{name} without a building", order, hint))
        return Decision(action)
    if not (building.isascii() and building.isdecimal()):
        raise PolicyError(expected("--decide", number, f"a building behind {name}, as in {name}:301", order))
    ids = log.city.building_id.tolist()
    if int(building) not in ids:
        wanted = f"the id of a building of {log.path}, {min(ids)} to {max(ids)}"
        raise PolicyError(expected("--decide", number, wanted, order))
    return Decision(action, target=ids.index(int(building)))


def _swaps(texts: tuple[str, ...]) -> list[Swap]:
    """Read OTHER:BRIGADE and the recordings it names."""
    from fireworld_recorder.reader import open_log

    from fireworld.recording.decisions import RecordedDecisions
    from fireworld.recording.fork import Swap

    logs: dict[str, tuple[Log, RecordedDecisions]] = {}
    swaps: list[Swap] = []
    for text in texts:
        path, _, number = text.rpartition(":")
        if not (path and number.isascii() and number.isdecimal()):
            raise click.UsageError(f"--swap: expected OTHER:BRIGADE as in other.mcap:2, got {text!r}")
        if path not in logs:
            other = open_log(path)
            logs[path] = other, RecordedDecisions(other)
        other, decisions = logs[path]
        swaps.append(Swap(int(number), name=path, digest=other.digest, header=other.header, decisions=decisions))
    return swaps


def _check_told_once(change: Change) -> None:
    """Refuse two orders for one brigade."""
    brigades = [*change.decided, *(swap.brigade for swap in change.swaps)]
    for brigade in brigades:
        if brigades.count(brigade) > 1:
            raise click.UsageError(f"--decide, --swap: expected one of them for brigade {brigade}, once")
