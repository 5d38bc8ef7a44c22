"""The fault campaign: cases of every kind for some time, and a table of what came of them.

    python -m tests.faults.campaign --seconds 600 --seed 1 [--only kills damage] [--resume]
    python -m tests.faults.campaign --case kills:1000017

Every case is drawn from its name alone, its kind and its seed, and can be tried again by it. What is finished is in
reports/faults; with --resume a campaign goes on after it. Ctrl-C ends it, with the table of what was tried by then.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import connection, get_context
from multiprocessing.context import ForkProcess
from pathlib import Path
from typing import Any, Final

if __name__ == "__main__":
    os.environ.setdefault("FIREWORLD_FUZZ_EXAMPLES", "200")  # before it is read, by the imports that follow
from tests.docs.pages import ROOT
from tests.faults import calls, material
from tests.faults.bench import Bench
from tests.faults.kinds import KINDS, Kind
from tests.faults.ledger import Ledger
from tests.faults.outcomes import Outcome

REPORTS: Final = ROOT / "reports" / "faults"
NUMBERS: Final = 1_000_000
"""Cases of a seed: the seed of a case is that of its campaign times this, and its number."""
SAY_SECONDS: Final = 15.0
GRACE_SECONDS: Final = 30.0
"""How long a case may last that is under way when the time is over; the next campaign tries it again."""


@dataclass
class Worker:
    """A process that tries one case after another."""

    process: ForkProcess
    pipe: Any
    light: bool
    case: str = ""
    began: float = 0.0


def main(words: Sequence[str] | None = None) -> int:
    """Try cases until the time is over; return 1 if one failed."""
    arguments = _parse(words)
    with tempfile.TemporaryDirectory(prefix="fireworld-faults-") as scratch:
        place = Path(scratch)
        _say("importing and compiling what is to be tried")
        material.warm()
        material.make(place / "material")
        if arguments.case:
            return _repeat(arguments.case, place)
        only = f"-{'-'.join(arguments.only)}" if arguments.only else ""
        ledger = Ledger.begin(arguments.reports / f"{arguments.seed}{only}.jsonl", resume=arguments.resume)
        if ledger.outcomes:
            _say(f"going on after {len(ledger.outcomes)} cases, in {ledger.path}")
        kinds = {name: KINDS[name] for name in arguments.only or KINDS}
        try:
            _campaign(kinds, ledger, place, arguments)
        except KeyboardInterrupt:
            _say("interrupted")
    sys.stdout.write(f"{ledger.table()}\n")
    return 1 if ledger.failed else 0


def _parse(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.faults.campaign", description=main.__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=1, help="of all that is drawn")
    parser.add_argument("--only", nargs="+", choices=list(KINDS), metavar="KIND", help=f"of {', '.join(KINDS)}")
    parser.add_argument("--resume", action="store_true", help="go on after what is finished, if the code is the same")
    parser.add_argument("--jobs", type=int, default=2, help="cases at a time")
    parser.add_argument("--cases", type=int, default=NUMBERS, metavar="N", help="end after N cases of every kind")
    parser.add_argument("--reports", type=Path, default=REPORTS, help="folder of what is finished")
    parser.add_argument("--light", action="store_true", help="leave out cases that take more than some seconds")
    parser.add_argument("--case", help="try this one alone, as in kills:1000017, and say what happens")
    return parser.parse_args(words)


def try_case(case: str, place: Path, *, light: bool = False) -> tuple[Outcome, list[str]]:
    """Try a case; return what came of it, and what was called.

    Args:
        case: its name: kind and seed.
        place: where the material is, and where the case gets a folder.
        light: leave out what takes more than some seconds.
    """
    name = case.partition(":")[0]
    folder = Path(tempfile.mkdtemp(prefix=f"{name}-", dir=place))
    bench = Bench(folder, place / "material", light=light)
    try:
        outcome = KINDS[name].run(random.Random(case), bench)
    except Exception as error:  # noqa: BLE001 - a fault of the campaign's own is no success
        outcome = bench.outcome
        outcome.fail("other", f"the campaign: {traceback.format_exception(error)[-2:]}")
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return outcome, bench.told


def cases_of(name: str, seed: int, ledger: Ledger, *, n: int = NUMBERS) -> Iterator[str]:
    """Yield the cases of a kind, the first n: those that failed before, then those that were not tried."""
    yield from [case for case in ledger.failed if case.startswith(f"{name}:")]
    for number in range(n):
        case = f"{name}:{seed * NUMBERS + number}"
        if case not in ledger.outcomes:
            yield case


def _campaign(kinds: dict[str, Kind], ledger: Ledger, place: Path, arguments: argparse.Namespace) -> None:
    end, said = time.monotonic() + arguments.seconds, time.monotonic()
    waiting = {name: cases_of(name, arguments.seed, ledger, n=arguments.cases) for name in kinds}
    spent = {name: (ledger.tallies()[name].seconds if name in ledger.tallies() else 0.0) for name in kinds}
    workers = [_hire(place, light=arguments.light) for _ in range(arguments.jobs)]
    try:
        while time.monotonic() < end + GRACE_SECONDS:
            for worker in workers:
                if not worker.case and time.monotonic() < end:
                    _hand_out(worker, kinds, waiting, spent, workers)
            busy = [worker for worker in workers if worker.case]
            if not busy:
                break
            for ready in connection.wait([worker.pipe for worker in busy], timeout=1.0):
                at = next(i for i, worker in enumerate(workers) if worker.pipe is ready)
                workers[at] = _take(workers[at], ledger, spent, place)
            if time.monotonic() - said > SAY_SECONDS:
                said = time.monotonic()
                _say(f"{len(ledger.outcomes)} cases, {len(ledger.failed)} failed, {max(0, end - said):.0f} s left")
    finally:
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            worker.process.join()


def _hand_out(
    worker: Worker,
    kinds: dict[str, Kind],
    waiting: dict[str, Iterator[str]],
    spent: dict[str, float],
    workers: Sequence[Worker],
) -> None:
    """Give a worker a case of the kind that has had the least of its share of the time."""
    under_way = dict.fromkeys(kinds, 0.0)
    for other in workers:
        if other.case:
            under_way[other.case.partition(":")[0]] += max(1.0, time.monotonic() - other.began)
    for name in sorted(waiting, key=lambda name: (spent[name] + under_way[name]) / kinds[name].SHARE):
        case = next(waiting[name], None)
        if case is not None:
            worker.case, worker.began = case, time.monotonic()
            worker.pipe.send(case)
            return
        del waiting[name]


def _take(worker: Worker, ledger: Ledger, spent: dict[str, float], place: Path) -> Worker:
    """Take what a worker found; return it, or another in the place of one that died."""
    try:
        outcome = worker.pipe.recv()
    except EOFError:
        outcome = Outcome()
        outcome.fail("other", "the process that tried it died")
        worker.process.join()
        case, began, worker = worker.case, worker.began, _hire(place, light=worker.light)
    else:
        case, began = worker.case, worker.began
    seconds = time.monotonic() - began
    ledger.add(case, outcome, seconds)
    spent[case.partition(":")[0]] += seconds
    for failure in outcome.failures[:3]:
        _say(f"{case}: {failure.kind}: {failure.text}")
    worker.case = ""
    return worker


def _hire(place: Path, *, light: bool) -> Worker:
    here, there = get_context("fork").Pipe()
    process = get_context("fork").Process(target=_work, args=(there, place, light))
    process.start()
    there.close()
    return Worker(process, here, light)


def _work(pipe: Any, place: Path, light: bool) -> None:
    """Be a worker: try what comes."""

    def leave(*_: object) -> None:
        calls.end_what_runs()
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, leave)
    calls.count_apart()
    with suppress(EOFError):
        while True:
            pipe.send(try_case(pipe.recv(), place, light=light)[0])


def _repeat(case: str, place: Path) -> int:
    outcome, told = try_case(case, place)
    sys.stdout.write("\n".join(told) + "\n")
    for failure in outcome.failures:
        sys.stdout.write(f"{failure.kind}: {failure.text}\n")
    sys.stdout.write(f"{case}: {'failed' if outcome.failures else 'good'}\n")
    return 1 if outcome.failures else 0


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")


if __name__ == "__main__":
    sys.exit(main())
