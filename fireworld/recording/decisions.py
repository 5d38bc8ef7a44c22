"""Decisions of a recorded run, and policies that are made of them: recorded, told, compared."""

from __future__ import annotations

from collections.abc import Callable

from fireworld.errors import LogError, expected
from fireworld.policy.asking import ask, keeps
from fireworld.policy.protocol import Action, Decision, Observation, Policy
from fireworld.recording.replay import recorded_decision
from fireworld.records import ACTION_NAMES, CityRecord, Recording, RunHeader

Told = Callable[[int, int], Decision | None]
"""From a brigade and a step to what the brigade is told to do; None: it asks its policy."""

FIRST_ACTION = Decision(0)
"""What a brigade does of which no decision is known at all, or one that is not possible."""


def check_same_luck(first: RunHeader, second: RunHeader, *, names: tuple[str, str]) -> None:
    """Refuse two runs that do not start alike or do not meet the same luck.

    Args:
        first: a run.
        second: the run to hold against it.
        names: their files.

    Raises:
        LogError: with what differs.
    """
    if first.scenario_digest != second.scenario_digest:
        wanted = f"{first.scenario} ({first.scenario_digest[:12]}), as in {names[0]}"
        raise LogError(expected(names[1], "scenario", wanted, f"{second.scenario} ({second.scenario_digest[:12]})"))
    if first.seed != second.seed:
        wanted = f"{first.seed}, as in {names[0]}: other seeds are other luck"
        raise LogError(expected(names[1], "seed", wanted, second.seed))


class RecordedDecisions(Policy):
    """Decides as a recorded run did, whatever happens; where nothing is recorded, as the brigade last did there.

    Nothing is recorded where a brigade had no choice (it refilled), and after the end of the recording.
    """

    stateless = True

    def __init__(self, recording: Recording) -> None:
        self._made = {record.step: record.decisions for record in recording}
        self.last_step = max(self._made, default=0)

    def made(self, step: int, brigade: int) -> Decision | None:
        """Return the decision recorded for a step, None if there is none."""
        decisions = self._made.get(step)
        return recorded_decision(decisions, brigade) if decisions is not None else None

    def at(self, step: int, brigade: int) -> Decision:
        """Return the decision recorded for a step, else the action of the last one before."""
        decision = self.made(step, brigade)
        if decision is not None:
            return decision
        for earlier in range(min(step - 1, self.last_step), 0, -1):
            decision = self.made(earlier, brigade)
            if decision is not None:
                return Decision(decision.action, target=decision.target)
        return FIRST_ACTION

    def targets(self, brigade: int, *, first: int, last: int) -> list[int]:
        """Return the buildings that a brigade named itself from a step to another, each once, in their order."""
        made = (self.made(step, brigade) for step in range(first, last + 1))
        return [*dict.fromkeys(one.target for one in made if one is not None and one.target is not None)]

    def decide(self, observation: Observation) -> Decision:
        """Decide as recorded; `easiest` instead of a target of its own that does not burn here."""
        decision = self.at(observation.step, observation.brigade)
        return decision if possible(decision, observation) else FIRST_ACTION


class ToldPolicy(Policy):
    """A policy for all brigades but those that are told what to do; they ask it only if that is not possible."""

    def __init__(self, policy: Policy, told: Told) -> None:
        self._policy = policy
        self._told = told

    def decide(self, observation: Observation) -> Decision:
        """Return what the brigade is told, else what the policy decides."""
        told = self._told(observation.brigade, observation.step)
        return told if told is not None and possible(told, observation) else ask(self._policy, observation)

    def keeps(self, brigade: int, last_action: int, step: int) -> bool:
        """Tell whether a brigade goes on with its last action: as the policy says, unless it is told what to do."""
        return self._told(brigade, step) is None and keeps(self._policy, brigade, last_action, step)


class ComparedPolicy(Policy):
    """Decides as recorded, and asks a policy too: it remembers what it would, and is seen to decide alike or not.

    Attributes:
        others: the recorded decisions that the policy would not have made, by (step, brigade), as they came.
    """

    def __init__(self, recorded: Policy, policy: Policy) -> None:
        self._recorded = recorded
        self._policy = policy
        self.others: dict[tuple[int, int], tuple[Decision, Decision]] = {}

    def decide(self, observation: Observation) -> Decision:
        """Return the recorded decision."""
        brigade, step = observation.brigade, observation.step
        recorded = ask(self._recorded, observation)
        last = _last(observation)
        kept = possible(last, observation) and keeps(self._policy, brigade, last.action, step)
        own = last if kept else ask(self._policy, observation)
        if (own.action, own.target) != (recorded.action, recorded.target):
            self.others[step, brigade] = recorded, own
        return recorded


def possible(decision: Decision, observation: Observation) -> bool:
    """Tell whether a decision can be made: a target of its own must burn, in the brigade's fire site."""
    return decision.target is None or decision.target in observation.burning


def in_words(decision: Decision, city: CityRecord) -> str:
    """Say a decision as `--decide` takes it: its action, and the id of the building that it names itself."""
    name = ACTION_NAMES[decision.action]
    return name if decision.target is None else f"{name}:{city.building_id[decision.target]}"


def _last(observation: Observation) -> Decision:
    """Return what a brigade did in the step before; its arrays tell until it has answered."""
    brigades = observation.world.brigades
    action = int(brigades.action[observation.brigade])
    target = int(brigades.target[observation.brigade]) if action == Action.OWN_TARGET else None
    return Decision(action, target=target)
