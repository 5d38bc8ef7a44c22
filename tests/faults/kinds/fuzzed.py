"""Files that users hand over, altered or made up: the fuzz tests, seed by seed, and the commands that read them."""

from __future__ import annotations

import json
import random
import re
import sys
from typing import Final

from hypothesis import seed as seeded

from tests.faults.bench import VERDICT_OR_REFUSED, Bench, as_process
from tests.faults.material import SHORT_WORDS
from tests.faults.outcomes import Outcome
from tests.fuzz import support, test_files, test_logs, test_networks, test_tables
from tests.fuzz.support import TARGETS, _edited

NAME: Final = "fuzzed"
SHARE: Final = 0.38
TURN_SECONDS_MAX: Final = 60.0
"""CPU of a turn of a fuzz test: some hundred inputs, each of which may take a second."""
TRAIN: Final = ("train", "in.yaml", *SHORT_WORDS, "--jobs", 1, "-o", "out.npz")
SHORT: Final = ("--set", "steps=3")

READERS: Final[dict[str, tuple[tuple[object, ...], ...]]] = {
    "scenario.yaml": (
        ("run", "in.yaml", "--policy", "chief", "--steps", 3),
        ("run", "in.yaml", "--steps", 2, "--record", "out.mcap"),
        ("scenarios", "show", "in.yaml", "--yaml"),
        ("scenarios", "show", "in.yaml", "-o", "out.png"),
        ("compare", "chief", "easiest", "--scenarios", "in.yaml", "--seeds", 1, "--jobs", 1, *SHORT),
        ("scenarios", "check", "in.yaml", "--seeds", 1, "--jobs", 1, *SHORT),
        ("scenarios", "new", "--city", "in.yaml", "-o", "out.yaml", "--seeds", 1, "--jobs", 1, "--places", 2, *SHORT),
        ("golden", "add", "in.yaml", "--policy", "chief", "--steps", 2),
        TRAIN,
    ),
    "curriculum.yaml": (TRAIN, ("golden", "add", "in.yaml", "--train", "--set", "n_episodes_max=1")),
    "team.npz": (
        ("policy", "show", "in.npz"),
        ("policy", "show", "in.npz", 3, "--json"),
        ("policy", "diff", "in.npz", "team.npz"),
        ("run", "quick", "--policy", "in.npz", "--steps", 2),
        ("compare", "in.npz", "chief", "--scenarios", "quick", "--seeds", 1, "--jobs", 1, "--gate", *SHORT),
    ),
    "ranking.npz": (("policy", "show", "in.npz"), ("run", "quick", "--policy", "in.npz", "--steps", 2)),
    "network.npz": (
        ("policy", "show", "in.npz"),
        ("policy", "diff", "in.npz", "team.npz"),
        ("run", "quick", "--policy", "in.npz", "--steps", 2),
    ),
    "net.onnx": (("policy", "import", "in.onnx", "-o", "out.npz", "--features", "mine,volume"),),
    "known.parquet": (
        (
            "compare",
            "chief",
            "easiest",
            "--scenarios",
            "quick",
            "--seeds",
            1,
            "--jobs",
            1,
            "--results",
            "in.parquet",
            *SHORT,
        ),
    ),
    "city.json": (("conformance", "in.json", "mini.npz"), ("conformance", "in.json", "mini.npz", "--json")),
    "trace.npz": (("conformance", "mini.json", "in.npz"), ("conformance", "mini.json", "in.npz", "mini.npz", "--json")),
}
_NUMBER: Final = re.compile(rb"-?\d+(\.\d+)?")
_ODD: Final = (
    b"-1",
    b"0",
    b"1e400",
    b".nan",
    b"99999999999999999999",
    b"null",
    b"[]",
    b"{}",
    b"'x'",
    b"&a [*a]",
    b"!!python/none",
    b"\xff",
    b"\t",
)


def run(generator: random.Random, bench: Bench) -> Outcome:
    """Run a fuzz test for a turn, or let a command read an altered file."""
    if generator.random() < 0.6:
        return _turn(bench, generator.choice(sorted(TARGETS)), generator.randrange(2**32))
    name = generator.choice(sorted(READERS))
    words = generator.choice(READERS[name])
    ending = name.rpartition(".")[2]
    (bench.folder / f"in.{ending}").write_bytes(
        _altered(generator, _good(bench, name), text=ending in {"yaml", "json"})
    )
    bench.bring({"team.npz": "team.npz", "mini.npz": "traces/mini.npz", "mini.json": "traces/mini.json"})
    bench.processes = as_process(generator, 0.06)
    codes = {*VERDICT_OR_REFUSED, 3} if "--gate" in words else VERDICT_OR_REFUSED
    if words[0] not in {"conformance", "policy", "compare"} and "new" not in words:
        codes = codes - {1}
    done = bench.call(words, codes=codes)
    left = [file for file in bench.files() if ".fireworld-" in file or (done.code == 2 and file.startswith("out"))]
    bench.outcome.expect(not left, f"`{' '.join(done.words)}`: left {', '.join(left)}", "half file")
    bench.outcome.refused += done.code == 2
    bench.outcome.survived += done.code != 2
    return bench.outcome


def _turn(bench: Bench, name: str, number: int) -> Outcome:
    """Run a fuzz test with a seed, in a fork."""

    def act() -> None:
        support.FOLDER.name = str(bench.folder)  # other workers have the one of all
        test_logs.GOOD = bench.folder / "good.mcap"
        test_logs.good_bytes.cache_clear()
        seeded(number)(TARGETS[name])()
        sys.stdout.write(json.dumps(support.tried["n"]))

    support.tried["n"] = 0
    done = bench.call(("fuzz", name, number), codes={0}, act=act, cpu_seconds_max=TURN_SECONDS_MAX)
    if done.code == 0:
        bench.outcome.n_inputs = int(done.out.splitlines()[-1])
        bench.outcome.survived = bench.outcome.n_inputs
    return bench.outcome


def _good(bench: Bench, name: str) -> bytes:
    if name == "scenario.yaml":
        return (test_files.shipped_folder() / "quick.yaml").read_bytes()
    if name == "curriculum.yaml":
        return (bench.material / "tiny.yaml").read_bytes()
    if name == "city.json":
        return (bench.material / "traces" / "mini.json").read_bytes()
    if name == "trace.npz":
        return test_files.npz(test_tables.ARRAYS)
    if name == "network.npz":
        return test_networks.TEAM.to_bytes()
    return (bench.material / name).read_bytes()


def _altered(generator: random.Random, data: bytes, *, text: bool) -> bytes:
    """Change numbers and lines of a text, or any bytes."""
    for _ in range(generator.choice((1, 1, 2, 3))):
        numbers = [*_NUMBER.finditer(data)]
        how = generator.randrange(5) if text else 4
        if how < 2 and numbers:
            number = generator.choice(numbers)
            data = data[: number.start()] + generator.choice(_ODD) + data[number.end() :]
        elif how < 4:
            lines = data.splitlines(keepends=True)
            at = generator.randrange(len(lines))
            lines[at : at + 1] = generator.choice(
                ([], [lines[at]] * 2, [b"  " + lines[at]], [lines[at].replace(b":", b"", 1)])
            )
            data = b"".join(lines) or b" "
        else:
            at = generator.randrange(len(data))
            data = (
                _edited(data, [(at, generator.choice((0, 1, 8)), generator.randbytes(generator.randrange(4)))]) or b" "
            )
    return data
