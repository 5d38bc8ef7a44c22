"""`compare`: policies on the same scenarios and seeds; known runs come from a results file, the others are made."""

from __future__ import annotations

import copy
import math
import os
import pickle
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from threading import Event
from typing import Any, Final

from fireworld.arguments import SEED_MAX, ArgumentError, path_of, seed_of, settings_of, whole_number
from fireworld.errors import PolicyError, ScenarioError, expected
from fireworld.evaluation.comparison import ComparedPolicy, Comparison, find_metric
from fireworld.evaluation.paired import compare_outcomes
from fireworld.evaluation.results import Result, Results, RunKey, open_results, simulator_version
from fireworld.evaluation.runs import Outcomes, Row, outcomes, row_of, run_compiled, run_step_by_step
from fireworld.executors import AnyExecutor, Workers, in_processes, n_cores, processes, threads, workers_for
from fireworld.interrupt import Interrupted, gentle_interrupt
from fireworld.policy.asking import describe
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import NamedPolicy, load_policy, note_on_team
from fireworld.scenario import Scenario, load_scenario
from fireworld.simulation.built import BuiltScenario, CityCache, build_scenario

TESTS: Final = ("test-1", "test-2", "test-3")
N_SEEDS: Final = 100
SAVE_EVERY_RUNS: Final = 100
RUNS_WORTH_A_PROCESS: Final = 8
"""A process takes about as long to start as these."""


def compare(
    policies: Sequence[Any],
    *,
    scenarios: Sequence[str | Path | Scenario] | str | Path | Scenario = TESTS,
    seeds: int | Sequence[int] = N_SEEDS,
    first_seed: int = 1,
    set: Mapping[str, Any] | None = None,
    executor: AnyExecutor = None,
    results: Path | str | None = None,
    metric: str = "score",
    margin: float = 0.0,
    on_run: Callable[[int, int], object] = lambda *_: None,
    stop: Event | None = None,
) -> Comparison:
    """Compare policies with the first of them, run by run on the same scenarios and seeds.

    Every policy begins every run anew: a class is made again, an object is copied. So the runs are those of
    `fw.run(scenario, policy=..., seed=...)`, and do not depend on the executor.

    Args:
        policies: two or more: the reference (A), and those compared with it (each of them B). Names, files, classes,
            objects, or functions of an observation.
        scenarios: names, files or Scenario objects.
        seeds: how many seeds, or which.
        first_seed: the first, where only their number is given.
        set: values of scenario keys, as in {"brigades.n": 7}; of all scenarios.
        executor: who makes the runs. None: all cores, in threads for policies that run in compiled code, in processes
            for others that processes can find again; a number: as many at a time, likewise; "threads" or "processes":
            all of them in these; or an executor of concurrent.futures.
        results: a file (.parquet) to take known runs from, and to add the others to.
        metric: what the judgement is about: "score", "burnt-out", "time" or "civilians".
        margin: a loss that does not matter, in the metric's unit.
        on_run: called with the number of runs that are done or known, and of all: once before the first, and after
            every run.
        stop: set it, and no further run begins.

    Raises:
        ArgumentError: an argument that makes no sense.
        PolicyError, TrainingError: a policy that cannot be found, made, named in results or sent to processes; or one
            that fails in a run.
        ScenarioError, CityError: a scenario that cannot be read or built, or comes twice.
        OutputError: the results file cannot be read or written.
        ExecutorError: an executor that is none, or a process that died.
        Interrupted: Ctrl-C, or `stop` was set; what is done is in the results file.
    """
    chosen = find_metric(metric)
    if not isinstance(margin, int | float) or not (math.isfinite(margin) and margin >= 0):
        raise ArgumentError(expected("margin", "", "a number from 0 on", margin))
    workers_for(executor)
    run_seeds = _seeds(seeds, first_seed)
    known = open_results(None if results is None else path_of("results", results))
    entries = _entries(policies)
    for entry in entries:
        _check_entry(entry, results=known.path, processes=in_processes(executor))
    built = _built(scenarios, settings_of(set))
    runs = _Runs(entries, built, run_seeds, known)
    with gentle_interrupt(stop) as interrupted:
        runs.make(executor, interrupted, on_run)
    found = [runs.outcomes(entry) for entry in entries]
    reference = entries[0]
    return Comparison(
        policies=(
            ComparedPolicy(reference.name, reference.identity),
            *(
                ComparedPolicy(
                    entry.name,
                    entry.identity,
                    tuple(compare_outcomes(found[0], its_runs, same_policy=entry.key == reference.key)),
                )
                for entry, its_runs in zip(entries[1:], found[1:], strict=True)
            ),
        ),
        scenarios=tuple((name, each.scenario.digest) for name, each in built.items()),
        seeds=run_seeds,
        version=simulator_version(),
        metric=chosen.name,
        margin=float(margin),
        warnings=tuple(_warnings(entries, built.values())),
    )


@dataclass(frozen=True)
class _Entry:
    """A policy of a comparison."""

    given: Any
    """What it is made of, anew for every run; a policy that runs in compiled code is that itself."""
    named: NamedPolicy
    name: str
    """As it was asked for: two team files may have one name in two folders."""
    identity: str
    """Digest of what it does; empty if that is not known."""
    key: str
    """The identity, or where there is none, its place among the policies."""

    @property
    def compiled(self) -> bool:
        return isinstance(self.given, KernelPolicy)

    @property
    def portable(self) -> bool:
        """Whether other processes can make it."""
        if isinstance(self.given, str | Path) or self.compiled:
            return True
        if getattr(self.given, "__module__", "__main__") == "__main__" or not self.identity:
            return False
        try:
            pickle.dumps(self.given)
        except Exception:  # noqa: BLE001 - whatever the user's object raises
            return False
        return True


@dataclass(frozen=True)
class _PolicyRun:
    """A run to be made, here or in another process."""

    built: BuiltScenario
    label: str
    """The scenario as errors name it."""
    policy: Any
    seed: int

    def __call__(self) -> Row:
        """Run.

        Raises:
            PolicyError: the policy failed.
        """
        if isinstance(self.policy, KernelPolicy):
            return row_of(run_compiled(self.built, self.policy, seed=self.seed))
        try:
            return row_of(run_step_by_step(self.built, _find(_copied(self.policy)).policy, seed=self.seed))
        except PolicyError as error:
            raise PolicyError(f"{self.label}, seed {self.seed}: {error}") from error

    def __reduce__(self) -> tuple[Any, ...]:
        """Send the scenario only; the other process builds it once."""
        return _sent_run, (self.built.scenario, self.label, self.policy, self.seed)


@dataclass(frozen=True)
class _Runs:
    """All runs of a comparison."""

    entries: Sequence[_Entry]
    built: Mapping[str, BuiltScenario]
    seeds: Sequence[int]
    results: Results
    missing: dict[RunKey, tuple[_Entry, Result, _PolicyRun]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for entry in self.entries:
            for label, built in self.built.items():
                result = Result(built.scenario.name or label, entry.named.name, ())
                for key in self._keys(entry, built):
                    if not self.results.has(key):
                        self.missing[key] = entry, result, _PolicyRun(built, label, entry.given, key.seed)

    def make(self, executor: AnyExecutor, stop: Event, on_run: Callable[[int, int], object]) -> None:
        """Make the runs that are missing; what is done is saved, whatever happens.

        Raises:
            Interrupted: before the last run was done.
        """
        n_all = len({entry.key for entry in self.entries}) * len(self.built) * len(self.seeds)
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

    def outcomes(self, entry: _Entry) -> dict[str, Outcomes]:
        """Return how a policy's runs came out, by scenario; all of them must be known."""
        known = self.results.by_run
        return {
            label: outcomes(self.seeds, [known[key].row for key in self._keys(entry, built)])
            for label, built in self.built.items()
        }

    def _keys(self, entry: _Entry, built: BuiltScenario) -> list[RunKey]:
        digest, version = built.scenario.digest, simulator_version()
        return [RunKey(digest, entry.key, seed, version) for seed in self.seeds]

    def _make(self, keys: list[RunKey], workers: Workers, keep: Callable[[RunKey, Result], object]) -> bool:
        tasks = [self.missing[key][2] for key in keys]
        known = [(key, self.missing[key][1]) for key in keys]
        return workers.run(tasks, lambda k, row: keep(known[k][0], replace(known[k][1], row=row))) is not None

    def _shares(self, executor: AnyExecutor, stop: Event) -> Iterator[tuple[list[RunKey], Workers]]:
        """Share the runs out to those who make them; Python code does not run side by side in threads."""
        compiled = [key for key, (entry, _, _) in self.missing.items() if entry.compiled]
        in_python = [key for key, (entry, _, _) in self.missing.items() if not entry.compiled]
        yield compiled, workers_for(executor, stop=stop)
        if not (executor is None or isinstance(executor, int)):
            yield in_python, workers_for(executor, stop=stop)
            return
        sent = [key for key in in_python if self.missing[key][0].portable]
        n = min(executor or _n_processes(), len(sent) // RUNS_WORTH_A_PROCESS)
        if n > 1:
            yield sent, processes(n, stop=stop)
        yield [key for key in in_python if n <= 1 or key not in sent], threads(1, stop=stop)


def _n_processes() -> int:
    """Return how many processes nobody has to ask for: starting them runs a script of the user's once more."""
    return n_cores() if not hasattr(sys.modules["__main__"], "__file__") else 1


def _seeds(seeds: object, first_seed: object) -> Sequence[int]:
    """Return the seeds of the runs.

    Raises:
        ArgumentError: they are none, or some come twice.
    """
    if isinstance(seeds, Iterable) and not isinstance(seeds, str | bytes):
        listed = [seed_of(seed, name="seeds") for seed in seeds]
        if not listed or len({*listed}) < len(listed):
            raise ArgumentError(expected("seeds", "", "one seed or more, each of them once", listed))
        return listed
    first = seed_of(first_seed, name="first_seed")
    n = whole_number("seeds", seeds, least=1, most=10_000)
    if first + n - 1 > SEED_MAX:
        raise ArgumentError(expected("first_seed", "", f"{n} seeds up to {SEED_MAX}", first))
    return range(first, first + n)


def _entries(policies: object) -> list[_Entry]:
    """Find the policies.

    Raises:
        ArgumentError: there are fewer than two.
        PolicyError, TrainingError: one cannot be found or made.
    """
    if not isinstance(policies, Sequence) or isinstance(policies, str) or len(policies) < 2:
        raise ArgumentError(expected("policies", "", 'two or more, as in ["chief", "best"]', policies))
    entries = []
    for place, given in enumerate(policies):
        named = _find(given)
        identity = policy_identity(named)
        entries.append(
            _Entry(
                given=named.policy if isinstance(named.policy, KernelPolicy) else given,
                named=named,
                name=str(given) if isinstance(given, str | os.PathLike) else named.name,
                identity=identity,
                key=identity or f"policy {place}",
            )
        )
    return entries


def _check_entry(entry: _Entry, *, results: Path | None, processes: bool) -> None:
    """Check that results can name a policy, and processes make it.

    Raises:
        PolicyError: they cannot.
    """
    if results is not None and not entry.identity:
        wanted = "a policy whose source is in a file, or with an attribute `digest`"
        raise PolicyError(expected("results", "", wanted, entry.name, "leave out the results file"))
    if processes and not entry.portable:
        wanted = "a policy that other processes can import or unpickle"
        raise PolicyError(expected("executor", "", wanted, entry.name, "leave out the executor"))


def _built(scenarios: object, values: Mapping[str, Any]) -> dict[str, BuiltScenario]:
    """Build the scenarios, by the names they were asked for.

    Raises:
        ArgumentError: there are none.
        ScenarioError: one of them cannot be read or built, or comes twice.
    """
    listed = [scenarios] if isinstance(scenarios, str | Path | Scenario) else scenarios
    if not isinstance(listed, Sequence) or not listed:
        raise ArgumentError(expected("scenarios", "", "one or more names, files or scenarios", scenarios))
    cities, built, seen = CityCache(), dict[str, BuiltScenario](), dict[str, str]()
    for place, given in enumerate(listed):
        scenario = (given if isinstance(given, Scenario) else load_scenario(given)).with_values(values)
        name = (scenario.name or f"scenario {place}") if isinstance(given, Scenario) else str(given)
        if scenario.digest in seen or name in built:
            got = f"{name} a second time" if name in built else f"{name}, which is the same as {seen[scenario.digest]}"
            raise ScenarioError(expected("scenarios", "", "each scenario once", got))
        seen[scenario.digest] = name
        built[name] = cities.build(scenario)
    return built


def _warnings(entries: Iterable[_Entry], built: Iterable[BuiltScenario]) -> list[str]:
    """Return how teams are used differently from their training, a line each."""
    found = (
        note_on_team(entry.named, each.scenario.brigades.n, choices=each.scenario.choices)
        for entry in entries
        for each in built
    )
    return list(dict.fromkeys(filter(None, found)))


def policy_identity(named: NamedPolicy) -> str:
    """Return the digest of what a policy does, if it has one; else of its file, with its class; "" if neither is known.

    A file may hold several policies: so the class goes with it.
    """
    own = getattr(named.policy, "digest", None)
    if isinstance(own, str):
        return own
    return f"{named.digest}:{type(named.policy).__qualname__}" if named.digest else ""


def _copied(policy: Any) -> Any:
    """Return a copy of an object, so that nothing it remembers gets from run to run; a class or name is no object."""
    try:
        return copy.deepcopy(policy)
    except Exception as error:
        raise PolicyError(f"policy: {type(policy).__name__} cannot be copied: {describe(error)}") from error


def _sent_run(scenario: Scenario, label: str, policy: Any, seed: int) -> _PolicyRun:
    return _PolicyRun(_built_once(scenario), label, policy, seed)


@lru_cache(maxsize=16)
def _built_once(scenario: Scenario) -> BuiltScenario:
    return build_scenario(scenario)


def _find(given: Any) -> NamedPolicy:  # XXX find_policy
    if isinstance(given, str | Path):
        return load_policy(str(given))
    import hashlib
    import inspect

    from fireworld.policy.asking import name_of
    from fireworld.policy.protocol import Policy

    made = given() if inspect.isclass(given) else given
    if not isinstance(made, Policy):
        raise PolicyError(expected("policy", "", "a policy", made))
    digest = getattr(made, "digest", None)
    try:
        source = hashlib.sha256(Path(inspect.getfile(type(made))).read_bytes()).hexdigest()
    except (OSError, TypeError):
        source = ""
    return NamedPolicy(name_of(made), digest if isinstance(digest, str) else source, made)
