"""Runs of one policy in one scenario under many seeds: the one way in which policies are measured."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any, Final, get_type_hints

import numpy as np

from fireworld.executors import Workers
from fireworld.files import same_folder
from fireworld.interrupt import Interrupted
from fireworld.kernels.arrays import Array
from fireworld.outcome import COLUMNS, Outcome
from fireworld.policy.asking import begin, changed_its_world
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.protocol import Decision, Observation, Policy
from fireworld.simulation.built import BuiltScenario

Row = tuple[Any, ...]  # how one run came out: COLUMNS in their order
KINDS: Final[dict[str, type]] = {name: get_type_hints(Outcome)[attribute] for name, attribute in COLUMNS.items()}
"""The Python type of each column: int, float or bool."""


@dataclass(frozen=True, eq=False)
class Outcomes:
    """How runs came out, one for each seed.

    Every attribute of `Outcome` that follows from COLUMNS is an attribute here too: an array of shape (n_seeds,), with
    nan where the run has none.
    """

    seeds: Sequence[int]
    rows: Sequence[Row]

    def __getattr__(self, name: str) -> Array:
        """Return an attribute of all runs' outcomes."""
        for place, (column, attribute) in enumerate(COLUMNS.items()):
            if attribute == name:
                return np.array([row[place] for row in self.rows], dtype=KINDS[column])
        derived = getattr(Outcome, name, None)
        if not isinstance(derived, property) or derived.fget is None:
            raise AttributeError(name)
        runs = (SimpleNamespace(**dict(zip(COLUMNS.values(), row, strict=True))) for row in self.rows)
        return np.array([derived.fget(run) for run in runs], dtype=np.float64)


def evaluate(
    built: BuiltScenario, policy: KernelPolicy, seeds: Sequence[int], *, workers: Workers | None = None
) -> Outcomes:
    """Run a policy once under every seed; policies measured on the same seeds see the same random draws.

    Without workers it is this thread that runs them; Interrupted if workers were asked to stop.
    """
    return evaluate_each([(built, policy)], seeds, workers=workers)[0]


def evaluate_each(
    measured: Sequence[tuple[BuiltScenario, KernelPolicy]],
    seeds: Sequence[int],
    *,
    workers: Workers | None = None,
    on_run: Callable[[], object] = lambda: None,
) -> list[Outcomes]:
    """Run several policies, each in its scenario, as `evaluate` does.

    Workers share all of the runs, and call `on_run` after each.
    """
    tasks = [partial(run_compiled, built, policy, seed=seed) for built, policy in measured for seed in seeds]
    found = [task() for task in tasks] if workers is None else workers.run(tasks, lambda *_: on_run())
    if found is None:
        raise Interrupted("interrupted")
    rows = [row_of(outcome) for outcome in found]
    return [Outcomes(seeds, rows[first : first + len(seeds)]) for first in range(0, len(rows), len(seeds))]


def run_compiled(built: BuiltScenario, policy: KernelPolicy, *, seed: int) -> Outcome:
    """Run a policy that the kernels can follow as one compiled episode."""
    world = built.world(seed=seed)
    world.run(policy.for_brigades(world.n_brigades))
    return world.outcome


def run_step_by_step(built: BuiltScenario, policy: Policy, *, seed: int) -> Outcome:
    """Run any policy by asking it in every step; PolicyError if it fails, or if it does more than decide.

    Its decisions alone, in a world that it has never seen, must lead to the same outcome.
    """
    world, before = built.world(seed=seed), _checksum(built)
    made = []
    with same_folder():
        begin(policy, world.city_arrays, n_brigades=world.n_brigades, seed=seed)
        while not (world.terminated or world.truncated):
            made.append(world.step(policy).decisions)
    again, decided = built.world(seed=seed), _Decided(made)
    while not (again.terminated or again.truncated):
        again.step(decided)
    if row_of(again.outcome) != row_of(world.outcome) or _checksum(built) != before:
        raise changed_its_world(policy, seed)
    return world.outcome


class _Decided(Policy):
    """Decides as was decided."""

    def __init__(self, made: Sequence[Sequence[Decision]]) -> None:
        self._made = made

    def decide(self, observation: Observation) -> Decision:
        """Return what was decided; anything where nothing was: there the outcomes differ anyway."""
        step = observation.step - 1
        made = self._made[step][observation.brigade] if step < len(self._made) else Decision(-1)
        return made if made.action >= 0 else Decision(0)


def _checksum(built: BuiltScenario) -> int:
    """Return a checksum of the city's arrays, which all runs share."""

    def update(value: Any, checksum: int) -> int:
        if isinstance(value, np.ndarray):
            return zlib.crc32(np.ascontiguousarray(value).data, checksum) if value.size else checksum
        for part in value if isinstance(value, tuple) else ():
            checksum = update(part, checksum)
        return checksum

    return update(built.city_arrays, 0)


def row_of(outcome: Outcome) -> Row:
    """Return what is stored of an outcome."""
    return tuple(getattr(outcome, attribute) for attribute in COLUMNS.values())
