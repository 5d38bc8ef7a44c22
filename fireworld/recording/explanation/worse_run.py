"""The worse of two runs, to be replayed again and again with some decisions of the better one in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from fireworld.errors import LogError, expected
from fireworld.kernels.arrays import PolicyArrays, WorldState
from fireworld.policy.asking import begin
from fireworld.policy.kernel import KernelPolicy, always
from fireworld.policy.protocol import Action, Decision, Policy
from fireworld.recording.decisions import ComparedPolicy, RecordedDecisions, ToldPolicy, check_same_luck
from fireworld.recording.explanation.stretches import Stretch, holding
from fireworld.recording.resume import has_memory
from fireworld.records import Recording, RunHeader, StepRecord
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.state import copy_into, copy_world
from fireworld.simulation.world import World

KEPT_EVERY_STEPS: Final = 10
"""States of the worse run that are kept, so that a replay need not begin at step 0."""

MakePolicy = Callable[[], Policy]


def check_comparable(
    headers: tuple[RunHeader, RunHeader], lasts: Sequence[StepRecord | None], *, names: tuple[str, str]
) -> None:
    """Refuse two runs whose scores cannot be held against each other.

    Args:
        headers: of the runs.
        lasts: their last steps; None of a run without a step.
        names: their files.

    Raises:
        LogError: another scenario, seed or last step, or one that stopped before its end.
    """
    first, second = headers
    check_same_luck(first, second, names=names)
    if first.n_steps_max != second.n_steps_max:
        wanted = f"at most {first.n_steps_max}, as in {names[0]}"
        raise LogError(expected(names[1], "steps", wanted, f"at most {second.n_steps_max}"))
    for last, name in zip(lasts, names, strict=True):
        if last is None or not (last.terminated or last.truncated):
            got = f"one that stopped at step {last.step}" if last is not None else "one without a step"
            hint = f"`fireworld fork {name} --at {last.step} --record FILE` goes on with it" if last is not None else ""
            raise LogError(expected(name, "", "a run that has reached its end", got, hint))


@dataclass(frozen=True)
class WorseRun:
    """The worse run, ready to be replayed with other decisions; from several threads, if it is compiled.

    Attributes:
        built: its scenario, built.
        seed: of its luck.
        n_steps_max: its last step at most.
        recorded: its decisions.
        better: those of the better run.
        make_policy: makes its policy, for what comes after other decisions; None: the recorded decisions go on.
        orders: recorded decisions, by (step, brigade), that are not the policy's own, as in a fork: they stand.
        kept: states after some of its steps, by step.
    """

    built: BuiltScenario
    seed: int
    n_steps_max: int
    recorded: RecordedDecisions
    better: RecordedDecisions
    make_policy: MakePolicy | None
    orders: Mapping[tuple[int, int], Decision]
    kept: Mapping[int, WorldState]

    @property
    def n_brigades(self) -> int:
        """Brigades of the team."""
        return len(self.built.placement.brigade_refuge)

    @property
    def compiled(self) -> bool:
        """Whether replays run in compiled code."""
        return self.make_policy is not None and self._can_compile(self.make_policy())

    def _can_compile(self, policy: Policy) -> bool:
        # A compiled team that commits itself would not drop its choice for what it is told.
        return isinstance(policy, KernelPolicy) and policy.commit == 1 and not self.orders

    def score(self, told: Sequence[Stretch]) -> float:
        """Return the score at the end of the run with the brigades told what to do in some stretches.

        Raises:
            PolicyError: the policy fails.
        """
        policy = self.make_policy() if self.make_policy is not None else self.recorded
        first = min(stretch.first for stretch in told)
        world = self._world_before(0 if has_memory(policy) else first)
        own_targets = any(stretch.action == Action.OWN_TARGET for stretch in told)
        if isinstance(policy, KernelPolicy) and self._can_compile(policy) and not own_targets:
            _run_compiled(world, policy, told)
        else:
            self._run_stepwise(world, policy, told)
        return float(world.state.outcome.score[0])

    def _world_before(self, step: int) -> World:
        """Return the world as it was at the last kept state before a step, at the latest."""
        world = self.built.world(seed=self.seed, n_steps_max=self.n_steps_max)
        start = max((kept for kept in self.kept if kept < step), default=0)
        if start:
            copy_into(world.state, self.kept[start])
            world.step_number = start
        return world

    def _run_stepwise(self, world: World, policy: Policy, told: Sequence[Stretch]) -> None:
        def order(brigade: int, step: int) -> Decision | None:
            stretch = holding(told, brigade, step)
            if stretch is None:
                return self.orders.get((step, brigade))
            return self.better.at(step, brigade) if stretch.action == Action.OWN_TARGET else Decision(stretch.action)

        begin(policy, world.city_arrays, n_brigades=world.n_brigades, seed=world.seed)
        decider = ToldPolicy(policy, order)
        while not (world.terminated or world.truncated):
            world.step(decider)


def prepare_worse_run(
    built: BuiltScenario, recording: Recording, better: RecordedDecisions, make_policy: MakePolicy | None
) -> WorseRun:
    """Walk once through a recorded run, keep states of it, and see which of its decisions are its policy's own.

    Args:
        built: its scenario, built.
        recording: the run.
        better: decisions of the better run.
        make_policy: makes its policy anew; None if it cannot be had.

    Raises:
        PolicyError: the policy fails.
    """
    header, recorded = recording.header, RecordedDecisions(recording)
    world = built.world(seed=header.seed, n_steps_max=header.n_steps_max)
    decider: Policy = recorded
    if make_policy is not None:
        policy = make_policy()
        begin(policy, world.city_arrays, n_brigades=world.n_brigades, seed=world.seed)
        decider = ComparedPolicy(recorded, policy)
    kept = {}
    while not (world.terminated or world.truncated):
        world.step(decider)
        if world.step_number % KEPT_EVERY_STEPS == 0:
            kept[world.step_number] = copy_world(world.state)
    others = decider.others if isinstance(decider, ComparedPolicy) else {}
    return WorseRun(
        built=built,
        seed=header.seed,
        n_steps_max=header.n_steps_max,
        recorded=recorded,
        better=better,
        make_policy=make_policy,
        orders={place: made for place, (made, _) in others.items()},
        kept=kept,
    )


def _run_compiled(world: World, policy: KernelPolicy, told: Sequence[Stretch]) -> None:
    """Run to the end, compiled, in pieces within which nobody's orders change."""
    tables, end = policy.for_brigades(world.n_brigades), world.n_steps_max
    for last in sorted({stretch.first - 1 for stretch in told} | {stretch.last for stretch in told} | {end}):
        if world.step_number < last:
            world.n_steps_max = last
            world.run(_with_orders(tables, told, step=last))
    world.n_steps_max = end


def _with_orders(tables: PolicyArrays, told: Sequence[Stretch], *, step: int) -> PolicyArrays:
    """Return a policy in which the brigades told so in a step always take one action."""
    kind, action = tables.kind.copy(), tables.action.copy()
    for brigade in range(len(kind)):
        stretch = holding(told, brigade, step)
        if stretch is not None:
            fixed = always(stretch.action).for_brigades(1)
            kind[brigade], action[brigade] = fixed.kind[0], fixed.action[0]
    return tables._replace(kind=kind, action=action)
