"""The text of a golden: what happened in its run, to be read in a review."""

from __future__ import annotations

from itertools import groupby
from typing import Final

from fireworld_recorder.reader import Log
from fireworld_recorder.totals import final_outcome

from fireworld.parameters import PRESETS
from fireworld.recording.golden.spec import hash_line, spec_of
from fireworld.recording.replay import recorded_scenario
from fireworld.records import EVENT_KINDS, Array, StoredRun, name_of
from fireworld.scenario import Scenario
from fireworld.scenario.document import DIRECTIONS
from fireworld.training.log.reader import TrainingLog

LETTERS: Final = {"E": "easiest", "V": "nearest-to-civilian", "C": "nearest-to-center", "M": "nearest-to-me"}
"""Of the actions, in their order."""
OWN: Final = "T"
"""An action beyond these: a target of the brigade's own."""
NONE: Final = "."
LEGEND: Final = ", ".join(
    f"{letter} {action}" for letter, action in {**LETTERS, OWN: "own target", NONE: "none"}.items()
)
STEPS_IN_A_LINE: Final = 100


def golden_text(log: Log) -> str:
    """Return a recording as text: what was run, how it ended, every event, all decisions, and the final hash."""
    blocks = (run_facts(log), _events(log), _decisions(log), [hash_line(log.digest)])
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def is_text_of(text: str, log: Log | TrainingLog) -> bool:
    """Return whether a text describes this recording, in whatever words."""
    return hash_line(log.digest) in text.splitlines()


def run_facts(log: StoredRun) -> list[str]:
    """List what was run and how it came out; the numbers are written as they were in the first goldens."""
    outcome, city, spec = final_outcome(log), log.city, spec_of(log.header)
    ended = "still burning" if outcome.time_to_complete is None else "the fire is out"
    settings = "".join(f", {key}={text}" for key, text in spec.settings.items())
    exceptions = [f"{field} to {tolerance:g}" for field, tolerance in spec.tolerances.items()]
    exceptions += [f"not {name}" for name in spec.ignore]
    facts = {
        "scenario": f"{log.header.scenario}{settings}",
        "kind": scenario_kind(recorded_scenario(log.header)),
        "policy": log.header.policy,
        "seed": str(log.header.seed),
        "steps": f"{outcome.steps} of at most {log.header.n_steps_max}, {ended}",
        "score": f"{outcome.score:.6g} of {outcome.score_max:g}",
        "burnt out": f"{outcome.n_burnt_out} of {len(city.building_id)} buildings",
        "alive": f"{outcome.n_civilians_alive} of {len(city.civilian_hp)} civilians",
        "return": f"{outcome.total_reward:.6g}",
        "water": f"{outcome.water_used_litres:g} litres",
        "compared": "exactly" + "".join(f", {exception}" for exception in exceptions),
    }
    return [f"{label:<10} {text}" for label, text in facts.items()]


def _events(log: Log) -> list[str]:
    """List the events of every step that has any."""
    lines = ["events by step, with the numbers of the buildings; tank-empty and refilled: of the brigades"]
    kinds, entities = log.ragged("events", "kind"), log.ragged("events", "entity")
    for step, kind, entity in zip(log.steps, kinds, entities, strict=True):
        if len(kind):
            lines.append(f"{step:>5}  {_step_events(kind, entity)}")
    return lines


def _step_events(kinds: Array, entities: Array) -> str:
    events = zip(kinds.tolist(), entities.tolist(), strict=True)
    parts = []
    for kind, group in groupby(events, key=lambda event: event[0]):
        name = name_of(EVENT_KINDS, kind, "kind")
        parts.append(f"{name} {', '.join(str(entity) for _, entity in group)}")
    return "; ".join(parts)


def _decisions(log: Log) -> list[str]:
    """Write a strip of letters for each brigade, one for each step, and list where its targets change."""
    lines = [f"decisions, a letter for each step: {LEGEND}"]
    steps = log.steps.tolist()
    actions, targets = log.ragged("decisions", "action"), log.ragged("decisions", "target")
    for brigade in range(len(log.city.brigade_tank_litres)):
        chosen = [(step, _entry(row, brigade)) for step, row in zip(steps, actions, strict=True) if step]
        letters = "".join(action_letter(action) for _, action in chosen)
        counts = (f"{letters.count(letter)} {letter}" for letter in (*LETTERS, OWN, NONE) if letter in letters)
        lines.append(f"brigade {brigade}: {', '.join(counts)}")
        starts = range(0, len(letters), STEPS_IN_A_LINE)
        lines += [f"{chosen[start][0]:>5}  {letters[start : start + STEPS_IN_A_LINE]}" for start in starts]
        lines += _changes_of([(step, _entry(row, brigade)) for step, row in zip(steps, targets, strict=True) if step])
    return lines


def _changes_of(targets: list[tuple[int, int]]) -> list[str]:
    """List from which step on a brigade had which building as its target."""
    changes = [next(group) for _, group in groupby(targets, key=lambda entry: entry[1])]
    words = [f"{step} {'none' if target < 0 else target}" for step, target in changes]
    return [f"       targets from step: {', '.join(words)}"] if words else []


def action_letter(action: int) -> str:
    """Return the letter of an action, -1 for none."""
    return NONE if action < 0 else (*LETTERS, OWN)[min(action, len(LETTERS))]


def _entry(row: Array, brigade: int) -> int:
    """Return what a brigade's entry is, -1 where there is none."""
    return int(row[brigade]) if brigade < len(row) else -1


def scenario_kind(scenario: Scenario) -> str:
    """Return the kind of a scenario in words.

    Scenarios that differ only in places, in numbers of buildings or people, or in random draws are of one kind.
    """
    changed = scenario.resolved_parameters != PRESETS[scenario.preset]
    return ", ".join(
        (
            f"{'generated city' if scenario.city.generated else 'city'} of {scenario.city.summary}",
            f"{scenario.brigades.n} brigades",
            _where_fire_is(scenario),
            _where_people_are(scenario),
            f"choices {scenario.choices}",
            f"reward {scenario.reward if isinstance(scenario.reward, str) else f'{scenario.reward.of} with weights'}",
            f"parameters {scenario.preset}" + (" with changes" if changed else ""),
        )
    )


def _where_fire_is(scenario: Scenario) -> str:
    place = "one place" if len(scenario.fires) == 1 else "several places"
    return f"fire in {place}" + (", by building" if any(fire.buildings for fire in scenario.fires) else "")


def _where_people_are(scenario: Scenario) -> str:
    civilians = scenario.civilians
    if civilians.count == 0:
        return "no civilians"
    if civilians.buildings is not None or civilians.at is not None:
        return "civilians by building"
    return "civilians all around" if set(civilians.directions) == set(DIRECTIONS) else "civilians on some sides"
