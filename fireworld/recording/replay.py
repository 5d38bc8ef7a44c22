"""Replay: a recorded run, computed again from the scenario, seed and decisions in its recording alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

from fireworld.errors import LogError, expected
from fireworld.policy.protocol import Action, Decision, Observation, Policy
from fireworld.recording.inputs import check_replayable
from fireworld.records import (
    AIR,
    Array,
    CityRecord,
    Decisions,
    Recording,
    RunHeader,
    Snapshot,
    StepRecord,
    Steps,
)
from fireworld.scenario import Scenario, parse_scenario
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.simulation.observer import Observer
from fireworld.simulation.placement import CITY_ATTACHMENT, SCENARIO_ATTACHMENT
from fireworld.training.log.episode_run import LEARNING_ATTACHMENT, recorded_learning
from fireworld.training.log.played_run import recorded_seeds


class RecordedPolicy(Policy):
    """Decides as a recording says."""

    def __init__(self, recording: Steps) -> None:
        self._records = iter(recording)
        self._record = next(self._records, None)

    def made(self, step: int) -> Decisions | None:
        """Return the decisions recorded for a step, those of the next one if it is not there; steps come rising."""
        while self._record is not None and self._record.step < step:
            self._record = next(self._records, None)
        return self._record.decisions if self._record is not None else None

    def decide(self, observation: Observation) -> Decision:
        """Return the decision recorded for this brigade and step."""
        made = self.made(observation.step)
        decision = recorded_decision(made, observation.brigade) if made is not None else None
        if decision is None or (decision.target is not None and decision.target not in observation.burning):
            # The replay differs from the recording; with any action the comparison continues and names the step.
            return Decision(0)
        return decision


def recorded_decision(made: Decisions, brigade: int) -> Decision | None:
    """Return the decision recorded for a brigade in a step, None if it made none."""
    if brigade >= len(made.action) or not 0 <= made.action[brigade] < len(Action):
        return None
    action = int(made.action[brigade])
    values = tuple(made.q_values[4 * brigade : 4 * brigade + 4].tolist()) or None
    return Decision(
        action,
        target=int(made.target[brigade]) if action == Action.OWN_TARGET else None,
        q_values=values,
        value=float(made.target_value[brigade]) if len(made.target_value) else None,
        explored=bool(made.explored[brigade]),
        epsilon=made.epsilon,
    )


def with_errors(record: StepRecord, made: Decisions | None) -> StepRecord:
    """Return a step that was computed again, with recorded TD errors: given as values are, for nothing is learned."""
    if made is None or not len(made.td_error):
        return record
    return replace(record, decisions=replace(record.decisions, td_error=made.td_error))


def recorded_scenario(header: RunHeader) -> Scenario:
    """Return the scenario that is attached to a recording.

    Raises:
        LogError: there is none.
        ScenarioError: it makes no sense.
    """
    text = header.attachments.get(SCENARIO_ATTACHMENT)
    if text is None:
        raise LogError(expected("recording", "attachments", SCENARIO_ATTACHMENT, sorted(header.attachments)))
    return parse_scenario(text, source=f"recording: {SCENARIO_ATTACHMENT}")


def build_recorded(header: RunHeader, *, cities: CityCache | None = None) -> BuiltScenario:
    """Build the scenario of a recorded run from the files attached to its recording; errors as `recorded_scenario`.

    Args:
        header: of the run.
        cities: cities built before, used and added to.
    """
    content = header.attachments.get(CITY_ATTACHMENT)
    return (cities or CityCache()).build(recorded_scenario(header), city_json=content)


class Replay:
    """The steps of a recorded run, computed again at each iteration: a `fireworld.records.Steps`."""

    def __init__(self, recording: Recording, *, with_air: bool = False) -> None:
        """Build the recorded scenario again.

        Args:
            recording: of a run.
            with_air: give every step a snapshot; steps recorded without one get a snapshot of the air alone.

        Raises:
            LogError: the recording lacks its scenario, or was imported.
        """
        check_replayable(recording)
        self._recording, self._with_air = recording, with_air
        self._built = build_recorded(recording.header)
        self.city: CityRecord = self._built.city_record()

    @property
    def header(self) -> RunHeader:
        """The header of the recording."""
        return self._recording.header

    @property
    def steps(self) -> Array:
        """(k,) the recorded steps."""
        return self._recording.steps

    def __iter__(self) -> Iterator[StepRecord]:
        """Yield the recorded steps, computed again with the recorded decisions; what was learned is learned again."""
        header = self.header
        if LEARNING_ATTACHMENT in header.attachments:
            yield from islice(recorded_learning(header, self._built), len(self.steps))
            return
        world, seeds = self._built.world(seed=header.seed, n_steps_max=header.n_steps_max), recorded_seeds(header)
        observer = Observer(world)
        policy = RecordedPolicy(self._recording)
        last = int(self.steps[-1]) if len(self.steps) else -1

        def finished(record: StepRecord) -> StepRecord:
            if not self._with_air or record.snapshot is not None:
                return record
            return replace(record, snapshot=Snapshot({AIR: world.state.fire.air.copy()}))

        if last >= 0:
            yield finished(observer.record())
        while world.step_number < last and not (world.terminated or world.truncated):
            world.seed = seeds.get(world.step_number, world.seed)
            record = observer.record(world.step(policy))
            yield finished(with_errors(record, policy.made(record.step)))


def check_replay(
    recorded: Steps, replayed: Steps, *, source: str, hint: str = "", first_step: int | None = None
) -> None:
    """Compare recorded steps with the same steps computed again.

    Args:
        recorded: the steps in the file.
        replayed: the same steps, computed again; iterated over once.
        source: the file.
        hint: what to do if they differ; by default, how to see the whole difference.
        first_step: the first step to compare; None: all are compared.

    Raises:
        LogError: they differ; names the first step.
    """
    from fireworld_recorder.diff import StepRange, compare

    first = compare(recorded, replayed, steps=StepRange(first=first_step)).first
    if first is not None:
        hint = hint or f"see `fireworld verify {source}`"
        raise LogError(f"{source}: does not replay to what is recorded: {first.sentence}; {hint}")


def replay_with_air(recording: Recording, path: Path, *, source: str) -> Recording:
    """Return a run with the air of every step, which is recorded with snapshots only.

    Args:
        recording: the run.
        path: a log to make: all that air would fill the memory.
        source: the run's file.

    Raises:
        LogError: this fireworld computes something else than what is recorded.
        OutputError: the log cannot be written.
    """
    from fireworld_recorder.reader import open_log
    from fireworld_recorder.writer import LogWriter

    replay = Replay(recording, with_air=True)
    with LogWriter(path, recording.header, replay.city) as log:
        for record in replay:
            log.write(record)
    replayed = open_log(path)
    check_replay(recording, replayed, source=source, hint="try without --air")
    return replayed
