"""Verify: a recording compared with a replay of itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, overload

from fireworld.recording.inputs import AnyRun, is_training, open_run, run_name

if TYPE_CHECKING:
    from fireworld_recorder.diff import RunComparison

    from fireworld.training.log.reader import TrainingLog
    from fireworld.training.log.verify import TrainingVerification


@dataclass(frozen=True, repr=False)
class Verification:
    """Whether a recorded run is still what this fireworld computes; true if it is."""

    name: str
    """The recording's file, or what was run."""
    digest: str
    """Of the recording."""
    n_steps: int
    """Steps in the recording."""
    difference: RunComparison | None
    """How the replay differs, the recording's values as `a`; None if it does not."""

    @property
    def same(self) -> bool:
        """Whether every step of the replay is what is recorded."""
        return self.difference is None

    def __bool__(self) -> bool:
        return self.same

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values, as `fireworld verify --json` writes it."""
        from fireworld_recorder.totals import plain

        known = {"same": self.same, "digests": [self.digest]}
        return known | ({"n_steps_compared": self.n_steps} if self.difference is None else plain(self.difference))

    def __repr__(self) -> str:
        if self.difference is None or self.difference.first is None:
            return f"{self.name}: the replay is the same, {self.n_steps} steps, digest {self.digest}"
        return f"{self.name}: the replay differs: {self.difference.first.sentence}"


@overload
def verify(log: TrainingLog) -> TrainingVerification: ...
@overload
def verify(log: AnyRun) -> Verification: ...
def verify(log: AnyRun | TrainingLog) -> Verification | TrainingVerification:
    """Compute every step of a recording again, from its scenario, seed and decisions, and compare.

    A team that learned in the run learns again; a training is trained again, as `verify_training` does.

    Args:
        log: the path of a recording of a run or a training, or one that is open.

    Raises:
        LogError: the recording cannot be read, or lacks its scenario.
    """
    if is_training(log):
        from fireworld.training.log.verify import verify_training

        return verify_training(log)
    from fireworld_recorder.diff import compare

    from fireworld.recording.replay import Replay

    run = open_run(log)
    difference = compare(run, Replay(run))
    return Verification(run_name(run), run.digest, len(run), None if difference.same else difference)
