"""Resume: the world of a recorded run as it was after one of its steps, and the policy of the run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np

from fireworld.errors import FireworldError, LogError, PolicyError, expected
from fireworld.policy.asking import begin
from fireworld.policy.names import TEAM_ATTACHMENT, NamedPolicy, find_policy, former_names
from fireworld.policy.protocol import Policy
from fireworld.policy.teams.team import parse_team
from fireworld.recording.decisions import RecordedDecisions, ShadowPolicy
from fireworld.recording.replay import check_replay, with_errors
from fireworld.records import ACTION_NAMES, CityRecord, RunHeader, StepRecord, StoredRun
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.observer import Observer
from fireworld.simulation.state import copy_into, copy_world, restore_snapshot
from fireworld.simulation.world import World
from fireworld.training.log.episode_run import LEARNING_ATTACHMENT
from fireworld.training.log.played_run import recorded_seeds


@dataclass(frozen=True)
class Beginning:
    """The steps of a recorded run up to one of them, read again at each iteration: a `fireworld.records.Steps`."""

    run: StoredRun
    last: int

    @property
    def header(self) -> RunHeader:
        """The header of the run."""
        return self.run.header

    @property
    def city(self) -> CityRecord:
        """The city it took place in."""
        return self.run.city

    def __iter__(self) -> Iterator[StepRecord]:
        return takewhile(lambda record: record.step <= self.last, self.run)


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
    before = [] if named.digest == header.policy_digest else map(find_policy, former_names(name))
    named = next((one for one in before if one.digest == header.policy_digest), named)
    if named.digest != header.policy_digest:
        wanted = f"the policy {name} as it was recorded ({header.policy_digest[:12]})"
        got = f"one that has changed since ({named.digest[:12]})"
        raise PolicyError(expected(source, "policy", wanted, got, f"--policy {name} takes it as it is now"))
    return named


def resume(built: BuiltScenario, beginning: Beginning, *, source: str, with_memory: NamedPolicy | None = None) -> World:
    """Return the world of a recorded run after a step.

    It starts from the nearest snapshot before that step and takes the recorded decisions from there; what it computes
    on the way is compared with what is recorded.

    Args:
        built: the scenario of the recording, built.
        beginning: the steps 0 to the one to resume after.
        source: the file it comes from, for errors.
        with_memory: the recorded policy, if it has a memory: it then sees every step from the first.

    Raises:
        LogError: the recording does not begin with step 0, lacks a step, went on with another seed in its middle, or
            does not replay to what is recorded.
        PolicyError: `with_memory` would not have decided as is recorded.
    """
    header, steps = beginning.header, beginning.run.steps
    if not np.array_equal(steps[: beginning.last + 1], np.arange(beginning.last + 1)):
        raise LogError(expected(source, "steps", f"every step from 0 to {beginning.last}", "some are missing"))
    if len(seeds := recorded_seeds(header)) > 1:
        got = f"one that went on with another after step {[*seeds][1]}, where it was forked while it was played"
        raise LogError(expected(source, "seed", "a run of one seed", got))
    world = built.world(seed=header.seed, n_steps_max=header.n_steps_max)
    start = _restore(world, beginning) if with_memory is None else 0
    decider: Policy = RecordedDecisions(beginning)
    if with_memory is not None:
        begin(with_memory.policy, world.city_arrays, n_brigades=world.n_brigades, seed=world.seed)
        decider = ShadowPolicy(decider, with_memory.policy)
    again = _Again(header, built.city_record(), world, decider, beginning)
    check_replay(beginning, again, source=source, first_step=start)
    if isinstance(decider, ShadowPolicy) and decider.disagreements:
        (step, brigade), (made, own) = next(iter(decider.disagreements.items()))
        name, found = header.policy, f"{ACTION_NAMES[made.action]} is recorded"
        raise PolicyError(
            f"{source}: step {step}, brigade {brigade}: {found}, but {name} now decides {ACTION_NAMES[own.action]},"
            f" so it cannot continue the run; --policy {name} starts it afresh"
        )
    return world


def _restore(world: World, beginning: Beginning) -> int:
    """Put the world into the nearest snapshot before the last step and return its step.

    Before, so that at least one step is always computed again; a snapshot that does not fit is skipped.
    """
    for number in range(beginning.last - 1, 0, -1):
        record = beginning.run.step(number)
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


@dataclass(frozen=True)
class _Again:
    """Recorded steps that are computed again, from where a world stands; it moves on, so iterate once."""

    header: RunHeader
    city: CityRecord
    world: World
    decider: Policy
    beginning: Beginning

    def __iter__(self) -> Iterator[StepRecord]:
        world, observer = self.world, Observer(self.world)
        start = observer.record()
        recorded = (record for record in self.beginning if record.step >= world.step_number)
        first = next(recorded)
        if world.step_number > 0:  # observations, decisions and events of that step are not part of the state
            start = replace(start, observations=first.observations, decisions=first.decisions, events=first.events)
        yield start
        while world.step_number < self.beginning.last and not (world.terminated or world.truncated):
            record = observer.record(world.step(self.decider))
            yield with_errors(record, next(recorded).decisions)
