"""Run a scenario and record it: the one way in which a prepared run becomes a log, a digest, or a run in memory."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

from fireworld_recorder.chain import Digest
from fireworld_recorder.writer import PARTIAL_SUFFIX, LogWriter

from fireworld.errors import PolicyError
from fireworld.interrupt import Interrupted, gentle_interrupt
from fireworld.records import StepRecord, Steps

if TYPE_CHECKING:
    from fireworld_recorder.writer import Scene


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
    stop: Event | None = None,
) -> Played:
    """Run a prepared run to its end, or until Ctrl-C; every step is recorded before `on_step` sees it.

    Args:
        prepared: the run.
        record: the log to write; None: none.
        force: replace an existing log.
        scene: what the log holds besides, for other tools.
        on_step: called after each step.
        stop: set it, and the run ends after the step under way.

    Raises:
        PolicyError: the policy failed; the steps before are in the partial log.
        Interrupted: a second Ctrl-C; likewise.
        OutputError: the log cannot be written.
    """
    last: StepRecord | None = None
    try:
        with ExitStack() as stack:
            interrupted = stack.enter_context(gentle_interrupt())
            sink: LogWriter | Digest = Digest(prepared.city)
            if record is not None:
                writer = LogWriter(record, prepared.header, prepared.city, force=force, scene=scene)
                sink = stack.enter_context(writer)
            for step in prepared:
                sink.write(step)
                on_step(step)
                last = step
                if interrupted.is_set() or (stop is not None and stop.is_set()):
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
