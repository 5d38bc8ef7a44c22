"""Replay: a recorded run again, from the scenario, seed and decisions in its recording alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from fireworld.errors import LogError, expected
from fireworld.policy.protocol import Action, Decision, Observation, Policy
from fireworld.records import AIR, Array, CityRecord, Decisions, Recording, RunHeader, Snapshot, StepRecord
from fireworld.scenario import parse_scenario
from fireworld.simulation.built import BuiltScenario, build_scenario
from fireworld.simulation.observer import Observer
from fireworld.simulation.placement import CITY_ATTACHMENT, SCENARIO_ATTACHMENT


class RecordedPolicy(Policy):
    """Decides as a recording says."""

    def __init__(self, recording: Recording) -> None:
        self._records = iter(recording)
        self._record = next(self._records, None)

    def decide(self, observation: Observation) -> Decision:
        """Return the decision recorded for this brigade and step."""
        while self._record is not None and self._record.step < observation.step:
            self._record = next(self._records, None)
        made = self._record.decisions if self._record is not None else None
        decision = recorded_decision(made, observation.brigade) if made is not None else None
        if decision is None or (decision.target is not None and decision.target not in observation.burning):
            # The replay has left the recorded path; an arbitrary action lets the comparison go on and name the step.
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


def build_recorded(header: RunHeader) -> BuiltScenario:
    """Build the built of a recorded run from the files attached to its recording.

    Raises:
        LogError: the recording lacks its scenario.
        ScenarioError: the scenario in it is not one.
    """
    text = header.attachments.get(SCENARIO_ATTACHMENT)
    if text is None:
        raise LogError(expected("recording", "attachments", SCENARIO_ATTACHMENT, sorted(header.attachments)))
    scenario = parse_scenario(text, source=f"recording: {SCENARIO_ATTACHMENT}")
    return build_scenario(scenario, city_json=header.attachments.get(CITY_ATTACHMENT))


class Replay:
    """A recorded run, run again while it is walked through; a `Recording` that can only be iterated over."""

    def __init__(self, recording: Recording, *, with_air: bool = False) -> None:
        """Build the recorded scenario again.

        Args:
            recording: of a run.
            with_air: every step has a snapshot, those without one of the air alone.

        Raises:
            LogError: the recording lacks its scenario.
        """
        self._recording, self._with_air = recording, with_air
        self._stage = build_recorded(recording.header)
        self.city: CityRecord = self._stage.city_record()

    @property
    def header(self) -> RunHeader:
        """The header of the recording."""
        return self._recording.header

    @property
    def steps(self) -> Array:
        """(k,) the recorded steps."""
        return self._recording.steps

    def __iter__(self) -> Iterator[StepRecord]:
        """Yield the recorded steps, computed again with the recorded decisions."""
        header = self.header
        world = self._stage.world(seed=header.seed, n_steps_max=header.n_steps_max)
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
            yield finished(observer.record(world.step(policy)))

    def column(self, topic: str, name: str) -> Array:
        """Refuse: a replay is only walked through."""
        raise NotImplementedError(f"{topic}.{name}: a replay is only walked through")

    def ragged(self, topic: str, name: str) -> Sequence[Array]:
        """Refuse: a replay is only walked through."""
        raise NotImplementedError(f"{topic}.{name}: a replay is only walked through")
