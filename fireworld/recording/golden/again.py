"""A run for a golden: whoever decides in it does nothing else."""

from __future__ import annotations

from fireworld_recorder.diff import compare

from fireworld.policy.asking import changed_its_world, is_ours
from fireworld.recording.record import run_prepared
from fireworld.recording.replay import Replay
from fireworld.recording.run import Run
from fireworld.simulation.prepared_run import PreparedRun


def run_again(prepared: PreparedRun) -> Run:
    """Run what is recorded as a golden, or compared with one.

    A run by a user's policy is computed once more from its decisions alone, in a world that the policy has not seen.

    Raises:
        PolicyError: the policy failed, or it did more than decide.
        Interrupted: Ctrl-C.
    """
    run = run_prepared(prepared)
    if not is_ours(prepared.policy) and not compare(run, Replay(run)).same:
        raise changed_its_world(prepared.policy, run.header.seed)
    return run
