"""Resume: a recorded run taken up again after one of its steps, in the state it was in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fireworld.errors import FireworldError, LogError, PolicyError, expected
from fireworld.policy.asking import begin
from fireworld.policy.names import TEAM_ATTACHMENT, NamedPolicy, find_policy
from fireworld.policy.protocol import Policy
from fireworld.policy.teams.team import parse_team
from fireworld.recording.decisions import ComparedPolicy, RecordedDecisions
from fireworld.records import ACTION_NAMES, MemoryRecording, RunHeader, StepRecord
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.observer import Observer
from fireworld.simulation.state import copy_into, copy_world, restore_snapshot
from fireworld.simulation.world import World


@dataclass(frozen=True)
class Resumed:
    """A world after some step of a recorded run.

    Attributes:
        world: in the state it was in then.
        recorded: the recorded steps that were computed again, in the recorded city.
        replayed: the same as computed now; to be held against what is recorded.
    """

    world: World
    recorded: MemoryRecording
    replayed: MemoryRecording


def recorded_policy(header: RunHeader, *, source: str) -> NamedPolicy:
    """Load the policy of a recorded run again: a team from its recording, any other by its name.

    Args:
        header: of the run.
        source: its file, for errors.

    Raises:
        PolicyError: it cannot be loaded, or it is not what it was when the run was recorded.
    """
    name, team_file = header.policy, header.attachments.get(TEAM_ATTACHMENT)
    try:
        if team_file is not None:
            team = parse_team(team_file, source=TEAM_ATTACHMENT)
            policy = team.policy()
            named = NamedPolicy(name, policy.digest, policy, {TEAM_ATTACHMENT: team_file})
        else:
            named = find_policy(name)
    except FireworldError as error:
        reason = str(error).removeprefix("--policy: ")
        raise PolicyError(
            f"{source}: its policy {name} cannot be loaded: {reason}; say with --policy who goes on"
        ) from error
    if named.digest != header.policy_digest:
        wanted = f"the policy {name} as it was recorded ({header.policy_digest[:12]})"
        got = f"one that has changed since ({named.digest[:12]})"
        raise PolicyError(expected(source, "policy", wanted, got, f"--policy {name} goes on with it as it is now"))
    return named


def has_memory(policy: Policy) -> bool:
    """Tell whether what a policy decides may depend on what it saw in the steps before."""
    return not policy.stateless


def resume(
    built: BuiltScenario, recording: MemoryRecording, *, source: str, remembering: NamedPolicy | None = None
) -> Resumed:
    """Bring a world into the state after the last step of a recording.

    It starts from the nearest snapshot before that step and takes the recorded decisions from there.

    Args:
        built: the scenario of the recording, built.
        recording: the steps 0 to the one to resume after.
        source: the file it comes from, for errors.
        remembering: the recorded policy, if it has a memory: it then sees every step from the first.

    Raises:
        LogError: the recording does not begin with step 0, or lacks a step.
        PolicyError: `remembering` would not have decided as is recorded.
    """
    header, records = recording.header, list(recording)
    if [record.step for record in records] != list(range(len(records))):
        raise LogError(expected(source, "steps", f"every step from 0 to {records[-1].step}", "some are missing"))
    world = built.world(seed=header.seed, n_steps_max=header.n_steps_max)
    start = _restore(world, records) if remembering is None else 0
    decider: Policy = RecordedDecisions(recording)
    if remembering is not None:
        begin(remembering.policy, world.city_arrays, n_brigades=world.n_brigades, seed=world.seed)
        decider = ComparedPolicy(decider, remembering.policy)
    again = _steps_again(world, decider, records[start:])
    if isinstance(decider, ComparedPolicy) and decider.others:
        _refuse_memory(decider, source=source, name=header.policy)
    return Resumed(
        world=world,
        recorded=MemoryRecording(header, recording.city, records[start:]),
        replayed=MemoryRecording(header, built.city_record(), again),
    )


def _restore(world: World, records: Sequence[StepRecord]) -> int:
    """Put the world into the nearest snapshot before the last step and return its step.

    Before, so that at least one step is always computed again; a snapshot that does not fit is passed over.
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
    if world.step_number > 0:  # what was seen, decided and told in that step is not part of the state
        first = records[0]
        start = replace(start, observations=first.observations, decisions=first.decisions, events=first.events)
    again = [start]
    while world.step_number < records[-1].step and not (world.terminated or world.truncated):
        again.append(observer.record(world.step(decider)))
    return again


def _refuse_memory(compared: ComparedPolicy, *, source: str, name: str) -> None:
    (step, brigade), (recorded, own) = next(iter(compared.others.items()))
    raise PolicyError(
        f"{source}: step {step}, brigade {brigade}: {ACTION_NAMES[recorded.action]} is recorded, but {name} now decides"
        f" {ACTION_NAMES[own.action]}, so it cannot go on as it was; --policy {name} lets it begin anew"
    )
