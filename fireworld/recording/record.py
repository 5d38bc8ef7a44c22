"""Run a scenario and record it: the one way in which a prepared run becomes a log, a digest, or a run in memory."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fireworld_recorder.chain import Digest
from fireworld_recorder.writer import PARTIAL_SUFFIX, LogWriter

from fireworld.arguments import last_step_of, path_of, seed_of, settings_of
from fireworld.errors import PolicyError
from fireworld.files import same_folder
from fireworld.interrupt import Interrupted, gentle_interrupt
from fireworld.records import MemoryRecording, StepRecord, Steps

if TYPE_CHECKING:
    from fireworld_recorder.writer import Scene

    from fireworld.policy.protocol import Policy
    from fireworld.recording.run import Run
    from fireworld.scenario import Scenario


@dataclass(frozen=True)
class Played:
    """How far a run has come.

    Attributes:
        last: its last step.
        digest: of the run up to there.
        interrupted: Ctrl-C stopped it between two steps.
    """

    last: StepRecord
    digest: str
    interrupted: bool


def play(
    prepared: Steps,
    *,
    record: Path | None = None,
    force: bool = False,
    scene: Scene | None = None,
    on_step: Callable[[StepRecord], object] = lambda _: None,
) -> Played:
    """Run a prepared run to its end, or until Ctrl-C; every step is recorded before `on_step` sees it.

    Args:
        prepared: the run.
        record: the log to write; None: none.
        force: replace an existing log.
        scene: what the log holds besides, for other tools.
        on_step: called after each step.

    Raises:
        PolicyError: the policy failed; the steps before are in the partial log.
        Interrupted: a second Ctrl-C; likewise.
        OutputError: the log cannot be written.
    """
    last: StepRecord | None = None
    try:
        with ExitStack() as stack:
            interrupted = stack.enter_context(gentle_interrupt())
            stack.enter_context(same_folder())
            sink: LogWriter | Digest = Digest(prepared.city)
            if record is not None:
                writer = LogWriter(record, prepared.header, prepared.city, force=force, scene=scene)
                sink = stack.enter_context(writer)
            for step in prepared:
                sink.write(step)
                on_step(step)
                last = step
                if interrupted.is_set():
                    break
    except (PolicyError, KeyboardInterrupt) as error:
        where = ""
        if record is not None and last is not None:
            where = f"; steps 0 to {last.step} are kept in {record}{PARTIAL_SUFFIX}"
        if isinstance(error, PolicyError):
            raise PolicyError(f"{error}{where}") from error
        raise Interrupted(f"interrupted within a step{where}") from error
    if last is None:
        raise AssertionError("a run yields its start before anything else")
    return Played(last, sink.digest, interrupted.is_set())


def run(
    scenario: str | Path | Scenario | Mapping[str, Any],
    *,
    policy: str | Policy | type[Policy] | Callable[..., Any] = "best",
    seed: int = 1,
    steps: int | None = None,
    set: Mapping[str, Any] | None = None,
    record: str | os.PathLike[str] | None = None,
    force: bool = False,
) -> Run:
    """Run a scenario once.

    Args:
        scenario: a shipped name, a YAML file, a Scenario, or the keys and values of one.
        policy: a name as for `fireworld run --policy`, a team file, a policy, its class, or a function of the
            observation that returns an action.
        seed: of the run's random draws, from 0 to 2**32 - 1.
        steps: stop after this step; None: the scenario's.
        set: keys of the scenario with other values, as in {"brigades.n": 7}.
        record: the log to write, with every step; None keeps the steps in memory.
        force: replace an existing log.

    Returns:
        The run: its outcome, digest, and every step; after Ctrl-C KeyboardInterrupt is raised, and a log holds the
        steps that were done.

    Raises:
        ScenarioError, CityError, PolicyError, TrainingError: scenario or policy cannot be had, or the policy fails.
        OutputError: the log cannot be written.
        ArgumentError: an argument that makes no sense.
    """
    from fireworld.policy.names import find_policy
    from fireworld.scenario import find_scenario
    from fireworld.simulation.built import build_scenario
    from fireworld.simulation.prepared_run import prepare_run

    seed = seed_of(seed)
    n_steps_max = last_step_of(steps)
    path = None if record is None else path_of("record", record)
    chosen = find_scenario(scenario).with_values(settings_of(set))
    named = find_policy(policy)
    prepared = prepare_run(build_scenario(chosen), named, seed=seed, n_steps_max=n_steps_max)
    return run_prepared(prepared, record=path, force=force)


def run_prepared(prepared: Steps, *, record: Path | None = None, force: bool = False) -> Run:
    """Run a prepared run to its end and return it: from its log if there is one, else in memory.

    Args:
        prepared: the run.
        record: the log to write; None keeps the steps in memory.
        force: replace an existing log.

    Raises:
        PolicyError: the policy failed.
        Interrupted: Ctrl-C; a log holds the steps that were done.
        OutputError: the log cannot be written.
    """
    from fireworld.recording.run import Run, open_log

    records: list[StepRecord] = []
    played = play(prepared, record=record, force=force, on_step=records.append if record is None else lambda _: None)
    if played.interrupted:
        raise Interrupted(f"interrupted after step {played.last.step}")
    if record is not None:
        return open_log(record)
    return Run(MemoryRecording(prepared.header, prepared.city, records, digest=played.digest))
