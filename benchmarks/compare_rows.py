"""Rows of comparing two policies: the whole command, and its runs against runs step by step from Python."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Final

from benchmarks.start_rows import IMPORT_NUMBA, process_row
from benchmarks.timing import Contender, Row, compare
from fireworld.evaluation.runs import evaluate, run_step_by_step
from fireworld.executors import threads
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import BUILT_IN
from fireworld.scenario import load_scenario
from fireworld.simulation.built import BuiltScenario, build_scenario

POLICIES: Final = ("chief", "nearest-to-civilian")
SCENARIO: Final = "test-2"
"""Both put it out: neither runs to the last step."""
N_THREADS: Final = 2


def step_by_step(built: BuiltScenario, policies: tuple[KernelPolicy, ...], seeds: range, _: None) -> None:
    """Ask the policies in every step."""
    for policy in policies:
        for seed in seeds:
            run_step_by_step(built, policy, seed=seed)


def compiled(built: BuiltScenario, policies: tuple[KernelPolicy, ...], seeds: range, _: None) -> None:
    """Run whole episodes in compiled code."""
    for policy in policies:
        evaluate(built, policy, seeds, workers=threads(N_THREADS))


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of comparing."""
    seeds = range(1, 3 if quick else 21)
    words = f"compare {' '.join(POLICIES)} --seeds {2 if quick else 100}"
    yield replace(process_row(words, IMPORT_NUMBA, seconds=1.0 if quick else 40.0), group="compare")
    built = build_scenario(load_scenario(SCENARIO))
    contenders = [
        Contender(name, partial(run, built, tuple(BUILT_IN[name]() for name in POLICIES), seeds), parts=2 * len(seeds))
        for name, run in ((f"compiled, {N_THREADS} threads", compiled), ("World.step", step_by_step))
    ]
    yield compare(
        "compare",
        f"one run of {SCENARIO}",
        f"{built.city.n_buildings} buildings",
        contenders[0],
        contenders[1],
        seconds=1.0 if quick else 20.0,
    )
