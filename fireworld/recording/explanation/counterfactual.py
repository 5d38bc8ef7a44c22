"""The worse of two runs, to be replayed again and again with some decisions of the better one in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from fireworld.kernels.arrays import PolicyArrays, WorldState
from fireworld.policy.asking import begin
from fireworld.policy.kernel import KernelPolicy, always
from fireworld.policy.protocol import Action, Decision, Policy
from fireworld.recording.decisions import ForcedPolicy, RecordedDecisions, ShadowPolicy
from fireworld.recording.explanation.spans import DecisionSpan, span_at
from fireworld.records import Steps
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.state import copy_into, copy_world, named_arrays
from fireworld.simulation.world import World

STATE_EVERY_STEPS: Final = 10
"""Steps from one saved state of the worse run to the next; a replay begins at one of them. More in a large city."""
STATE_BYTES_MAX: Final = 512 << 20
"""What all saved states take."""

MakePolicy = Callable[[], Policy]


@dataclass(frozen=True)
class CounterfactualRun:
    """The worse run, ready to be replayed with other decisions; from several threads, if it is compiled.

    Attributes:
        built: its scenario, built.
        seed: of its random draws.
        n_steps_max: its last step at most.
        recorded: its decisions.
        better: those of the better run.
        make_policy: makes its policy, for what comes after other decisions; None: the recorded decisions continue.
        forced: recorded decisions, by (step, brigade), that are not the policy's own, as in a fork; they stay.
        states: after some of its steps, by step.
    """

    built: BuiltScenario
    seed: int
    n_steps_max: int
    recorded: RecordedDecisions
    better: RecordedDecisions
    make_policy: MakePolicy | None
    forced: Mapping[tuple[int, int], Decision]
    states: Mapping[int, WorldState]

    @property
    def compiled(self) -> bool:
        """Whether replays run in compiled code."""
        return self.make_policy is not None and self._can_compile(self.make_policy())

    def _can_compile(self, policy: Policy) -> bool:
        # A compiled team that commits itself would not drop its choice for a forced decision.
        return isinstance(policy, KernelPolicy) and policy.commit == 1 and not self.forced

    def score(self, spans: Sequence[DecisionSpan]) -> float:
        """Return the score at the end of the run with the decisions of some spans forced.

        Raises:
            PolicyError: the policy fails.
        """
        policy = self.make_policy() if self.make_policy is not None else self.recorded
        first = min(span.first for span in spans)
        world = self._world_before(first if policy.stateless else 0)
        own_targets = any(span.action == Action.OWN_TARGET for span in spans)
        if isinstance(policy, KernelPolicy) and self._can_compile(policy) and not own_targets:
            _run_compiled(world, policy, spans)
        else:
            self._run_stepwise(world, policy, spans)
        return world.outcome.score

    def _world_before(self, step: int) -> World:
        """Return the world at the last saved state before a step, at the latest."""
        world = self.built.world(seed=self.seed, n_steps_max=self.n_steps_max)
        start = max((saved for saved in self.states if saved < step), default=0)
        if start:
            copy_into(world.state, self.states[start])
            world.step_number = start
        return world

    def _run_stepwise(self, world: World, policy: Policy, spans: Sequence[DecisionSpan]) -> None:
        def forced(brigade: int, step: int) -> Decision | None:
            span = span_at(spans, brigade, step)
            if span is None:
                return self.forced.get((step, brigade))
            return self.better.at(step, brigade) if span.action == Action.OWN_TARGET else Decision(span.action)

        begin(policy, world.city_arrays, n_brigades=world.n_brigades, seed=world.seed)
        decider = ForcedPolicy(policy, forced)
        while not (world.terminated or world.truncated):
            world.step(decider)


def prepare_counterfactuals(
    built: BuiltScenario, worse: Steps, better: RecordedDecisions, make_policy: MakePolicy | None
) -> CounterfactualRun:
    """Replay a recorded run once, to save states of it and to see which of its decisions are its policy's own.

    Args:
        built: its scenario, built.
        worse: the run.
        better: decisions of the better run.
        make_policy: makes its policy anew; None if that is not possible.

    Raises:
        PolicyError: the policy fails.
    """
    header, recorded = worse.header, RecordedDecisions(worse)
    world = built.world(seed=header.seed, n_steps_max=header.n_steps_max)
    decider: Policy = recorded
    if make_policy is not None:
        policy = make_policy()
        begin(policy, world.city_arrays, n_brigades=world.n_brigades, seed=world.seed)
        decider = ShadowPolicy(recorded, policy)
    states = {}
    n_bytes = sum(array.nbytes for _, array in named_arrays(world.state))
    every = max(STATE_EVERY_STEPS, -(-n_bytes * world.n_steps_max // STATE_BYTES_MAX))
    while not (world.terminated or world.truncated):
        world.step(decider)
        if world.step_number % every == 0:
            states[world.step_number] = copy_world(world.state)
    others = decider.disagreements if isinstance(decider, ShadowPolicy) else {}
    return CounterfactualRun(
        built=built,
        seed=header.seed,
        n_steps_max=header.n_steps_max,
        recorded=recorded,
        better=better,
        make_policy=make_policy,
        forced={place: made for place, (made, _) in others.items()},
        states=states,
    )


def _run_compiled(world: World, policy: KernelPolicy, spans: Sequence[DecisionSpan]) -> None:
    """Run to the end, compiled, in pieces within which the forced decisions do not change."""
    arrays, end = policy.for_brigades(world.n_brigades), world.n_steps_max
    for last in sorted({span.first - 1 for span in spans} | {span.last for span in spans} | {end}):
        if world.step_number < last:
            world.n_steps_max = last
            world.run(_with_forced(arrays, spans, step=last))
    world.n_steps_max = end


def _with_forced(arrays: PolicyArrays, spans: Sequence[DecisionSpan], *, step: int) -> PolicyArrays:
    """Return a policy in which brigades with a forced decision in a step always take that action."""
    kind, action = arrays.kind.copy(), arrays.action.copy()
    for brigade in range(len(kind)):
        span = span_at(spans, brigade, step)
        if span is not None:
            fixed = always(span.action).for_brigades(1)
            kind[brigade], action[brigade] = fixed.kind[0], fixed.action[0]
    return arrays._replace(kind=kind, action=action)
