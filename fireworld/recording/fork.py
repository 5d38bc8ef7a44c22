"""Fork: a recorded run that branches off after one of its steps."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from fireworld.arguments import ArgumentError, path_of, whole_number
from fireworld.errors import LogError, expected
from fireworld.files import check_output
from fireworld.policy.asking import begin
from fireworld.policy.names import RECORDED, TEAM_ATTACHMENT, NamedPolicy, find_policy, note_on_team
from fireworld.policy.protocol import Decision, Observation, Policy
from fireworld.recording.decisions import (
    FALLBACK,
    DecisionGiven,
    ForcedPolicy,
    RecordedDecisions,
    check_same_draws,
    decision_text,
    is_possible,
    read_decision,
)
from fireworld.recording.inputs import AnyRun, check_replayable, open_run, run_name
from fireworld.recording.record import run_prepared
from fireworld.recording.replay import build_recorded
from fireworld.recording.resume import Beginning, recorded_policy, resume
from fireworld.recording.run import Run
from fireworld.records import CityRecord, RunHeader, StepRecord, StoredRun
from fireworld.simulation.observer import Observer
from fireworld.simulation.prepared_run import PreparedRun
from fireworld.simulation.world import World
from fireworld.training.log.episode_run import LEARNING_ATTACHMENT
from fireworld.version import __version__, simulator_digest

FORK_ATTACHMENT: Final = "fork.json"
"""Name of the attachment that lists the forks a recording comes from, the oldest first."""
OF_POLICY: Final = (TEAM_ATTACHMENT, LEARNING_ATTACHMENT)
BUILDINGS_NAMED_MAX: Final = 8
"""Buildings that an error names at most."""


@dataclass(frozen=True)
class ForkChange:
    """What is changed after the step of the fork.

    Attributes:
        named: the policy that takes over.
        decided: decisions by brigade, for the first step after the fork.
        swaps: by brigade: the run of the same scenario and seed whose decisions it takes to the end, and these.
    """

    named: NamedPolicy
    decided: Mapping[int, Decision] = field(default_factory=dict)
    swaps: Mapping[int, tuple[StoredRun, RecordedDecisions]] = field(default_factory=dict)


@dataclass(frozen=True)
class PreparedFork(PreparedRun):
    """A prepared run whose first steps are recorded ones; iterating runs the others.

    A policy with a memory has seen the recorded steps once; with one, iterate once only.

    Attributes:
        recorded: the recorded steps.
        score_of_original: of the recorded run, at its last step.
        note: how a team is used in another way than it was trained, if it is.
    """

    recorded: Beginning
    score_of_original: float
    note: str

    def __iter__(self) -> Iterator[StepRecord]:
        """Yield the recorded steps and then every new one, until nothing burns or the last step is done."""
        yield from self.recorded
        world = self.start.copy()
        observer = Observer(world)
        while not (world.terminated or world.truncated):
            yield observer.record(world.step(self.policy))


def fork(
    log: AnyRun,
    *,
    at: int,
    policy: object = None,
    decide: Mapping[int, DecisionGiven] | None = None,
    swap: Mapping[int, AnyRun] | None = None,
    record: str | os.PathLike[str] | None = None,
    force: bool = False,
) -> Run:
    """Branch off from a recorded run after one of its steps, with something changed, and run to the end.

    The random draws stay the same. If nothing is changed the fork is the same as the recorded run, to the bit.

    Args:
        log: the path of a recording, or a run.
        at: the step after which it branches off.
        policy: the policy that takes over, as for `fireworld.run`, started afresh; "recorded" for the recorded
            decisions, whatever happens; None: the policy of the run, which remembers what it saw.
        decide: by brigade, what it does in the first step: an action, its name, or "own-target:301" with the id of a
            building that burns in its fire site, or anywhere with `brigades.allocation: free`.
        swap: by brigade, a recording of the same scenario and seed whose decisions it takes to the end.
        record: the log to write; None: the run stays in memory.
        force: replace an existing log.

    Raises:
        LogError: a run cannot be read, does not replay to what is recorded, has no such step, or ended with it; or a
            brigade cannot do what it is to do.
        PolicyError, TrainingError: the policy cannot be loaded, or fails.
        ArgumentError: a brigade or decision makes no sense.
        OutputError: the log cannot be written.
    """
    output = None if record is None else path_of("record", record)
    if output is not None:
        check_output(output, force=force)
    prepared = prepare_fork(log, at=at, policy=policy, decide=decide, swap=swap)
    return run_prepared(prepared, record=output, force=force)


def prepare_fork(
    log: AnyRun,
    *,
    at: int,
    policy: object = None,
    decide: Mapping[int, DecisionGiven] | None = None,
    swap: Mapping[int, AnyRun] | None = None,
) -> PreparedFork:
    """Prepare a fork; arguments and errors as for `fork`."""
    run = open_run(log)
    check_replayable(run)
    beginning = _recorded_up_to(run, at)
    built = build_recorded(run.header)
    change = _read_change(run, built.n_brigades, policy, decide or {}, swap or {})
    with_memory = change.named if policy is None and not change.named.policy.stateless else None
    world = resume(built, beginning, source=run_name(run), with_memory=with_memory)
    _check_change(change, world, run)
    if with_memory is None:
        begin(change.named.policy, world.city_arrays, n_brigades=built.n_brigades, seed=run.header.seed)
    return PreparedFork(
        header=_header(run, change, at),
        city=run.city,
        start=world,
        policy=_forced_policy(change, first_step=at + 1),
        recorded=beginning,
        score_of_original=run.step(int(run.steps[-1])).score.score,
        note=note_on_team(change.named, built.n_brigades, choices=built.scenario.choices),
    )


def _recorded_up_to(run: StoredRun, step: int) -> Beginning:
    """Return the steps of a run up to one of them, after which it must continue."""
    if step not in run.steps:
        steps = run.steps
        held = f"a step of {run_name(run)}, {steps[0]} to {steps[-1]}" if len(run) else f"steps in {run_name(run)}"
        raise LogError(expected("at", "", held, step if len(run) else "none"))
    last = run.step(step)
    if last.terminated or last.truncated:
        got = f"{step}, {'nothing burns any more' if last.terminated else 'it is the last of the run'}"
        raise LogError(expected("at", "", f"a step of {run_name(run)} after which the run continues", got))
    return Beginning(run, step)


def _read_change(
    run: StoredRun,
    n_brigades: int,
    policy: object,
    decide: Mapping[int, DecisionGiven],
    swap: Mapping[int, AnyRun],
) -> ForkChange:
    """Read what is to be changed; errors as for `fork`."""
    for option, brigades in (("decide", decide), ("swap", swap)):
        for brigade in brigades:
            whole_number(f"{option}: brigade", brigade, least=0, most=n_brigades - 1)
    for brigade in decide.keys() & swap.keys():
        raise ArgumentError(expected("decide, swap", "", f"one of them for brigade {brigade}", "both"))
    decided = {brigade: read_decision(f"decide: {brigade}", given, run) for brigade, given in decide.items()}
    swaps: dict[int, tuple[StoredRun, RecordedDecisions]] = {}
    opened: dict[object, tuple[StoredRun, RecordedDecisions]] = {}
    for brigade, other in swap.items():
        key = str(other) if isinstance(other, str | os.PathLike) else id(other)
        if key not in opened:
            opened[key] = (swapped := open_run(other)), RecordedDecisions(swapped)
        swaps[brigade] = opened[key]
    name = run.header.policy if policy is None else policy
    if isinstance(name, str) and name == RECORDED:
        named = NamedPolicy(RECORDED, run.digest, RecordedDecisions(run))
    else:
        named = recorded_policy(run.header, source=run_name(run)) if policy is None else find_policy(policy)
    return ForkChange(named, decided, swaps)


def _check_change(change: ForkChange, world: World, run: StoredRun) -> None:
    """Check that every brigade can do what it is to do."""
    observing = _Observing()
    if change.decided:
        world.copy().step(observing)  # what the brigades that are asked in the next step see then
    for brigade, decision in change.decided.items():
        _check_decides(world, brigade, run, observing.seen)
        _check_possible(world, brigade, decision, run.city, observing.seen[brigade])
    step = world.step_number
    for other, decisions in change.swaps.values():
        check_same_draws(run.header, other.header, names=(run_name(run), run_name(other)))
        if decisions.last_step <= step:
            wanted, got = f"a run with decisions after step {step}", f"one that ends at {decisions.last_step}"
            raise LogError(expected("swap", run_name(other), wanted, got))


class _Observing(Policy):
    """A policy that keeps what it observes."""

    def __init__(self) -> None:
        self.seen: dict[int, Observation] = {}

    def decide(self, observation: Observation) -> Decision:
        _ = observation.burning  # what burns where it stands now: the arrays behind it change within the step
        self.seen[observation.brigade] = observation
        return FALLBACK


def _check_decides(world: World, brigade: int, run: StoredRun, asked: Mapping[int, Observation]) -> None:
    """Check that a brigade is asked for the decision; otherwise it would change nothing."""
    if brigade not in asked:
        brigades, wanted = world.state.brigades, f"a brigade that decides in step {world.step_number + 1}"
        if world.constants.brigades.keeps and brigades.target[brigade] >= 0 and not brigades.refilling[brigade]:
            target = run.city.building_id[brigades.target[brigade]]
            got = f"one that stays with building {target} while that burns"
            raise LogError(expected("decide", str(brigade), wanted, got, "brigades.targets is kept"))
        got = "one that is dead" if brigades.hp[brigade] <= 0 else "one that refills"
        actions = zip(run.steps.tolist(), run.ragged("/decisions", "action"), strict=True)
        later = [step for step, made in actions if step > world.step_number and made[brigade] >= 0]
        hint = f"it decides again in step {later[0]}: fork at {later[0] - 1}" if later else ""
        raise LogError(expected("decide", str(brigade), wanted, got, hint))


def _check_possible(world: World, brigade: int, decision: Decision, city: CityRecord, seen: Observation) -> None:
    """Check that a target is one that a policy could name."""
    if is_possible(decision, seen):
        return
    burns = 1 <= world.state.fire.fieryness[decision.target] <= 3
    where = "" if seen.constants.brigades.free else " in the brigade's fire site"
    wanted = f"a building that burns{where} in step {seen.step}"
    got = f"{city.building_id[decision.target]}, which {'burns in another one' if burns else 'does not burn'}"
    burning = sorted(city.building_id[seen.burning].tolist())
    more = f" or {len(burning) - BUILDINGS_NAMED_MAX} more" if len(burning) > BUILDINGS_NAMED_MAX else ""
    hint = f"try {', '.join(map(str, burning[:BUILDINGS_NAMED_MAX]))}{more}"
    raise LogError(expected("decide", str(brigade), wanted, got, hint))


def _forced_policy(change: ForkChange, *, first_step: int) -> ForcedPolicy:
    def forced(brigade: int, step: int) -> Decision | None:
        if brigade in change.swaps:
            return change.swaps[brigade][1].at(step, brigade)
        return change.decided.get(brigade) if step == first_step else None

    return ForcedPolicy(change.named.policy, forced)


def _header(run: StoredRun, change: ForkChange, step: int) -> RunHeader:
    """Return the header of a fork: it names the run it comes from and lists what was changed."""
    header, named = run.header, change.named
    made: dict[str, Any] = {
        "from": run.digest,
        "step": step,
        "policy": named.name,
        "decide": {str(brigade): decision_text(made, run.city) for brigade, made in sorted(change.decided.items())},
        "swap": {str(brigade): other.digest for brigade, (other, _) in sorted(change.swaps.items())},
    }
    try:
        before = json.loads(header.attachments.get(FORK_ATTACHMENT, b"[]"))
    except (ValueError, RecursionError):
        before = []
    forks = [*before, made] if isinstance(before, list) else [made]
    attachments = {name: data for name, data in header.attachments.items() if name not in OF_POLICY}
    return replace(
        header,
        policy=named.name,
        policy_digest=named.digest,
        fireworld_version=__version__,
        simulator_digest=simulator_digest(),
        forked_from=f"{run.digest}:{step}",
        attachments=attachments
        | dict(named.attachments)
        | {FORK_ATTACHMENT: (json.dumps(forks, indent=1, sort_keys=True) + "\n").encode()},
    )
