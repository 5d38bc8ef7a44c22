"""Verify: a recording compared with a replay of itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, overload

from fireworld.recording.inputs import AnyRun, is_training, open_run, run_name
from fireworld.verified import Verified, trust_of
from fireworld.version import simulator_version

if TYPE_CHECKING:
    from fireworld_recorder.diff import RunComparison

    from fireworld.training.log.reader import TrainingLog
    from fireworld.training.log.verify import TrainingVerification


@dataclass(frozen=True, repr=False, kw_only=True)
class Verification(Verified):
    """Whether a recorded run is still what this fireworld computes; true if it is."""

    n_steps: int
    """Steps in the recording."""
    difference: RunComparison | None = None
    """How the replay differs, the recording's values as `a`; None if it does not."""

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values, as `fireworld verify --json` writes it."""
        from fireworld_recorder.totals import plain

        known = {**self.known(), "digests": [self.digest]}
        return known | ({"n_steps_compared": self.n_steps} if self.difference is None else plain(self.difference))

    def __repr__(self) -> str:
        if self.difference is None or self.difference.first is None:
            return f"{self.name}: the replay is the same, {self.n_steps} steps, digest {self.digest}"
        return f"{self.name}: the replay differs: {self.difference.first.sentence}"


@overload
def verify(log: TrainingLog, *, trust: str | None = None) -> TrainingVerification: ...
@overload
def verify(log: AnyRun, *, trust: str | None = None) -> Verification: ...
def verify(log: AnyRun | TrainingLog, *, trust: str | None = None) -> Verification | TrainingVerification:
    """Compute every step of a recording again, from its scenario, seed and decisions, and compare.

    A team that learned in the run learns again; a training is trained again, as `verify_training` does.

    Args:
        log: the path of a recording of a run or a training, or one that is open.
        trust: the digest that the recording should have, or at least its first 12 digits, from a source you trust.

    Raises:
        LogError: the recording cannot be read, or lacks its scenario.
        ArgumentError: what is trusted is no digest.
    """
    if is_training(log):
        from fireworld.training.log.verify import verify_training

        return verify_training(log, trust=trust)
    from fireworld_recorder.diff import compare

    from fireworld.recording.replay import Replay

    trusted = trust_of(trust)
    run = open_run(log)
    difference = compare(run, Replay(run))
    return Verification(
        name=run_name(run),
        digest=run.digest,
        recorded_by=simulator_version(run.header.fireworld_version, run.header.simulator_digest),
        trust=trusted,
        n_steps=len(run),
        difference=None if difference.same else difference,
    )
