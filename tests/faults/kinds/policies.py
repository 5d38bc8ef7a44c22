"""Policies that misbehave, in every command that asks policies."""

from __future__ import annotations

import json
import random
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.faults import misbehaving
from tests.faults.bench import Bench, as_process
from tests.faults.material import N_STEPS
from tests.faults.outcomes import Done, Outcome

NAME: Final = "policies"
SHARE: Final = 0.04
SHORT: Final = ("--steps", N_STEPS)
FEW: Final = ("--scenarios", "quick", "--seeds", 2, "--set", f"steps={N_STEPS}")
GATE: Final = frozenset({0, 1, 3})
TEST: Final = """
def test_policy(recording):
    import misbehaving
    recording(scenario="quick", policy=misbehaving.{name}(), seed=1, steps=12)
"""


@dataclass(frozen=True)
class Asking:
    """A command that asks a policy.

    Attributes:
        words: of it; P stands for the policy.
        good: exit codes for a policy that behaves.
        judges: a policy that changes the world, rather than decide, is refused.
        as_text: its output is JSON.
        given: what is brought, besides the policies.
        refused: exit codes for a policy that cannot be asked.
    """

    words: tuple[object, ...]
    good: frozenset[int] = frozenset({0})
    judges: bool = False
    as_json: bool = False
    given: tuple[str, ...] = ()
    refused: frozenset[int] = frozenset({2})


ASKING: Final = (
    Asking(("run", "quick", *SHORT, "--policy", "P")),
    Asking(("run", "quick", *SHORT, "--policy", "P", "--record", "a.mcap")),
    Asking(("run", "quick", *SHORT, "--policy", "P", "--json"), as_json=True),
    Asking(("compare", "chief", "P", *FEW, "--jobs", 1, "--gate"), GATE, judges=True),
    Asking(("compare", "P", "chief", *FEW, "--jobs", 1, "--gate", "--junit", "a.xml"), GATE, judges=True),
    Asking(
        ("compare", "P", "easiest", *FEW, "--jobs", 1, "--json", "--results", "a.parquet"), judges=True, as_json=True
    ),
    Asking(("golden", "add", "quick", *SHORT, "--policy", "P", "--dir", "g"), judges=True),
    Asking(("golden", "check", "stale"), frozenset({0, 1}), judges=True, given=("stale",)),
    Asking(
        ("golden", "check", "stale", "--junit", "a.xml", "--json"), frozenset({0, 1}), judges=True, given=("stale",)
    ),
    Asking(("golden", "update", "--dir", "stale", "--reason", "Why not."), judges=True, given=("stale",)),
    Asking(("fork", "run.mcap", "--at", 3, "--policy", "P", "--record", "a.mcap"), given=("run.mcap",)),
    Asking(("fork", "mine.mcap", "--at", 3, "--policy", "mine.py:Mine", "--json"), as_json=True, given=("mine.mcap",)),
    Asking(
        ("explain", "mine.mcap", "other.mcap", "--budget", 6),
        given=("mine.mcap", "other.mcap"),
        refused=frozenset({0, 2}),
    ),
)
SLOW: Final = Asking(("compare", "chief", "P", *FEW, "--jobs", 2, "--gate"), GATE, judges=True)
"""With worker processes: seconds each."""
PYTEST: Final = "pytest"


def run(generator: random.Random, bench: Bench) -> Outcome:
    """Let a command ask a policy that misbehaves."""
    name = generator.choice(sorted(misbehaving.POLICIES))
    right = misbehaving.POLICIES[name]
    source = Path(misbehaving.__file__).read_text("utf-8")
    (bench.folder / "misbehaving.py").write_text(source, "utf-8")
    # What was recorded with a good policy, mine.py:Mine, meets one that misbehaves in its place.
    (bench.folder / "mine.py").write_text(
        source.replace('"__module__": __name__', '"__module__": "mine"') + f"\n\nMine = {name}\n"
    )
    drawn = generator.random()
    if drawn < 0.08 and right != "either":
        return _in_pytest(bench, name, right)
    asking = SLOW if drawn < 0.11 else generator.choice(ASKING)
    bench.processes = asking is SLOW or as_process(generator, 0.08)
    bench.bring(asking.given)
    given = bench.files()
    words = [f"misbehaving.py:{name}" if word == "P" else word for word in asking.words]
    done = bench.call(words, codes=_right_codes(asking, right), cpu_seconds_max=30 if asking is SLOW else 10)
    bench.told.append(f"{name}, {right}")
    _look(bench, asking, done, given, name)
    bench.outcome.refused += done.code == 2
    bench.outcome.survived += done.code != 2
    return bench.outcome


def _right_codes(asking: Asking, right: str) -> frozenset[int]:
    if right == "refused" or (right == "cheat" and asking.judges):
        return asking.refused
    if right == "harmless":
        return asking.good
    return asking.good | {2, 130}


def _look(bench: Bench, asking: Asking, done: Done, given: dict[str, bytes], name: str) -> None:
    """Look at what was printed and at what is left."""
    said = f"{name}: `{' '.join(done.words)}`"
    if not bench.folder.exists():  # the policy has removed it
        bench.folder.mkdir()
        return
    if asking.as_json and done.code == 0:
        try:
            json.loads(done.out)
        except ValueError:
            bench.outcome.fail("other", f"{said}: no JSON: {done.out[:80]!r}")
    left = {file for file in bench.files().keys() - given.keys() if not file.endswith((".note", ".pyc"))}
    if done.code == 2 and name not in {"TakesTheName", "ClosesDescriptor", "ClosesOutput"}:
        wrong = {file for file in left if not file.endswith(".mcap.partial") and file not in {"a.xml", "a.parquet"}}
        bench.outcome.expect(not wrong, f"{said}: refused, and left {', '.join(sorted(wrong))}", "half file")
    scratch = {file for file in left if ".fireworld-" in file}
    bench.outcome.expect(not scratch, f"{said}: left {', '.join(sorted(scratch))}")


def _in_pytest(bench: Bench, name: str, right: str) -> Outcome:
    """Let the pytest plugin ask it: a test of a policy that misbehaves fails, and pytest goes on."""
    (bench.folder / "test_mine.py").write_text(TEST.format(name=name))
    words = ["-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--fireworld-update", "test_mine.py"]

    def act() -> None:
        import pytest

        sys.path.insert(0, str(Path.cwd()))
        sys.exit(int(pytest.main([*words, "-c", "/dev/null", "--rootdir", "."])))

    codes = {"refused": {1}, "cheat": {1}, "harmless": {0}}[right]
    done = bench.call((PYTEST, *words), codes=codes, act=act)
    bench.told.append(f"{name}, {right}: {done.out[-2000:]}")
    bench.outcome.expect("INTERNALERROR" not in done.out, f"{name}: pytest itself failed", "traceback")
    bench.outcome.refused += done.code == 1
    bench.outcome.survived += done.code == 0
    return bench.outcome
