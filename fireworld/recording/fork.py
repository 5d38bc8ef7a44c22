"""Fork: a recorded run that goes on otherwise after one of its steps."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from fireworld import __version__
from fireworld.errors import LogError, expected
from fireworld.policy.names import TEAM_ATTACHMENT, NamedPolicy
from fireworld.policy.protocol import Decision, Observation, Policy
from fireworld.recording.decisions import (
    FIRST_ACTION,
    RecordedDecisions,
    ToldPolicy,
    check_same_luck,
    in_words,
    possible,
)
from fireworld.recording.resume import Resumed
from fireworld.records import CityRecord, Recording, RunHeader, StepRecord
from fireworld.simulation.observer import Observer
from fireworld.simulation.run import PreparedRun
from fireworld.simulation.state import copy_world
from fireworld.simulation.world import World

FORK_ATTACHMENT: Final = "fork.json"
"""What a recording calls the list of its forks, the oldest first."""
NAMED_MAX: Final = 8
"""Buildings that an error names at most."""


@dataclass(frozen=True)
class Swap:
    """A brigade that takes the decisions recorded in another run of the same scenario and seed."""

    brigade: int
    name: str
    """The other run's file, for errors."""
    digest: str
    header: RunHeader
    decisions: RecordedDecisions


@dataclass(frozen=True)
class Change:
    """What is to be otherwise after the step of the fork.

    Attributes:
        named: the policy that goes on.
        decided: decisions by brigade, for the first step after the fork.
        swaps: brigades that take another run's decisions, to the end.
    """

    named: NamedPolicy
    decided: Mapping[int, Decision] = field(default_factory=dict)
    swaps: Sequence[Swap] = ()


@dataclass(frozen=True)
class Fork(PreparedRun):
    """A run whose first steps are recorded ones: iterate over it to let the rest happen."""

    recorded: Sequence[StepRecord]

    def __iter__(self) -> Iterator[StepRecord]:
        """Yield the recorded steps and then every new one, until nothing burns or the last step is done."""
        yield from self.recorded
        world = self.start.copy()
        observer = Observer(world)
        while not (world.terminated or world.truncated):
            yield observer.record(world.step(self.policy))


def prepare_fork(
    resumed: Resumed, change: Change, recording: Recording, records: Sequence[StepRecord], *, digest: str, source: str
) -> Fork:
    """Get a fork ready.

    The policy must have seen the steps before, if it is the recorded one and has a memory; else be told that a run
    begins.

    Args:
        resumed: the world after the step to fork at.
        change: what is to be otherwise.
        recording: the run to fork.
        records: its steps up to that one.
        digest: of the whole recording.
        source: its file, for errors.

    Raises:
        LogError: nothing burns any more, a brigade cannot do what it is told, or a swapped run does not fit.
    """
    world, header = resumed.world, recording.header
    _check_not_over(world, source)
    if change.decided:
        asked = _asked_next(world)
        for brigade, decision in change.decided.items():
            _check_decides(world, brigade, recording, asked)
            _check_possible(world, brigade, decision, recording.city, asked[brigade])
    for swap in change.swaps:
        _check_swap(world, swap, header, source)
    step = world.step_number
    swapped = {swap.brigade: swap.decisions for swap in change.swaps}

    def told(brigade: int, now: int) -> Decision | None:
        if brigade in swapped:
            return swapped[brigade].at(now, brigade)
        return change.decided.get(brigade) if now == step + 1 else None

    attachments = {name: data for name, data in header.attachments.items() if name != TEAM_ATTACHMENT}
    attachments |= change.named.attachments
    attachments[FORK_ATTACHMENT] = _told_forks(header, _told(change, recording.city, digest=digest, step=step))
    return Fork(
        header=replace(
            header,
            policy=change.named.name,
            policy_digest=change.named.digest,
            fireworld_version=__version__,
            forked_from=f"{digest}:{step}",
            attachments=attachments,
        ),
        city=recording.city,
        start=world,
        policy=ToldPolicy(change.named.policy, told),
        recorded=records,
    )


def _check_not_over(world: World, source: str) -> None:
    if world.terminated or world.truncated:
        why = "nothing burns any more" if world.terminated else "it is the last of the run"
        raise LogError(
            expected("--at", "", f"a step of {source} after which the run goes on", f"{world.step_number}, {why}")
        )


def _check_brigade(option: str, brigade: int, n_brigades: int) -> None:
    if not 0 <= brigade < n_brigades:
        raise LogError(expected(option, "brigade", f"a number from 0 to {n_brigades - 1}", brigade))


class _Asked(Policy):
    """Asked for decisions, it remembers what was seen."""

    def __init__(self) -> None:
        self.seen: dict[int, Observation] = {}

    def decide(self, observation: Observation) -> Decision:
        _ = observation.burning  # what burns where it stands now: the arrays behind it change within the step
        self.seen[observation.brigade] = observation
        return FIRST_ACTION


def _asked_next(world: World) -> dict[int, Observation]:
    """Return what the brigades that are asked in the next step see then; the world stays as it is."""
    ahead, asked = copy.copy(world), _Asked()
    ahead.state = copy_world(world.state)
    ahead.step(asked)
    return asked.seen


def _check_decides(world: World, brigade: int, recording: Recording, asked: Mapping[int, Observation]) -> None:
    """Refuse a decision that would not be asked for, and so change nothing."""
    _check_brigade("--decide", brigade, world.n_brigades)
    if brigade not in asked:
        got = "one that is dead" if world.state.brigades.hp[brigade] <= 0 else "one that refills"
        wanted = f"a brigade that decides in step {world.step_number + 1}"
        actions = zip(recording.steps.tolist(), recording.ragged("/decisions", "action"), strict=True)
        later = [step for step, made in actions if step > world.step_number and made[brigade] >= 0]
        hint = f"it decides again in step {later[0]}: try --at {later[0] - 1}" if later else ""
        raise LogError(expected("--decide", str(brigade), wanted, got, hint))


def _check_possible(world: World, brigade: int, decision: Decision, city: CityRecord, seen: Observation) -> None:
    """Refuse a target that no policy could name."""
    if possible(decision, seen):
        return
    burns = 1 <= world.state.fire.fieryness[decision.target] <= 3
    wanted = f"a building that burns in the brigade's fire site in step {seen.step}"
    got = f"{city.building_id[decision.target]}, which {'burns in another one' if burns else 'does not burn'}"
    burning = sorted(city.building_id[seen.burning].tolist())
    more = f" or {len(burning) - NAMED_MAX} more" if len(burning) > NAMED_MAX else ""
    raise LogError(
        expected("--decide", str(brigade), wanted, got, f"try {', '.join(map(str, burning[:NAMED_MAX]))}{more}")
    )


def _check_swap(world: World, swap: Swap, header: RunHeader, source: str) -> None:
    check_same_luck(header, swap.header, names=(source, swap.name))
    _check_brigade("--swap", swap.brigade, world.n_brigades)
    if swap.decisions.last_step <= world.step_number:
        wanted = f"a run with decisions after step {world.step_number}"
        raise LogError(expected("--swap", swap.name, wanted, f"one that ends at step {swap.decisions.last_step}"))


def _told(change: Change, city: CityRecord, *, digest: str, step: int) -> dict[str, Any]:
    """Say what a fork changed, in plain values."""
    return {
        "from": digest,
        "step": step,
        "policy": change.named.name,
        "decide": {str(brigade): in_words(decision, city) for brigade, decision in sorted(change.decided.items())},
        "swap": {str(swap.brigade): swap.digest for swap in sorted(change.swaps, key=lambda swap: swap.brigade)},
    }


def _told_forks(header: RunHeader, fork: dict[str, Any]) -> bytes:
    """Add a fork to those that a recording tells of already."""
    try:
        before = json.loads(header.attachments.get(FORK_ATTACHMENT, b"[]"))
    except ValueError:
        before = []
    told = [*before, fork] if isinstance(before, list) else [fork]
    return (json.dumps(told, indent=1, sort_keys=True) + "\n").encode()
