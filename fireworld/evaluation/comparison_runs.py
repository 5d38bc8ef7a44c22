"""The runs of a comparison: which are missing, who makes them, and where they are kept."""

from __future__ import annotations

import copy
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from threading import Event
from typing import Any, Final

from fireworld.errors import PolicyError
from fireworld.evaluation.results import Result, Results, RunKey
from fireworld.evaluation.runs import Outcomes, Row, row_of, run_compiled, run_step_by_step
from fireworld.executors import AnyExecutor, Workers, in_this_process, n_cores, processes, threads, workers_for
from fireworld.interrupt import Interrupted
from fireworld.policy.asking import describe
from fireworld.policy.importing import make_policy
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import NamedPolicy, find_policy
from fireworld.policy.protocol import Policy
from fireworld.simulation.built import BuiltScenario
from fireworld.version import simulator_version

SAVE_EVERY_RUNS: Final = 100
RUNS_WORTH_A_PROCESS: Final = 8  # a process takes about as long to start as these


@dataclass(frozen=True)
class RunnablePolicy:
    """A policy of a comparison."""

    given: Any
    """What it is made of, anew for every run; of a policy that runs in compiled code, the policy itself."""
    named: NamedPolicy  # made once
    name: str  # as it was asked for: two team files may have one name in two folders
    key: str  # its identity; where there is none, its place among the policies


def runnable(given: Any, place: int) -> RunnablePolicy:
    """Find a policy by its name, file, class, object, or function; errors as for `find_policy`."""
    named = find_policy(given)
    name = str(given) if isinstance(given, str | os.PathLike) else named.name
    if isinstance(named.policy, KernelPolicy):
        given = named.policy
    elif named.thing is not None:
        given = OwnPolicy(named.thing, named.parameters, f"--policy: {named.name}")
    return RunnablePolicy(
        given=given,
        named=named,
        name=name,
        key=named.identity or f"policy {place}",
    )


def runnable_policies(policies: Sequence[Any], executor: AnyExecutor, *, kept: bool) -> list[RunnablePolicy]:
    """Find policies, and check that they can be run by an executor and, if they are `kept`, named in a results file.

    Raises:
        PolicyError, TrainingError: a policy that cannot be found, made, named in results or sent to processes.
        ExecutorError: an executor that is none.
    """
    workers_for(executor)
    found = [runnable(given, place) for place, given in enumerate(policies)]
    for policy in found:
        if kept:
            policy.named.require_identity("results")
        if not in_this_process(executor):
            policy.named.require_found_again("executor")
    return found


@dataclass(frozen=True)
class PolicyRun:
    """A run to be made, here or in another process."""

    built: BuiltScenario
    label: str  # the scenario as errors name it
    policy: Any
    seed: int

    def __call__(self) -> Row:
        """Run; PolicyError if the policy fails."""
        if isinstance(self.policy, KernelPolicy):
            return row_of(run_compiled(self.built, self.policy, seed=self.seed))
        try:
            return row_of(run_step_by_step(self.built, _made(self.policy), seed=self.seed))
        except PolicyError as error:
            raise PolicyError(f"{self.label}, seed {self.seed}: {error}") from error


@dataclass(frozen=True)
class OwnPolicy:
    """A policy of a user's own that was named: what its name led to, and how it is made of that."""

    thing: Any
    parameters: Mapping[str, Any]
    where: str  # what errors call it

    def make(self) -> Policy:
        """Make it anew; PolicyError if it cannot be made."""
        return make_policy(_copied(self.thing), self.parameters, where=self.where)


@dataclass(frozen=True)
class ComparisonRuns:
    """All runs of a comparison."""

    policies: Sequence[RunnablePolicy]
    built: Mapping[str, BuiltScenario]
    seeds: Sequence[int]
    results: Results
    missing: dict[RunKey, tuple[RunnablePolicy, Result, PolicyRun]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for policy in self.policies:
            for label, built in self.built.items():
                result = Result(built.scenario.name or label, policy.named.name, ())
                for key in self._keys(policy, built):
                    if not self.results.has(key):
                        self.missing[key] = policy, result, PolicyRun(built, label, policy.given, key.seed)

    def make(self, executor: AnyExecutor, stop: Event, on_run: Callable[[int, int], object]) -> None:
        """Make the runs that are missing; what is done is saved, whatever happens. Interrupted if some are left."""
        n_all = len({policy.key for policy in self.policies}) * len(self.built) * len(self.seeds)
        n_known, n_done = n_all - len(self.missing), 0
        on_run(n_known, n_all)

        def keep(key: RunKey, result: Result) -> None:
            nonlocal n_done
            n_done += 1
            self.results.add(key, result)
            if self.results.n_unsaved >= SAVE_EVERY_RUNS:
                self.results.save()
            on_run(n_known + n_done, n_all)

        how = "interrupted"
        try:
            if all(self._make(keys, workers, keep) for keys, workers in self._shares(executor, stop)):
                return
        except KeyboardInterrupt:
            how = "interrupted within a run"
        finally:
            self.results.save()
        path = self.results.path
        kept = f"they are kept in {path}" if path is not None else "with --results they would have been kept"
        raise Interrupted(f"{how}; {n_done} of {len(self.missing)} runs were done: {kept}")

    def outcomes(self, policy: RunnablePolicy) -> dict[str, Outcomes]:
        """Return how a policy's runs came out, by scenario; all of them must be known."""
        known = self.results.by_run
        return {
            label: Outcomes(self.seeds, [known[key].row for key in self._keys(policy, built)])
            for label, built in self.built.items()
        }

    def _keys(self, policy: RunnablePolicy, built: BuiltScenario) -> list[RunKey]:
        digest, version = built.scenario.digest, simulator_version()
        return [RunKey(digest, policy.key, seed, version) for seed in self.seeds]

    def _make(self, keys: list[RunKey], workers: Workers, keep: Callable[[RunKey, Result], object]) -> bool:
        tasks = [self.missing[key][2] for key in keys]
        known = [(key, self.missing[key][1]) for key in keys]
        return workers.run(tasks, lambda k, row: keep(known[k][0], replace(known[k][1], row=row))) is not None

    def _shares(self, executor: AnyExecutor, stop: Event) -> Iterator[tuple[list[RunKey], Workers]]:
        """Share the runs out to those who make them; Python code does not run side by side in threads."""
        anywhere, sent, here = list[RunKey](), list[RunKey](), list[RunKey]()
        chosen = not (executor is None or isinstance(executor, int))
        for key, (policy, _, _) in self.missing.items():
            if chosen or isinstance(policy.given, KernelPolicy):
                anywhere.append(key)
            else:
                (sent if policy.named.can_be_found_again else here).append(key)
        yield anywhere, workers_for(executor, stop=stop)
        n = min(executor if isinstance(executor, int) else _n_processes(), len(sent) // RUNS_WORTH_A_PROCESS)
        yield sent, processes(n, stop=stop) if n > 1 else threads(1, stop=stop)
        yield here, threads(1, stop=stop)


def _n_processes() -> int:
    """Return how many processes are used unasked: none where starting them would run a script of the user's again."""
    return n_cores() if not hasattr(sys.modules["__main__"], "__file__") else 1


def _copied(policy: Any) -> Any:
    """Return a copy of an object, so that nothing it remembers gets from run to run; a class or a name stays itself."""
    try:
        return copy.deepcopy(policy)
    except Exception as error:
        raise PolicyError(f"policy: {type(policy).__name__} cannot be copied: {describe(error)}") from error


def _made(given: Any) -> Policy:
    """Make a policy for a run."""
    return given.make() if isinstance(given, OwnPolicy) else find_policy(_copied(given)).policy
