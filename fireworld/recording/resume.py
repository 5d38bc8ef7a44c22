"""Resume: the world of a recorded run as it was after one of its steps, and the policy of the run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fireworld.errors import FireworldError, LogError, PolicyError, expected
from fireworld.policy.asking import begin
from fireworld.policy.names import TEAM_ATTACHMENT, NamedPolicy, find_policy
from fireworld.policy.protocol import Policy
from fireworld.policy.teams.team import parse_team
from fireworld.recording.decisions import RecordedDecisions, ShadowPolicy
from fireworld.recording.replay import with_errors
from fireworld.records import ACTION_NAMES, MemoryRecording, RunHeader, StepRecord
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.observer import Observer
from fireworld.simulation.state import copy_into, copy_world, restore_snapshot
from fireworld.simulation.world import World
from fireworld.training.log.episode_run import LEARNING_ATTACHMENT
from fireworld.training.log.played_run import recorded_seeds


@dataclass(frozen=True)
class Resumed:
    """A world after some step of a recorded run.

    Attributes:
        world: in the state it was in then.
        recorded: the recorded steps that were computed again, in the recorded city.
        replayed: the same as computed now; to be compared with what is recorded.
    """

    world: World
    recorded: MemoryRecording
    replayed: MemoryRecording


def refind_policy(header: RunHeader) -> NamedPolicy:
    """Load the policy of a recorded run as it is now: a team from its recording, any other by its name.

    Raises:
        PolicyError, TrainingError: it cannot be loaded.
    """
    team_file = header.attachments.get(TEAM_ATTACHMENT)
    if team_file is None:
        return find_policy(header.policy)
    policy = parse_team(team_file, source=f"recording: {TEAM_ATTACHMENT}").policy()
    return NamedPolicy(header.policy, policy.digest, policy, {TEAM_ATTACHMENT: team_file})


def recorded_policy(header: RunHeader, *, source: str) -> NamedPolicy:
    """Load the policy of a recorded run, unchanged since.

    Args:
        header: of the run.
        source: its file, for errors.

    Raises:
        PolicyError: it cannot be loaded, or it is not what it was when the run was recorded.
    """
    name = header.policy
    if LEARNING_ATTACHMENT in header.attachments:
        hint = "name one with --policy, as in --policy recorded or a team file"
        wanted, got = "a policy that does not change", "a team that learned in this run"
        raise PolicyError(expected(source, "policy", wanted, got, hint))
    try:
        named = refind_policy(header)
    except FireworldError as error:
        reason = str(error).removeprefix("--policy: ")
        hint = "name another one with --policy"
        raise PolicyError(f"{source}: its policy {name} cannot be loaded: {reason}; {hint}") from error
    if named.digest != header.policy_digest:
        wanted = f"the policy {name} as it was recorded ({header.policy_digest[:12]})"
        got = f"one that has changed since ({named.digest[:12]})"
        raise PolicyError(expected(source, "policy", wanted, got, f"--policy {name} takes it as it is now"))
    return named


def resume(
    built: BuiltScenario, recording: MemoryRecording, *, source: str, with_memory: NamedPolicy | None = None
) -> Resumed:
    """Bring a world into the state after the last step of a recording.

    It starts from the nearest snapshot before that step and takes the recorded decisions from there.

    Args:
        built: the scenario of the recording, built.
        recording: the steps 0 to the one to resume after.
        source: the file it comes from, for errors.
        with_memory: the recorded policy, if it has a memory: it then sees every step from the first.

    Raises:
        LogError: the recording does not begin with step 0, lacks a step, or went on with another seed in its middle.
        PolicyError: `with_memory` would not have decided as is recorded.
    """
    header, records = recording.header, list(recording)
    if [record.step for record in records] != list(range(len(records))):
        raise LogError(expected(source, "steps", f"every step from 0 to {records[-1].step}", "some are missing"))
    if len(seeds := recorded_seeds(header)) > 1:
        got = f"one that went on with another after step {[*seeds][1]}, where it was forked while it was played"
        raise LogError(expected(source, "seed", "a run of one seed", got))
    world = built.world(seed=header.seed, n_steps_max=header.n_steps_max)
    start = _restore(world, records) if with_memory is None else 0
    decider: Policy = RecordedDecisions(recording)
    if with_memory is not None:
        begin(with_memory.policy, world.city_arrays, n_brigades=world.n_brigades, seed=world.seed)
        decider = ShadowPolicy(decider, with_memory.policy)
    again = _steps_again(world, decider, records[start:])
    if isinstance(decider, ShadowPolicy) and decider.disagreements:
        (step, brigade), (made, own) = next(iter(decider.disagreements.items()))
        name, found = header.policy, f"{ACTION_NAMES[made.action]} is recorded"
        raise PolicyError(
            f"{source}: step {step}, brigade {brigade}: {found}, but {name} now decides {ACTION_NAMES[own.action]},"
            f" so it cannot continue the run; --policy {name} starts it afresh"
        )
    return Resumed(
        world=world,
        recorded=MemoryRecording(header, recording.city, records[start:]),
        replayed=MemoryRecording(header, built.city_record(), again),
    )


def _restore(world: World, records: Sequence[StepRecord]) -> int:
    """Put the world into the nearest snapshot before the last step and return its step.

    Before, so that at least one step is always computed again; a snapshot that does not fit is skipped.
    """
    for record in reversed(records[1:-1]):
        if record.snapshot is not None:
            restored = copy_world(world.state)
            try:
                restore_snapshot(restored, record.snapshot.arrays)
            except LogError:
                continue
            copy_into(world.state, restored)
            world.step_number = record.step
            return record.step
    return 0


def _steps_again(world: World, decider: Policy, records: Sequence[StepRecord]) -> list[StepRecord]:
    """Compute recorded steps again, from the world that the first of them left."""
    observer = Observer(world)
    start = observer.record()
    if world.step_number > 0:  # observations, decisions and events of that step are not part of the state
        first = records[0]
        start = replace(start, observations=first.observations, decisions=first.decisions, events=first.events)
    again = [start]
    recorded = {record.step: record.decisions for record in records}
    while world.step_number < records[-1].step and not (world.terminated or world.truncated):
        record = observer.record(world.step(decider))
        again.append(with_errors(record, recorded[record.step]))
    return again
