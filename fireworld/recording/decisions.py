"""Decisions of a recorded run, and policies that are made of them: recorded, forced, in shadow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from difflib import get_close_matches
from typing import Final

from fireworld.arguments import whole_number
from fireworld.errors import LogError, PolicyError, expected
from fireworld.policy.asking import ask, keeps
from fireworld.policy.protocol import Action, Decision, Observation, Policy
from fireworld.recording.cause import scenario_text
from fireworld.recording.inputs import run_name
from fireworld.recording.replay import recorded_decision
from fireworld.records import ACTION_NAMES, CityRecord, RunHeader, Steps, StoredRun

ForcedDecisions = Callable[[int, int], Decision | None]
"""From a brigade and a step to the decision forced on the brigade; None: it asks its policy."""

DecisionGiven = str | Action | Decision
"""A decision as callers give it: itself, an action, or text as in "nearest-to-me" or "own-target:301"."""

FALLBACK: Final = Decision(0)
"""What a brigade does of which no decision is known at all, or one that is not possible."""


def check_same_draws(first: RunHeader, second: RunHeader, *, names: tuple[str, str]) -> None:
    """Raise LogError if two runs, with these names, do not start alike or do not see the same random draws."""
    if first.scenario_digest != second.scenario_digest:
        wanted = f"{scenario_text(first)}, as in {names[0]}"
        raise LogError(expected(names[1], "scenario", wanted, scenario_text(second)))
    if first.seed != second.seed:
        wanted = f"{first.seed}, as in {names[0]}: other seeds give different random draws"
        raise LogError(expected(names[1], "seed", wanted, second.seed))


class RecordedDecisions(Policy):
    """Decides as a recorded run did, in any world; where nothing is recorded, as the brigade last did there.

    Nothing is recorded where a brigade had no choice (it refilled), and after the end of the recording.
    """

    stateless = True

    def __init__(self, recording: Steps) -> None:
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
        return FALLBACK

    def targets(self, brigade: int, *, first: int, last: int) -> list[int]:
        """Return the buildings that a brigade named itself from a step to another, each once, in their order."""
        made = (self.made(step, brigade) for step in range(first, last + 1))
        return [*dict.fromkeys(one.target for one in made if one is not None and one.target is not None)]

    def decide(self, observation: Observation) -> Decision:
        """Decide as recorded; `easiest` instead of a target of its own that does not burn here."""
        decision = self.at(observation.step, observation.brigade)
        return decision if is_possible(decision, observation) else FALLBACK


class ForcedPolicy(Policy):
    """A policy with some decisions forced on its brigades; a brigade asks it only if its forced one is not possible."""

    def __init__(self, policy: Policy, forced: ForcedDecisions) -> None:
        self._policy = policy
        self._forced = forced

    def decide(self, observation: Observation) -> Decision:
        """Return the forced decision, else what the policy decides."""
        forced = self._forced(observation.brigade, observation.step)
        return forced if forced is not None and is_possible(forced, observation) else ask(self._policy, observation)

    def keeps(self, brigade: int, last_action: int, step: int) -> bool:
        """Return whether a brigade repeats its last action: as the policy says, unless a decision is forced on it."""
        return self._forced(brigade, step) is None and keeps(self._policy, brigade, last_action, step)


class ShadowPolicy(Policy):
    """Decides as recorded, and asks a policy too: it notes where the policy would have decided differently.

    Attributes:
        disagreements: recorded and own decision where they differ, by (step, brigade), in the order of the run.
    """

    def __init__(self, recorded: Policy, policy: Policy) -> None:
        self._recorded = recorded
        self._policy = policy
        self.disagreements: dict[tuple[int, int], tuple[Decision, Decision]] = {}

    def decide(self, observation: Observation) -> Decision:
        """Return the recorded decision."""
        brigade, step = observation.brigade, observation.step
        recorded = ask(self._recorded, observation)
        last = _last(observation)
        repeats = is_possible(last, observation) and keeps(self._policy, brigade, last.action, step)
        own = last if repeats else ask(self._policy, observation)
        if (own.action, own.target) != (recorded.action, recorded.target):
            self.disagreements[step, brigade] = recorded, own
        return recorded


def is_possible(decision: Decision, observation: Observation) -> bool:
    """Return whether a decision can be made: a target of its own must be one that the brigade may name."""
    return decision.target is None or decision.target in observation.burning


def decision_text(decision: Decision, city: CityRecord) -> str:
    """Write a decision as `--decide` takes it: its action, and the id of the building that it names itself."""
    name = ACTION_NAMES[decision.action]
    return name if decision.target is None else f"{name}:{city.building_id[decision.target]}"


def read_decision(where: str, given: DecisionGiven, run: StoredRun) -> Decision:
    """Return a decision.

    Args:
        where: what errors name.
        given: a decision; an action; or its name, as in "nearest-to-me" or "own-target:301", a building by its id.
        run: the run that it is for.

    Raises:
        PolicyError: there is no such action or building, or a building where none belongs.
        ArgumentError: it is no action at all, or a building that there is not by its index.
    """
    if isinstance(given, Decision):
        action = Action(whole_number(where, given.action, least=0, most=len(Action) - 1))
        if action != Action.OWN_TARGET:
            return replace(given, action=action, target=None)
        target = whole_number(f"{where}: target", given.target, least=0, most=len(run.city.building_id) - 1)
        return replace(given, action=action, target=target)
    if not isinstance(given, str):
        return Decision(Action(whole_number(where, given, least=0, most=len(Action) - 2)))
    name, colon, building = given.partition(":")
    if name not in ACTION_NAMES:
        near = [one for one in ACTION_NAMES if name in one] or get_close_matches(name, ACTION_NAMES, n=1)
        hint = "try " + " or ".join(near) if near else ""
        raise PolicyError(expected(where, "", "one of " + ", ".join(ACTION_NAMES), name, hint))
    action = Action(ACTION_NAMES.index(name))
    if action == Action.OWN_TARGET:
        if not (building.isascii() and building.isdecimal()):
            raise PolicyError(expected(where, "", f"a building behind {name}, as in {name}:301", given))
        ids = run.city.building_id.tolist()
        if int(building) not in ids:
            wanted = f"the id of a building of {run_name(run)}, {min(ids)} to {max(ids)}"
            raise PolicyError(expected(where, "", wanted, given))
        return Decision(action, target=ids.index(int(building)))
    if colon:
        hint = "a brigade goes for a building with own-target:BUILDING"
        raise PolicyError(expected(where, "", f"{name} without a building", given, hint))
    return Decision(action)


def _last(observation: Observation) -> Decision:
    """Return what a brigade did in the step before; the world's arrays hold it until the brigade has decided anew."""
    brigades = observation.world.brigades
    action = int(brigades.action[observation.brigade])
    target = int(brigades.target[observation.brigade]) if action == Action.OWN_TARGET else None
    return Decision(action, target=target)
