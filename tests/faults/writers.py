"""Every command that writes: its words, what it finds and leaves, and what a whole call makes of it."""

from __future__ import annotations

import functools
import os
import pickle
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from tests.faults import calls, whole
from tests.faults.bench import DONE_OR_REFUSED, Bench
from tests.faults.material import HAS_MINARI, N_STEPS, TINY_SEARCH, TINY_TRAINING

SCRATCH: Final = ".fireworld-"


@dataclass(frozen=True)
class Writer:
    """A command that writes.

    Attributes:
        words: of it.
        finals: the files that it writes, or folders, by their final names.
        given: what it finds, as for `Bench.bring`.
        again: a word more for a second call that finds what the first one left; the first that works will do.
        instead: words of the second call, where it is another command.
        partials: names of what it leaves when it is killed, besides scratch files; what is said to be left.
        kept: what it leaves when it is interrupted.
        whole: checks a final file whose bytes are not those of a whole call; None: there is no such file.
        before: called in the child, before the command.
    """

    words: tuple[object, ...]
    finals: tuple[str, ...]
    given: dict[str, str] = field(default_factory=dict)
    again: tuple[str, ...] = ()
    instead: tuple[object, ...] = ()
    partials: tuple[str, ...] = ()
    kept: tuple[str, ...] = ()
    whole: Callable[[Path], str] | None = None
    before: Callable[[], object] | None = None


TINY: Final = {"tiny.yaml": "tiny.yaml"}
RUN: Final = {"run.mcap": "run.mcap"}
TWO: Final = {**RUN, "other.mcap": "other.mcap"}
TRAINING: Final = {"training.mcap": "training.mcap"}
PLAYED: Final = {"played.mcap": "played.mcap"}
STALE: Final = {"mine.py": "mine_changed.py", "stale": "stale"}
COMPARE: Final = ("compare", "chief", "easiest", "--scenarios", "quick", "--seeds", 3, "--jobs", 1, "--set", "steps=12")
NEW: Final = (
    *("scenarios", "new", "--city", "quick", "--set", "steps=40", "--seeds", 1, "--jobs", 1),
    *("--held-above", 0.9, "--lost-below", 0.05),
)
STEPS: Final = ("--steps", N_STEPS)

WRITERS: Final[dict[str, Writer]] = {
    "run": Writer(
        ("run", "quick", "--policy", "chief", *STEPS, "--record", "a.mcap"),
        ("a.mcap",),
        again=("--force",),
        partials=("a.mcap.partial",),
        whole=whole.run_up_to,
    ),
    "run over another": Writer(
        ("run", "quick", "--policy", "chief", *STEPS, "--record", "a.mcap", "--force"),
        ("a.mcap",),
        {"a.mcap": "other.mcap"},
        partials=("a.mcap.partial",),
        whole=whole.run_up_to,
    ),
    "run for Foxglove": Writer(
        ("run", "quick", *STEPS, "--record", "a.mcap", "--scene", "foxglove"),
        ("a.mcap",),
        again=("--force",),
        partials=("a.mcap.partial",),
        whole=whole.run_up_to,
    ),
    "train": Writer(
        (*TINY_TRAINING, "-o", "t.npz", "--log", "t.csv"),
        ("t.npz", "t.csv"),
        TINY,
        again=("--resume", "--force"),  # killed between its two files, it has to be told that it may replace the first
        kept=("t.npz.checkpoint",),
        whole=whole.lines,
    ),
    "train over another": Writer(
        (*TINY_TRAINING, "-o", "t.npz", "--force"),
        ("t.npz",),
        {**TINY, "t.npz": "ranking.npz"},
        kept=("t.npz.checkpoint",),
    ),
    "train two": Writer(
        (*TINY_TRAINING, "-o", "t.npz", "--repetitions", 2),
        ("t-1.npz", "t-2.npz"),
        TINY,
        again=("--resume",),
        kept=("t-1.npz.checkpoint", "t-2.npz.checkpoint"),
    ),
    "train, recorded": Writer(
        (*TINY_TRAINING, "-o", "t.npz", "--record", "t.mcap"),
        ("t.npz", "t.mcap"),
        TINY,
        again=("--resume",),
        partials=("t.mcap.partial",),
    ),
    "train, resumed": Writer(
        (*TINY_TRAINING, "-o", "t.npz", "--record", "t.mcap", "--resume"),
        ("t.npz", "t.mcap"),
        {**TINY, "t.mcap.partial": "cut-training.mcap"},
        partials=("t.mcap.partial", "t.mcap.resuming"),
    ),
    "train by search": Writer(
        (*TINY_SEARCH, "-o", "t.npz", "--record", "t.mcap"),
        ("t.npz", "t.mcap"),
        TINY,
        again=("--resume",),
        partials=("t.mcap.partial",),
    ),
    "policy import": Writer(
        ("policy", "import", "net.onnx", "-o", "t.npz", "--features", "mine,volume"),
        ("t.npz",),
        {"net.onnx": "net.onnx"},
        ("--force",),
    ),
    "policy mean": Writer(("policy", "mean", "best", "best", "-o", "t.npz"), ("t.npz",), again=("--force",)),
    "compare, results": Writer((*COMPARE, "--results", "r.parquet"), ("r.parquet",), whole=whole.results),
    "compare, more results": Writer(
        (*COMPARE, "--results", "r.parquet"), ("r.parquet",), {"r.parquet": "known.parquet"}, whole=whole.results
    ),
    "compare, JUnit and plot": Writer(
        (*COMPARE, "--junit", "r.xml", "--plot", "r.png"), ("r.xml", "r.png"), again=("--force",)
    ),
    "recover": Writer(
        ("recover", "cut.mcap", "-o", "a.mcap"),
        ("a.mcap",),
        {"cut.mcap": "cut-run.mcap"},
        again=("--force",),
        partials=("a.mcap.recovering",),
    ),
    "export": Writer(
        ("export", "run.mcap", "--parquet", "out"),
        ("out",),
        RUN,
        again=("--force",),
    ),
    "export over another": Writer(
        ("export", "training.mcap", "--parquet", "out", "--force"),
        ("out",),
        TRAINING,
    ),
    "export a dataset": Writer(
        ("export", "played.mcap", "run.mcap", "--rlds", "out"),
        ("out",),
        {**PLAYED, **RUN},
        again=("--force",),
    ),
    "replay what was played": Writer(
        ("replay", "played.mcap", "--every", 2, "-o", "episodes"),
        ("episodes",),
        {**PLAYED, "episodes/.keep": "mine.py"},
        ("--force",),
        partials=("episodes/*.partial",),
    ),
    "golden add": Writer(
        ("golden", "add", "quick", "--policy", "chief", *STEPS, "--name", "plain"),
        ("recordings",),
        whole=whole.golden,
        instead=("golden", "update", "--reason", "It was not finished."),
        partials=("recordings/golden/*.mcap.storing",),
    ),
    "golden update": Writer(
        ("golden", "update", "--reason", "Another choice.", "--dir", "stale"),
        ("stale",),
        STALE,
        whole=whole.golden,
        partials=("stale/*.mcap.storing",),
    ),
    "golden check": Writer(
        ("golden", "check", "stale", "--junit", "g.xml", "--keep", "kept"),
        ("g.xml", "kept"),
        STALE,
        again=("--force",),
        whole=whole.checked,
        partials=("kept/*.mcap.storing",),
    ),
    "diff": Writer(
        ("diff", "run.mcap", "other.mcap", "--html", "d.html", "--junit", "d.xml"),
        ("d.html", "d.xml"),
        TWO,
        ("--force",),
    ),
    "report": Writer(("report", "run.mcap", "-o", "r.html"), ("r.html",), RUN, ("--force",)),
    "report of a training": Writer(("report", "training.mcap", "-o", "r.html"), ("r.html",), TRAINING, ("--force",)),
    "play": Writer(("play", "run.mcap", "-o", "p.html"), ("p.html",), RUN, ("--force",)),
    "play two": Writer(("play", "run.mcap", "other.mcap", "-o", "p.html"), ("p.html",), TWO, ("--force",)),
    "render": Writer(("render", "run.mcap", "-o", "p.png"), ("p.png",), RUN, ("--force",)),
    "render a film": Writer(("render", "run.mcap", "-o", "p.gif", "--every", 6), ("p.gif",), RUN, ("--force",)),
    "fork": Writer(
        ("fork", "run.mcap", "--at", 3, "--policy", "easiest", "--record", "f.mcap"),
        ("f.mcap",),
        RUN,
        ("--force",),
        partials=("f.mcap.partial",),
        whole=whole.run_up_to,
    ),
    "replay": Writer(
        ("replay", "training.mcap", "--every", 5, "-o", "episodes"),
        ("episodes",),
        {**TRAINING, "episodes/.keep": "mine.py"},
        ("--force",),
        partials=("episodes/*.partial",),
    ),
    "view": Writer(("view", "run.mcap", "--save", "v.rrd"), ("v.rrd",), RUN, ("--force",), whole=whole.rrd),
    "scenarios show": Writer(("scenarios", "show", "quick", "-o", "s.png"), ("s.png",), {}, ("--force",)),
    "scenarios new": Writer((*NEW, "-o", "n.yaml"), ("n.yaml",), {}, ("--force",)),
    "scenarios new, several": Writer(
        (*NEW, "--n", 2, "-o", "n.yaml"), ("n.yaml", "n-1.yaml", "n-2.yaml"), {}, ("--force",)
    ),
    "reproduce": Writer(
        ("reproduce", "--repetitions", 1, "--seeds", 2, "--jobs", 1, "--out", "found"),
        ("found",),
        {"small.yaml": "mine.py"},
        ("--resume", "--force"),
        whole=whole.reproduction,
        before=whole.small_paper,
    ),
}
if HAS_MINARI:
    WRITERS["export for Minari"] = Writer(
        ("export", "played.mcap", "--minari", "mine-v0"),
        ("minari",),
        PLAYED,
        again=("--force",),
    )
OFTEN: Final = tuple(name for name in WRITERS if name != "reproduce")


@dataclass(frozen=True)
class Whole:
    """What a call that nobody kills makes of it.

    Attributes:
        files: what it finds and leaves, by name.
        code: its exit code.
        n_events, seconds: how often it touches a file, and how long it takes.
        same: it leaves the same bytes each time.
    """

    files: dict[str, bytes]
    code: int
    n_events: int
    seconds: float
    same: bool


@functools.cache
def whole_call(name: str, material: Path) -> Whole:
    """Return what a whole call of a writer leaves; it is worked out once in a campaign."""
    known = material / f"whole-{name.replace(' ', '-')}.pickle"
    if known.exists():
        found: Whole = pickle.loads(known.read_bytes())  # noqa: S301 - written below, by this campaign
        return found
    found = _whole_call(name, material)
    scratch = known.with_suffix(f".{os.getpid()}")
    scratch.write_bytes(pickle.dumps(found))
    scratch.replace(known)
    return found


def _whole_call(name: str, material: Path) -> Whole:
    writer = WRITERS[name]
    found = []
    for _ in range(2):
        place = Path(tempfile.mkdtemp(prefix="whole-", dir=material.parent))
        bench = Bench(place, material)
        bench.bring(writer.given)
        done = calls.forked(writer.words, bench.folder, io=place / "io", before=writer.before, cpu_seconds_max=60)
        assert done.code in {0, 1}, f"{writer.words}: {done.err}"
        found.append((bench.files(), done))
        shutil.rmtree(place)
    (files, done), (again, _) = found
    return Whole(files, done.code, done.n_events, done.cpu_seconds, files == again)


def look(bench: Bench, writer: Writer, expected: Whole, given: dict[str, bytes], *, killed: bool) -> None:
    """Look for half files under final names, and for scratch files that should not be there."""
    for name, data in bench.files().items():
        is_final = any(name == final or name.startswith(f"{final}/") for final in writer.finals)
        if any(Path(name).match(one) or name.startswith(f"{one}/") for one in (*writer.partials, *writer.kept)):
            continue
        if any(part.startswith(SCRATCH) for part in Path(name).parts):
            bench.outcome.expect(killed, f"{name}: a scratch file is left after an interrupt")
        elif data in (given.get(name), expected.files.get(name)):
            continue
        elif is_final and writer.whole is not None:
            fault = writer.whole(bench.folder / name)
            bench.outcome.expect(not fault, f"{name}: {fault}", "half file")
        elif is_final:
            known = expected.same and name in expected.files
            text = f"{name}: {len(data)} bytes, " + (
                f"a whole one has {len(expected.files[name])}" if known else "not known"
            )
            bench.outcome.fail("half file", text)
        else:
            bench.outcome.fail("other", f"{name}: nobody said that this is left")


def missing_files(expected: Whole, bench: Bench) -> list[str]:
    return sorted(expected.files.keys() - bench.files().keys())


def call_again(bench: Bench, name: str, writer: Writer, expected: Whole) -> None:
    """Call it again as a user would: the same words, then those that the complaint names."""
    tries = [
        writer.words,
        *((*writer.words, word) for word in writer.again),
        *([writer.instead] if writer.instead else []),
    ]
    for words in tries:
        done = bench.call(words, codes=DONE_OR_REFUSED | {expected.code}, before=writer.before, cpu_seconds_max=30)
        if done.code == expected.code:
            break
    bench.outcome.expect(done.code == expected.code, f"{name}: a second call does not work: {done.line}")
    if done.code != expected.code:
        return
    missing = missing_files(expected, bench)
    bench.outcome.expect(not missing, f"{name}: the second call did not make {', '.join(missing)}", "half file")
    found = bench.files()
    for file, data in expected.files.items() if expected.same else ():
        fault = writer.whole(bench.folder / file) if writer.whole and found.get(file) != data else ""
        if found.get(file) != data and (fault or writer.whole is None):
            bench.outcome.fail("other", f"{name}: the second call makes another {file} {fault}")
