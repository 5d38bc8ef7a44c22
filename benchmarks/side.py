"""One side of a comparison of two commits: does a piece of work when asked to, and answers how long it took.

`benchmarks.against` starts this file once for each commit, with that commit's packages on the path. So it imports
nothing of this folder, and finds what has moved between the commits under either name.
"""

from __future__ import annotations

import gc
import importlib
import json
import resource
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

FIREWORLD: Final = "import sys; sys.argv[0] = 'fireworld'; from fireworld.cli import main; main()"
SMALL: Final = """
city: {generated: {columns: 32, rows: 32}}
fires: [{buildings: [525]}]
civilians: {n: 10}
steps: 100
parameters: {brigades: {tank_litres: 1500, power_litres: 200, refuge_refill_litres: 150}}
"""
"""One building burns, and few others ever do: steps are short, so what surrounds the fire model counts most."""
HOT: Final = """
city: {generated: {columns: 32, rows: 32}}
fires:
  - {at: [0.25, 0.25], n_buildings: 32}
  - {at: [0.75, 0.25], n_buildings: 32}
  - {at: [0.25, 0.75], n_buildings: 32}
  - {at: [0.75, 0.75], n_buildings: 32}
civilians: {n: 10}
steps: 100
"""
CROWD: Final = HOT + "brigades: {n: 48}\n"
LARGE: Final = SMALL.replace("columns: 32, rows: 32", "columns: 400, rows: 250").replace("525", "50200")
SCENARIOS: Final = {"small.yaml": SMALL, "hot.yaml": HOT, "crowd.yaml": CROWD, "large.yaml": LARGE}


class Work(NamedTuple):
    """A piece of work that can be done again and again."""

    do: Callable[[Any], object]
    prepare: Callable[[], Any] = lambda: None
    """Make what the work is done on; not timed."""
    parts: int = 1
    """Steps or calls in it: times are given for one of them."""
    processes: bool = False
    """It is done by processes that it starts."""


def moved(name: str, *modules: str) -> Any:
    """Return a name from the first of some modules that has it.

    Raises:
        ImportError: none has.
    """
    for module in modules:
        try:
            return getattr(importlib.import_module(module), name)
        except (ImportError, AttributeError):
            continue
    raise ImportError(f"no {name} in {' or '.join(modules)}")


def python(*words: str, code: int = 0) -> None:
    """Start a Python process, wait for its end and check its exit code."""
    done = subprocess.run([sys.executable, *words], check=False, capture_output=True, text=True)
    if done.returncode != code:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip()[-200:]}")


def command(*words: str, code: int = 0) -> Work:
    """Time a command line as a whole process."""
    return Work(lambda _: python("-c", FIREWORLD, *words, code=code), processes=True)


def on_logs(*words: str, code: int = 0) -> Work:
    """Time a command line on the logs chief.mcap and other.mcap, which this side records first."""
    for log, policy in (("chief.mcap", "chief"), ("other.mcap", "nearest-to-me")):
        python("-c", FIREWORLD, "run", "test-1", "--policy", policy, "--record", log, "--force")
    return command(*words, code=code)


def built(scenario: str) -> Any:
    """Build a scenario: a shipped one, or one of those above."""
    if scenario in SCENARIOS:
        Path(scenario).write_text(SCENARIOS[scenario], encoding="utf-8")
    read = moved("load_scenario", "fireworld.scenario")(scenario)
    try:
        return moved("build_scenario", "fireworld.simulation.built")(read)
    except ImportError:
        return moved("build_stage", "fireworld.world.stage")(read)


def policy_named(name: str) -> Any:
    """Load a policy that kernels follow."""
    names = importlib.import_module("fireworld.policy.names")
    return (names.find_policy if hasattr(names, "find_policy") else names.load_policy)(name).policy


def episodes(scenario: str, policy: str, *, n: int = 1) -> Work:
    """Time whole episodes in compiled code; the worlds are made beforehand."""
    stage, follows = built(scenario), policy_named(policy)

    def run(worlds: list[Any]) -> None:
        for world in worlds:
            world.run(follows.for_brigades(world.n_brigades))

    return Work(run, lambda: [stage.world(seed=seed) for seed in range(1, n + 1)], parts=n)


def stepping(scenario: str, policy: str, *, recorded: bool = False) -> Work:
    """Time an episode that Python runs step by step, and that is written to a log, if wanted; per step."""
    stage, follows = built(scenario), policy_named(policy)
    city = stage.world(seed=1)
    begin = partial(follows.begin, city.city_arrays if hasattr(city, "city_arrays") else city.tables, city.n_brigades)
    observer_of = moved("Observer", "fireworld.simulation.observer", "fireworld.world.observer")

    def run(world: Any, write: Callable[[Any], object] | None = None) -> None:
        observer = observer_of(world) if write is not None else None
        while not (world.terminated or world.truncated):
            choices = world.step(follows)
            if observer is not None and write is not None:
                write(observer.record(choices))

    def record(world: Any) -> None:
        header = stage.header(seed=1, policy=policy, policy_digest="", n_steps_max=world.n_steps_max)
        writer = moved("LogWriter", "fireworld_recorder.writer", "recorder.writer")
        with writer(Path("steps.mcap"), header, stage.city_record(), force=True) as log:
            log.write(observer_of(world).record())
            run(world, log.write)

    def fresh() -> Any:
        begin(1)
        return stage.world(seed=1)

    first = fresh()
    run(first)
    return Work(record if recorded else run, fresh, parts=first.step_number)


def starting(scenario: str, *, n: int = 20) -> Work:
    """Time the making of worlds of a scenario that is built."""
    stage = built(scenario)

    def make(_: object) -> None:
        for seed in range(n):
            stage.world(seed=seed)

    return Work(make, parts=n)


TRAIN: Final = "train -o t.npz --stages alone --set n_episodes_max=2 --jobs 1 --force"
ROWS: Final[dict[str, Callable[[], Work]]] = {
    "import fireworld": lambda: Work(lambda _: python("-c", "import fireworld"), processes=True),
    "fireworld --help": lambda: command("--help"),
    "fireworld run default": lambda: command("run", "default"),
    "fireworld run test-1 --record": lambda: command("run", "test-1", "--record", "r.mcap", "--force"),
    "fireworld verify": lambda: on_logs("verify", "chief.mcap"),
    "fireworld diff, different": lambda: on_logs("diff", "chief.mcap", "other.mcap", code=1),
    f"fireworld {TRAIN}": lambda: command(*TRAIN.split()),
    "built.world(seed), test-1": lambda: starting("test-1"),
    "World.run, test-1, best": lambda: episodes("test-1", "best", n=5),
    "World.run, test-2, best": lambda: episodes("test-2", "best", n=5),
    "World.run, test-3, best": lambda: episodes("test-3", "best", n=5),
    "World.run, 1024 buildings, hot, best": lambda: episodes("hot.yaml", "best", n=3),
    "World.run, 1024 buildings, hot, best, 48 brigades": lambda: episodes("crowd.yaml", "best"),
    "World.run, 1024 buildings, hot, tables": lambda: episodes("hot.yaml", "paper-cooperative", n=3),
    "World.run, 1024 buildings, small fire": lambda: episodes("small.yaml", "nearest-to-me", n=10),
    "World.run, 100000 buildings, small fire": lambda: episodes("large.yaml", "nearest-to-me", n=2),
    "World.step, 1024 buildings, small fire": lambda: stepping("small.yaml", "nearest-to-me"),
    "World.step, test-1, best": lambda: stepping("test-1", "best"),
    "World.step and record, test-1, best": lambda: stepping("test-1", "best", recorded=True),
}
"""What is measured, by its name in the table; a row that one side cannot make is left out."""


def processor_seconds(*, processes: bool) -> float:
    """Return the processor time used so far, by this process or by those it has started."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN if processes else resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def timed(work: Work) -> float:
    """Do the work once; return the processor seconds of one of its parts."""
    prepared = work.prepare()
    gc.collect()
    start = processor_seconds(processes=work.processes)
    work.do(prepared)
    return (processor_seconds(processes=work.processes) - start) / work.parts


def main() -> None:
    """Answer every line, the name of a row, with a line of JSON: the seconds, or why there are none."""
    ready: dict[str, Work] = {}
    gc.disable()
    for line in sys.stdin:
        name = line.strip()
        try:
            if name not in ready:
                ready = {name: ROWS[name]()}
                timed(ready[name])  # compile, fill caches
            answer: dict[str, object] = {"seconds": timed(ready[name])}
        except Exception as error:  # noqa: BLE001 - whatever the other commit cannot do
            answer = {"skipped": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
