"""Many at once: in one folder, on one name or on many; first compilations; caches that are damaged or another's."""

from __future__ import annotations

import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Final

from fireworld_recorder.reader import open_log

from tests.faults import mounts, whole
from tests.faults.bench import Bench
from tests.faults.material import N_STEPS, TINY_TRAINING
from tests.faults.outcomes import Outcome

NAME: Final = "crowds"
SHARE: Final = 0.05
N: Final = 20
COMPILING_SECONDS_MAX: Final = 150.0
RUN: Final = ("run", "quick", "--policy", "chief", "--steps", N_STEPS)
COMPARE: Final = ("compare", "chief", "easiest", "--scenarios", "quick", "--seeds", 2, "--jobs", 1, "--set", "steps=9")

ON_ONE_NAME: Final[dict[str, tuple[tuple[object, ...], str]]] = {
    "run": ((*RUN, "--record", "a.mcap"), "a.mcap"),
    "run --force": ((*RUN, "--record", "a.mcap", "--force"), "a.mcap"),
    "compare --results": ((*COMPARE, "--results", "a.parquet"), "a.parquet"),
    "export --force": (("export", "run.mcap", "--parquet", "out", "--force"), "out/steps.parquet"),
    "report --force": (("report", "run.mcap", "-o", "a.html", "--force"), "a.html"),
    "play --force": (("play", "run.mcap", "-o", "a.html", "--force"), "a.html"),
    "recover --force": (("recover", "cut-run.mcap", "-o", "a.mcap", "--force"), "a.mcap"),
    "golden add": (("golden", "add", *RUN[1:], "--name", "one", "--dir", "g"), "g/one.mcap"),
    "golden update": (("golden", "update", "--dir", "stale", "--reason", "Another choice."), "stale/first.mcap"),
    "train --force": ((*TINY_TRAINING, "-o", "a.npz", "--record", "a.mcap", "--force"), "a.npz"),
    "fork": (("fork", "run.mcap", "--at", 3, "--policy", "easiest", "--record", "a.mcap"), "a.mcap"),
}


def run(generator: random.Random, bench: Bench) -> Outcome:
    """Let many write at once, or compile."""
    bench.bring(("run.mcap", "cut-run.mcap", "tiny.yaml", "stale"))
    bench.bring({"mine.py": "mine_changed.py"})
    if not bench.light and generator.random() < 0.15:
        return generator.choice((_first_compilations, _odd_cache, _odd_cache, _no_cache))(generator, bench)
    if generator.random() < 0.3:
        return _on_many_names(bench)
    name = generator.choice(sorted(ON_ONE_NAME))
    words, final = ON_ONE_NAME[name]
    found = bench.crowd([words] * N, codes={0, 2}, cpu_seconds_max=20)
    n_done = sum(done.code == 0 for done in found)
    bench.told.append(f"{name}: {n_done} of {N} done")
    bench.outcome.n_inputs = N
    bench.outcome.survived += n_done
    bench.outcome.refused += N - n_done
    path = bench.folder / final
    bench.outcome.expect(n_done or name == "golden update", f"{name}: none of {N} got through", "other")
    if name in {"run", "fork", "golden add"}:
        bench.outcome.expect(n_done == 1, f"{name}: {n_done} of {N} took one name")
    if path.exists():
        fault = {".mcap": whole.run_up_to, ".parquet": _table, ".html": whole.reproduction}.get(path.suffix, _nothing)(
            path
        )
        bench.outcome.expect(not fault, f"{name}: {fault}", "half file")
    else:
        bench.outcome.expect(n_done == 0, f"{name}: {n_done} of {N} are done, and there is no {final}", "half file")
    left = [
        file
        for file in bench.files()
        if ".fireworld-" in file or file.endswith((".partial", ".recovering", ".storing"))
    ]
    bench.outcome.expect(not left, f"{name}: left {', '.join(left)}")
    return bench.outcome


def _nothing(path: Path) -> str:
    return "" if path.stat().st_size else "it is empty"


def _table(path: Path) -> str:
    import pyarrow.parquet as pq

    if path.name == "a.parquet":
        return whole.results(path)
    return "" if pq.read_table(path).num_rows else "it is empty"


def _on_many_names(bench: Bench) -> Outcome:
    found = bench.crowd([(*RUN, "--record", f"{number}.mcap") for number in range(N)], codes={0})
    digests = {open_log(bench.folder / f"{number}.mcap").digest for number, done in enumerate(found) if done.code == 0}
    bench.outcome.expect(len(digests) == 1, f"one run has {len(digests)} digests")
    bench.outcome.n_inputs = bench.outcome.survived = N
    return bench.outcome


def _compiled_run(bench: Bench, cache: Path, *, codes: frozenset[int] = frozenset({0})) -> str:
    """Run with a cache, as a process; return the digest."""
    words = (*RUN, "--json")
    done = bench.call(
        words, codes=codes, environment={"NUMBA_CACHE_DIR": str(cache)}, cpu_seconds_max=COMPILING_SECONDS_MAX
    )
    return done.out


def _expect_same(bench: Bench, outputs: list[str], what: str) -> Outcome:
    truth = _truth(bench)
    bench.outcome.expect(all(out == truth for out in outputs), f"{what}: another outcome")
    bench.outcome.survived += 1
    return bench.outcome


def _truth(bench: Bench) -> str:
    return bench.call((*RUN, "--json"), codes={0}).out


def _first_compilations(_: random.Random, bench: Bench) -> Outcome:
    """Two at once on an empty cache."""
    cache = bench.folder / "cache"
    words = [sys.executable, "-m", "fireworld", *map(str, RUN), "--json"]
    environment = {"NUMBA_CACHE_DIR": str(cache), "PATH": "/usr/bin:/bin", "HOME": str(bench.folder)}
    pipe = subprocess.PIPE
    other = subprocess.Popen(words, cwd=bench.folder, env=environment, stdout=pipe, stderr=pipe, text=True)
    first = _compiled_run(bench, cache)
    out, err = other.communicate(timeout=300)
    bench.outcome.n_processes += 1
    bench.outcome.expect(
        other.returncode == 0 and "Traceback" not in err, f"the other: {other.returncode}: {err[-200:]}"
    )
    return _expect_same(bench, [first, out, _compiled_run(bench, cache)], "two first compilations at once")


def _whole_cache() -> Path:
    """Return the folder of compiled kernels that this process has loaded."""
    from fireworld.kernels.cache import STORE

    return STORE.folders[0]


def _odd_cache(generator: random.Random, bench: Bench) -> Outcome:
    """A cache with damaged entries, or with those of another processor or another numba."""
    cache = Path(tempfile.mkdtemp(dir=bench.folder, prefix="cache-"))
    shutil.rmtree(cache)
    source = _whole_cache()
    place = cache / source.name
    shutil.copytree(source, place)
    files = sorted(place.glob("*.nbc"))
    how: Callable[[bytes], bytes] = generator.choice(
        (_emptied, _cut, _flipped, _of_another_processor, _of_another_numba)
    )
    for path in (
        files if how in {_of_another_processor, _of_another_numba} else generator.sample(files, min(3, len(files)))
    ):
        path.write_bytes(how(path.read_bytes()))
    bench.told.append(f"cache of {len(files)} files, {how.__name__}")
    bench.outcome.expect(files, f"no compiled kernels in {source}")
    return _expect_same(bench, [_compiled_run(bench, cache), _compiled_run(bench, cache)], f"cache {how.__name__}")


def _emptied(_: bytes) -> bytes:
    return b""


def _cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


def _flipped(data: bytes) -> bytes:
    middle = len(data) // 2
    return data[:middle] + bytes(byte ^ 0x55 for byte in data[middle : middle + 40]) + data[middle + 40 :]


def _of_another_processor(data: bytes) -> bytes:
    import llvmlite.binding as llvm

    name = llvm.get_host_cpu_name().encode()
    return data.replace(name, b"z" * len(name))


def _of_another_numba(data: bytes) -> bytes:
    import numba

    version = numba.__version__.encode()
    return data.replace(version, b"9" * len(version))


def _no_cache(generator: random.Random, bench: Bench) -> Outcome:
    """A cache folder that cannot be written: a file, a read-only or a tiny file system."""
    cache = bench.folder / "cache"
    how = generator.choice(("a file", "read-only", "full") if mounts.can_mount() else ("a file",))
    bench.told.append(f"cache: {how}")
    if how == "a file":
        cache.write_text("x")
        return _expect_same(bench, [_compiled_run(bench, cache)], "a file for a cache")
    cache.mkdir()
    with mounts.small_disk(cache, 1 << 14) as again:
        if how == "read-only":
            again("ro")
        return _expect_same(bench, [_compiled_run(bench, cache)], f"a cache that is {how}")
