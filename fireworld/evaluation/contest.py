"""All runs of a comparison: those that are known are taken from the results, the others made, side by side."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import partial
from threading import Event
from typing import Final

from fireworld.errors import PolicyError
from fireworld.evaluation.results import Archive, Result, RunKey, policy_identity, simulator_version
from fireworld.evaluation.runs import Outcomes, Row, outcomes, run_compiled, run_step_by_step
from fireworld.executors import Workers
from fireworld.files import write_file
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import NamedPolicy, load_policy
from fireworld.scenario import Scenario
from fireworld.simulation.built import BuiltScenario, build_scenario

SAVE_EVERY_RUNS: Final = 100
RUNS_WORTH_A_PROCESS: Final = 8
"""A process takes about as long to start as these."""


@dataclass(frozen=True)
class AskedRun:
    """A run in which the policy is asked in every step; can be sent to a process of its own."""

    scenario: Scenario
    label: str
    policy: str
    seed: int

    def __call__(self) -> Row:
        """Run with a policy made anew, as `fireworld run` does: what it kept of another run must not count.

        Raises:
            PolicyError: the policy failed.
        """
        try:
            return run_step_by_step(_stage(self.scenario), load_policy(self.policy).policy, seed=self.seed)
        except PolicyError as error:
            raise PolicyError(f"{self.label}, seed {self.seed}: {error}") from error


@dataclass(frozen=True)
class Contestant:
    """A policy as it was asked for: two team files may bear one name in two folders."""

    text: str
    named: NamedPolicy
    identity: str


Runs = dict[RunKey, tuple[Result, Callable[[], Row]]]
"""Runs to be made: what is known of each before, and what makes it."""


@dataclass(frozen=True)
class Contest:
    """Two policies, A and B, in the same scenarios, on the same seeds.

    Attributes:
        stages: the scenarios, by the names they were asked for.
        contestants: A and B.
        seeds: of the runs' luck.
        archive: what is known already; every run is added to it.
        jobs: runs at a time.
    """

    stages: Mapping[str, BuiltScenario]
    contestants: tuple[Contestant, Contestant]
    seeds: Sequence[int]
    archive: Archive
    jobs: int

    @property
    def same_policy(self) -> bool:
        """Whether A and B are one policy, whatever it is called."""
        return self.contestants[0].identity == self.contestants[1].identity

    @property
    def n_runs(self) -> int:
        """Runs in all; a policy compared with itself makes them once."""
        return len(self.stages) * len(self.seeds) * (1 if self.same_policy else 2)

    def missing(self) -> tuple[Runs, Runs]:
        """Return the runs that are not known yet: those of compiled episodes, and those that ask in every step."""
        compiled: Runs = {}
        asked: Runs = {}
        for contestant in self.contestants:
            policy = contestant.named.policy
            for label, built in self.stages.items():
                result = Result(built.scenario.name or label, contestant.named.name, ())
                for key in self._keys(contestant, built):
                    if key in self.archive.results:
                        continue
                    if isinstance(policy, KernelPolicy):
                        compiled[key] = result, partial(run_compiled, built, policy, seed=key.seed)
                    else:
                        asked[key] = result, AskedRun(built.scenario, label, contestant.text, key.seed)
        return compiled, asked

    def carry_out(self, stop: Event, on_run: Callable[[], object]) -> bool:
        """Make the missing runs; what is done is saved, whatever happens. False if stopped before the last.

        Args:
            stop: set it, and no further run begins.
            on_run: called after every run.

        Raises:
            PolicyError: a policy failed.
            OutputError: the results cannot be written.
        """
        compiled, asked = self.missing()
        _STAGES.update({built.scenario.digest: built for built in self.stages.values()})
        try:
            for runs, workers in ((compiled, Workers(self.jobs, stop)), (asked, self._for_asked(len(asked), stop))):
                if not self._make(runs, workers, on_run):
                    return False
        except BrokenProcessPool:
            raise PolicyError("--jobs: a process that ran a policy died; try --jobs 1") from None
        finally:
            self.save()
        return True

    def outcomes(self, contestant: Contestant) -> dict[str, Outcomes]:
        """Return how a policy's runs ended, by scenario; all of them must be known."""
        results = self.archive.results
        return {
            label: outcomes(self.seeds, [results[key].row for key in self._keys(contestant, built)])
            for label, built in self.stages.items()
        }

    def save(self) -> None:
        """Write the results, beside and renamed, if there is anything new and a file for it.

        Raises:
            OutputError: the file cannot be written.
        """
        if self.archive.path is not None and self.archive.n_unsaved:
            write_file(self.archive.path, self.archive.to_bytes())
            self.archive.n_unsaved = 0

    def _keys(self, contestant: Contestant, built: BuiltScenario) -> list[RunKey]:
        digest, version = built.scenario.digest, simulator_version()
        return [RunKey(digest, contestant.identity, seed, version) for seed in self.seeds]

    def _make(self, runs: Runs, workers: Workers, on_run: Callable[[], object]) -> bool:
        known = [(key, result) for key, (result, _) in runs.items()]

        def keep(number: int, row: Row) -> None:
            key, result = known[number]
            self.archive.add(key, replace(result, row=row))
            if self.archive.n_unsaved >= SAVE_EVERY_RUNS:
                self.save()
            on_run()

        return workers.run([task for _, task in runs.values()], keep) is not None

    def _for_asked(self, n_runs: int, stop: Event) -> Workers:
        """Return processes where there are enough runs for them: Python code does not run side by side in threads."""
        n = min(self.jobs, n_runs // RUNS_WORTH_A_PROCESS)
        return Workers(n, stop, _processes) if n > 1 else Workers(1, stop)


def enter(text: str) -> Contestant:
    """Find a policy; errors as for `load_policy`."""
    named = load_policy(text)
    return Contestant(text, named, policy_identity(named))


_STAGES: Final[dict[str, BuiltScenario]] = {}
"""Stages of this process, by the digest of their scenario: those that it was given, and those that it had to build."""


def _stage(scenario: Scenario) -> BuiltScenario:
    if scenario.digest not in _STAGES:
        _STAGES[scenario.digest] = build_scenario(scenario)
    return _STAGES[scenario.digest]


def _processes(n: int) -> Executor:
    """Make processes that begin afresh (a copy of one with threads may hang) and leave Ctrl-C to this one."""
    fresh = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(n, mp_context=fresh, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN))
