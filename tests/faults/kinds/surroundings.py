"""Odd surroundings: clocks, masks, quotas, streams, environments, threads, viewers that go away."""

from __future__ import annotations

import os
import random
import resource
import signal
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from tests.faults import mounts
from tests.faults.bench import Bench
from tests.faults.material import N_STEPS, TINY_SEARCH, TINY_TRAINING
from tests.faults.outcomes import Outcome
from tests.faults.writers import OFTEN, WRITERS, Whole, look, missing_files, whole_call

NAME: Final = "surroundings"
SHARE: Final = 0.04
REFUSED: Final = 2
DIES_AFTER: Final = (
    "import os, sys\nn = {n}\nwhile n > 0:\n    n -= len(os.read(0, min(n, 65536))) or n\nsys.exit({code})"
)
NEVER_READS: Final = "import time; time.sleep(60)"
ENVIRONMENTS: Final[tuple[dict[str, str], ...]] = (
    {"LANG": "C", "LC_ALL": "C"},
    {"LC_ALL": "POSIX", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
    {"PYTHONHASHSEED": "7", "PYTHONOPTIMIZE": "2"},
    {"PYTHONWARNINGS": "error"},
    {"PYTHONIOENCODING": "ascii"},
    {"PYTHONDONTWRITEBYTECODE": "1", "PYTHONDEVMODE": "0", "PYTHONNOUSERSITE": "1"},
    {"TERM": "dumb", "COLUMNS": "1", "LINES": "1"},
    {"COLUMNS": "100000", "FORCE_COLOR": "1"},
    {"TMPDIR": "/nonexistent"},
    {"MPLBACKEND": "module://odd", "MPLCONFIGDIR": "/nonexistent"},
    {"NUMBA_DISABLE_JIT": "1"},
    {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    {"OPENBLAS_NUM_THREADS": "odd", "RERUN": "off", "DISPLAY": ""},
    {"TZ": "Pacific/Kiritimati"},
)


def run(generator: random.Random, bench: Bench) -> Outcome:
    """Let a command work in odd surroundings."""
    cases: list[Callable[[random.Random, Bench], None]] = [_clock, _mask, _quota, _stream, _threads, _viewer, _viewer]
    if not bench.light:
        cases += [_environment, _environment]
    generator.choice(cases)(generator, bench)
    bench.outcome.survived += not bench.outcome.failures and not bench.outcome.refused
    return bench.outcome


def _writer(generator: random.Random, bench: Bench, **how: Any) -> None:
    """Call a writer; what it makes is what it always makes."""
    name = generator.choice(OFTEN)
    writer, expected = WRITERS[name], whole_call(name, bench.material)
    bench.bring(writer.given)
    given = bench.files()
    refusable = how.pop("refusable", False)
    mounts.open_way(bench.folder) if "nobody" in how else None
    if how.pop("nobody", False):
        for path in [bench.folder, *bench.folder.rglob("*")]:
            os.chown(path, mounts.NOBODY, mounts.NOBODY)
    codes = {expected.code, REFUSED} if refusable else {expected.code}
    done = bench.call(writer.words, codes=codes, cpu_seconds_max=20, **how)
    bench.told.append(name)
    _open_all(bench)
    look(bench, writer, expected, given, killed=False)
    if done.code == expected.code:
        _same(bench, name, expected)
    bench.outcome.refused += done.code == REFUSED


def _open_all(bench: Bench) -> None:
    """Give the files back the rights that a mask took."""
    for path in [bench.folder, *bench.folder.rglob("*")]:
        path.chmod(0o755)


def _same(bench: Bench, name: str, expected: Whole) -> None:
    missing = missing_files(expected, bench)
    bench.outcome.expect(not missing, f"{name}: did not make {', '.join(missing)}", "half file")
    found = bench.files()
    different = sorted(file for file, data in expected.files.items() if found.get(file, data) != data)
    bench.outcome.expect(not (expected.same and different), f"{name}: other bytes: {', '.join(different)}")


def _clock(generator: random.Random, bench: Bench) -> None:
    """The time of day jumps, back and forward."""
    jumps, now = random.Random(generator.random()), time.time

    def before() -> None:
        def odd() -> float:
            return now() + jumps.choice((0.0, -3.2e8, 3.2e8, -now() + 1.0, 8.0e9, -0.5))

        time.time = odd
        time.time_ns = lambda: int(odd() * 1e9)

    _writer(generator, bench, before=before)


def _mask(generator: random.Random, bench: Bench) -> None:
    """A mask of rights, from none to all; for all, not as root."""
    mask = generator.choice((0o000, 0o077, 0o777, 0o222, 0o022))
    nobody = os.geteuid() == 0 and generator.random() < 0.7

    def before() -> None:
        os.umask(mask)
        if nobody:
            mounts.be_nobody()

    how = {"nobody": True} if nobody else {}
    _writer(generator, bench, before=before, refusable=mask in {0o777, 0o222}, **how)
    bench.told.append(f"mask {mask:o}, {'nobody' if nobody else 'as we are'}")


def _quota(generator: random.Random, bench: Bench) -> None:
    """Few open files, small files, small stacks."""
    limits = {
        "open files": (resource.RLIMIT_NOFILE, generator.randrange(8, 40)),
        "bytes of a file": (resource.RLIMIT_FSIZE, generator.randrange(0, 60_000)),
        "bytes of the stack": (resource.RLIMIT_STACK, 1 << 19),
    }
    name = generator.choice(sorted(limits))
    kind, most = limits[name]
    _writer(generator, bench, before=lambda: resource.setrlimit(kind, (most, most)), refusable=True)
    bench.told.append(f"{most} {name}")


def _stream(generator: random.Random, bench: Bench) -> None:
    """Standard output, or the error stream, that is closed, full, or read by nobody."""
    number, how = generator.choice((1, 1, 2)), generator.choice(("closed", "full", "unread"))
    words, right = generator.choice(
        (
            (("info", "run.mcap"), 0),
            (("info", "run.mcap", "--json"), 0),
            (("diff", "run.mcap", "other.mcap"), 1),
            (("diff", "run.mcap", "run.mcap", "--json"), 0),
            (("verify", "run.mcap"), 0),
            (("golden", "check", "golden"), 0),
            (("run", "quick", "--policy", "chief", "--steps", N_STEPS, "--json"), 0),
            (("scenarios",), 0),
            (("policy", "show", "team.npz"), 0),
            (("policy", "diff", "team.npz", "team.npz"), 0),
        )
    )
    bench.bring(("run.mcap", "other.mcap", "golden", "team.npz"))

    def before() -> None:
        if how == "closed":
            os.close(number)
        elif how == "full":
            os.dup2(os.open("/dev/full", os.O_WRONLY), number)
        else:
            reading, writing = os.pipe()
            os.close(reading)
            os.dup2(writing, number)

    codes = {right} if how == "unread" else {REFUSED} if how == "full" and number == 1 else {right, REFUSED}
    bench.processes = generator.random() < 0.1
    done = bench.call((*words,), codes=codes, before=before)
    bench.told.append(f"stream {number} {how}")
    bench.outcome.refused += done.code == REFUSED
    if number == 2:  # nothing can be said there
        bench.outcome.failures = [one for one in bench.outcome.failures if one.kind != "line"]


def _environment(generator: random.Random, bench: Bench) -> None:
    """Variables of other tools, in a process."""
    environment = generator.choice(ENVIRONMENTS)
    _writer(generator, bench, environment=environment, refusable=bool({"TMPDIR", "RERUN"} & set(environment)))
    bench.told.append(str(environment))


def _threads(generator: random.Random, bench: Bench) -> None:
    """Runs, recordings, differences and trainings in threads of one process: what they are one after another."""
    first = generator.randrange(1000)
    bench.bring(("run.mcap", "other.mcap", "tiny.yaml"))

    def act() -> None:
        import fireworld as fw

        def recorded(seed: int, name: str) -> str:
            fw.run("quick", policy="chief", seed=seed, steps=N_STEPS, record=f"{name}.mcap")
            return fw.open_log(f"{name}.mcap").digest

        def own(seed: int, _: str) -> str:
            return fw.run("quick", policy=lambda seen: seen.step % 4, seed=seed, steps=N_STEPS).digest

        def compared(_: int, __: str) -> str:
            return str(fw.diff("run.mcap", "other.mcap").to_dict())

        works = [recorded, own, compared, own, recorded, compared]
        alone = [work(first + number, f"alone-{number}") for number, work in enumerate(works)]
        found: list[Any] = [None] * len(works)
        threads = [
            threading.Thread(target=lambda n=number, w=work: found.__setitem__(n, w(first + n, f"thread-{n}")))
            for number, work in enumerate(works)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert found == alone, [number for number, (a, b) in enumerate(zip(found, alone, strict=True)) if a != b]

    bench.call(("threads", first), codes={0}, act=act, cpu_seconds_max=20)
    left = [name for name in bench.files() if ".partial" in name or ".fireworld-" in name]
    bench.outcome.expect(not left, f"threads left {', '.join(left)}")


def _viewer(generator: random.Random, bench: Bench) -> None:
    """A viewer that goes away in the middle, is killed, fails, or never reads."""
    how = generator.choice(("dies", "dies", "fails", "killed", "never reads", "cannot be started"))
    code = DIES_AFTER.format(n=generator.choice((0, 1, 1000, 50_000, 500_000)), code=1 if how == "fails" else 0)
    command = [sys.executable, "-S", "-c", NEVER_READS if how in {"never reads", "killed"} else code]
    words, finals = generator.choice(
        (
            (("run", "quick", "--policy", "chief", "--steps", N_STEPS, "--record", "a.mcap"), {"a.mcap": "run"}),
            ((*TINY_TRAINING, "-o", "t.npz", "--record", "t.mcap"), {}),
            ((*TINY_SEARCH, "-o", "t.npz"), {}),
        )
    )
    if how == "cannot be started":
        command = [str(bench.folder / "nothing")]

    def before() -> None:
        from fireworld_viewer.rerun_view import live

        class Viewer(live.ViewerProcess):
            def __init__(self, *arguments: Any, **options: Any) -> None:
                super().__init__(*arguments, **options)
                if how == "killed":
                    threading.Timer(0.05, self._process.send_signal, (signal.SIGKILL,)).start()

        live.own_window = lambda: partial(Viewer, command, stays=False)

    bench.bring(("tiny.yaml",))
    codes = {REFUSED} if how == "cannot be started" else {0}
    done = bench.call((*words, "--view"), codes=codes, before=before, cpu_seconds_max=20)
    bench.told.append(f"viewer {how}")
    bench.outcome.refused += done.code == REFUSED
    for final, source in finals.items():
        same = (bench.folder / final).exists() and (
            (bench.folder / final).read_bytes() == (bench.material / f"{source}.mcap").read_bytes()
        )
        bench.outcome.expect(same or done.code, f"{final} is not what it is without a viewer", "half file")
