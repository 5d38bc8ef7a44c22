"""Why brigades that value targets preferred the one they chose: how far each feature speaks for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Final

import numpy as np

from fireworld.arguments import whole_number
from fireworld.errors import LogError, TrainingError, expected
from fireworld.kernels.arrays import Array
from fireworld.kernels.observation import find_target
from fireworld.kernels.ranking import N_TARGET_FEATURES
from fireworld.policy.kernel import settled_targets
from fireworld.policy.protocol import Decision, Observation, Policy
from fireworld.policy.seen_targets import seen_targets
from fireworld.policy.teams.network_layers import SEEN, Layer
from fireworld.policy.teams.network_team import NetworkTeam
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.team import Team, load_team
from fireworld.recording.decisions import FALLBACK, RecordedDecisions
from fireworld.recording.inputs import AnyRun, check_replayable, open_run, run_name
from fireworld.recording.replay import build_recorded
from fireworld.recording.resume import Beginning, resume
from fireworld.records import ACTIONS
from fireworld.shown import SHOWN_MAX, Block, Shown, TextTable, more

N_POINTS: Final = 256
"""Points between two targets at which the slope of a network is taken."""


@dataclass(frozen=True)
class FeatureShare:
    """How far a feature speaks for the target that was chosen."""

    feature: str
    chosen: float
    """What the brigade saw of that target."""
    other: float
    """What it saw of the other one."""
    part: float
    """What the feature adds to the difference of their values; below 0: it speaks for the other one."""


@dataclass(frozen=True)
class Preference:
    """What a brigade went for in a step, and what a team makes of that.

    Attributes:
        brigade: its number.
        chosen: id of the building that it went for.
        chosen_value: by the team; None if the team could not have named it.
        other: id of the target that the team values most of all others; None if there was no other.
        other_value: by the team.
        shares: one for each feature that the team reads, the largest part first; the parts add up to the difference.
        assigned: the team assigns brigades together: the values are those of targets that no other of them is given.
    """

    brigade: int
    chosen: int
    chosen_value: float | None
    other: int | None = None
    other_value: float = 0.0
    shares: tuple[FeatureShare, ...] = ()
    assigned: bool = False

    @property
    def text(self) -> str:
        """The choice in a line."""
        head = f"brigade {self.brigade} goes for {self.chosen}"
        if self.chosen_value is None:
            return f"{head}, which the team could not have named"
        head += f", worth {self.chosen_value:.3f}"
        if self.other is None:
            return f"{head}: there is no other target"
        though = "though alone it would be given" if self.assigned else "though the team would go for"
        word = "rather than" if self.chosen_value >= self.other_value else though
        return f"{head}, {word} {self.other}, worth {self.other_value:.3f}"


@dataclass(frozen=True, repr=False)
class Preferences(Shown):
    """What the brigades of a run went for in a step, and why, by the values of a team."""

    step: int
    brigades: tuple[Preference, ...] = field(default=())
    """Of those that chose in the step."""

    def __repr__(self) -> str:
        return "\n".join([f"step {self.step}", *(one.text for one in self.brigades)])

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield each choice, and a table of the features that speak for and against it."""
        if not self.brigades:
            yield f"step {self.step}: no brigade chose a target: they refill, are dead, or nothing burns"
        for place, one in enumerate(self.brigades):
            yield f"{'' if place else f'step {self.step}: '}{one.text}"
            if one.other is None:
                yield ""
                continue
            total = sum(abs(share.part) for share in one.shares) or 1.0
            rows = [
                [share.feature, f"{share.chosen:.3f}", f"{share.other:.3f}", f"{share.part:+.3f}",
                 f"{100 * abs(share.part) / total:.0f} %"]
                for share in one.shares[:limit] if share.part
            ]  # fmt: skip
            yield TextTable(["feature", str(one.chosen), str(one.other), "adds", "share"], rows)
            yield from more(len(one.shares), limit)
            yield ""

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as plain values."""
        return {"step": self.step, "brigades": [asdict(one) for one in self.brigades]}


def preferences(team: Team | str, log: AnyRun, *, step: int) -> Preferences:
    """Say why brigades went for their targets in a step of a run, by what the features of targets add to their values.

    Compared are the target of each brigade, as it is recorded, and the one that the team values most of all others
    that the brigade could have named. For a ranking a feature adds its weight times what it differs by; for a network
    the slope of the value, averaged along the straight line from one target to the other (integrated gradients:
    Sundararajan, Taly and Yan, 2017), times what it differs by.

    Args:
        team: one that values targets, or its file or name; it need not be that of the run.
        log: the path of a recording, or a run.
        step: one of its steps, from 1.

    Raises:
        TrainingError: the team cannot be read, or does not value targets.
        LogError: the run cannot be read, or does not replay to what is recorded.
        ArgumentError: the run has no such step.
    """
    found = load_team(team) if isinstance(team, str) else team
    if not isinstance(found, RankingTeam | NetworkTeam):
        raise TrainingError(expected("team", "", "a ranking or a network", found.what, "of tables, name a STATE"))
    run = open_run(log)
    check_replayable(run)
    last = int(run.steps[-1]) if len(run) else 0
    if last < 1:
        raise LogError(expected(run_name(run), "steps", "a run of one step at least", "none"))
    whole_number("step", step, least=1, most=last)
    built = build_recorded(run.header)
    world = resume(built, Beginning(run, step - 1), source=run_name(run)) if step > 1 else built.world(
        seed=run.header.seed, n_steps_max=run.header.n_steps_max
    )  # fmt: skip
    looking = _Looking(found, RecordedDecisions(Beginning(run, step)))
    world.step(looking)
    return Preferences(step, tuple(looking.found))


class _Looking(Policy):
    """Decides as is recorded, and finds what a team makes of it."""

    def __init__(self, team: RankingTeam | NetworkTeam, recorded: RecordedDecisions) -> None:
        self._team, self._recorded = team, recorded
        self.found: list[Preference] = []

    def decide(self, observation: Observation) -> Decision:
        """Return the recorded decision."""
        made = self._recorded.made(observation.step, observation.brigade) or FALLBACK
        if len(observation.burning):
            self.found.append(_preference(self._team, observation, made))
        return made


def _preference(team: RankingTeam | NetworkTeam, observation: Observation, made: Decision) -> Preference:
    """Return what a team makes of a decision."""
    assigned = isinstance(team, RankingTeam) and team.assigned
    if assigned:
        kind = team.policy().for_brigades(len(observation.known_targets)).kind
        observation = replace(observation, known_targets=settled_targets(observation, kind))
    targets, seen = _options(observation, own_targets=team.own_targets)
    chosen = made.target if made.target is not None else observation.targets[made.action]
    reads, layers, activations = _as_layers(team, observation.brigade)
    values = _value(seen[:, reads], layers, activations)
    ids = observation.city.buildings.building_id
    if chosen not in targets:
        return Preference(observation.brigade, int(ids[chosen]), None)
    place = targets.index(chosen) if team.own_targets or made.target is not None else int(made.action)
    others = [k for k, target in enumerate(targets) if target != chosen]
    value = float(values[place])
    if not others:
        return Preference(observation.brigade, int(ids[chosen]), value, assigned=assigned)
    other = min(others, key=lambda k: (-values[k], k))
    of_chosen, of_other = seen[place, reads], seen[other, reads]
    parts = _parts(of_chosen, of_other, layers, activations)
    shares = [
        FeatureShare(SEEN[feature], float(one), float(two), float(part))
        for feature, one, two, part in zip(reads, of_chosen, of_other, parts, strict=True)
    ]
    return Preference(
        observation.brigade,
        int(ids[chosen]),
        value,
        int(ids[targets[other]]),
        float(values[other]),
        tuple(sorted(shares, key=lambda share: -abs(share.part))),
        assigned,
    )


def _options(observation: Observation, *, own_targets: bool) -> tuple[list[int], Array]:
    """Return the targets among which a team chooses, and what the brigade sees of each, (k, 30)."""
    city, world = observation.city, observation.world
    burning, seen = seen_targets(observation)
    if own_targets:
        return burning, seen
    where = world.brigades, city.buildings, world.fire, city.geometry, world.sites
    named = [int(find_target(observation.brigade, action, *where)) for action in range(len(ACTIONS))]
    of_actions = seen[[burning.index(target) for target in named]]
    for action in range(len(ACTIONS)):
        of_actions[action, N_TARGET_FEATURES + action] = 1.0
    return named, of_actions


def _as_layers(team: RankingTeam | NetworkTeam, brigade: int) -> tuple[list[int], Sequence[Layer], Sequence[str]]:
    """Return which features a brigade of a team reads, and the layers that make a value of them."""
    if isinstance(team, NetworkTeam):
        return [SEEN.index(name) for name in team.features], team.layers, team.activations
    n = len(team.counted)
    return [*range(n)], [Layer(team.weights[brigade % len(team.weights), :n, np.newaxis], np.zeros(1))], ()


def _value(seen: Array, layers: Sequence[Layer], activations: Sequence[str]) -> Array:
    """Return the values of targets, (k,); `seen` is (k, features)."""
    outputs: Array = _outputs(seen, layers, activations)[-1][:, 0]
    return outputs


def _outputs(seen: Array, layers: Sequence[Layer], activations: Sequence[str]) -> list[Array]:
    """Return what goes into the first layer, and what comes out of each."""
    found = [seen]
    for (weights, biases), activation in zip(layers, [*activations, ""], strict=True):
        result = found[-1] @ weights + biases
        found.append(np.maximum(result, 0.0) if activation == "relu" else np.tanh(result) if activation else result)
    return found


def _parts(chosen: Array, other: Array, layers: Sequence[Layer], activations: Sequence[str]) -> Array:
    """Return what each feature, (features,), adds to the value of the one target over that of the other."""
    along = (np.arange(N_POINTS)[:, np.newaxis] + 0.5) / N_POINTS
    outputs = _outputs(other + along * (chosen - other), layers, activations)
    slope = np.ones((N_POINTS, 1))
    for k in reversed(range(len(layers))):
        if k < len(activations):
            after = outputs[k + 1]
            slope = slope * ((after > 0.0) if activations[k] == "relu" else 1.0 - after * after)
        slope = slope @ layers[k].weights.T
    parts: Array = (chosen - other) * slope.mean(axis=0)
    return parts
