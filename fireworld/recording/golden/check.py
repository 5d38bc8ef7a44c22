"""Golden recordings, checked and stored: where the orders of the simulator's side meet the recorder."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from fireworld.errors import FireworldError, OutputError, expected
from fireworld.files import write_file
from fireworld.recording.golden.text import golden_text, tells_of
from fireworld.records import MemoryRecording, RunHeader

if TYPE_CHECKING:
    from fireworld_recorder.diff import Difference

    from fireworld.recording.golden.order import Order
    from fireworld.simulation.built import CityCache
    from fireworld.simulation.run import PreparedRun

SUFFIX: Final = ".mcap"
TEXT_SUFFIX: Final = ".txt"
Result = Literal["same", "different", "cannot"]


@dataclass(frozen=True, kw_only=True)
class Checked:
    """What came of running a golden again."""

    path: Path
    header: RunHeader | None = None
    """Of the golden; None if it cannot be read."""
    fresh: MemoryRecording | None = None
    """The new run; None if there was none."""
    difference: Difference | None = None
    error: str = ""
    """Why it could not be run or compared."""
    text_is_foreign: bool = False
    """The text beside the golden is of another recording, or missing."""

    @property
    def name(self) -> str:
        """Name of the golden."""
        return self.path.stem

    @property
    def result(self) -> Result:
        """How it went."""
        if self.difference is None:
            return "cannot"
        return "same" if self.difference.same and not self.text_is_foreign else "different"

    @property
    def sentence(self) -> str:
        """What is wrong, in a line; empty if nothing is."""
        if self.difference is None:
            return self.error
        if self.difference.first is not None:
            return self.difference.first.sentence
        if self.text_is_foreign:
            return f"{text_path(self.path).name}: expected the text of this recording, found none or another's"
        return ""


def text_path(path: Path) -> Path:
    """Return where the text of a golden is."""
    return path.with_suffix(TEXT_SUFFIX)


def find_goldens(folder: Path, names: Collection[str] = ()) -> list[Path]:
    """List the goldens of a folder, or those of the given names, by name.

    Raises:
        OutputError: there are none, or not the ones named.
    """
    found = {path.stem: path for path in sorted(folder.glob(f"*{SUFFIX}"), key=lambda path: path.stem)}
    if not found:
        got = "a folder without any" if folder.is_dir() else "no such folder"
        raise OutputError(
            expected(str(folder), "", f"a folder of golden recordings (*{SUFFIX})", got, "try `fireworld golden add`")
        )
    for name in names:
        if name not in found:
            near = get_close_matches(name, found, n=1)
            hint = f"try {near[0]}" if near else "`fireworld golden check` lists them"
            raise OutputError(expected(str(folder), "", "the name of a golden", name, hint))
    return [path for name, path in found.items() if not names or name in names]


def check_golden(path: Path, *, cities: CityCache | None = None) -> Checked:
    """Run a golden's order again and compare; what cannot be done is told in the result."""
    from fireworld_recorder.reader import open_log

    from fireworld.recording.golden.order import order_of, prepare_golden

    header: RunHeader | None = None
    try:
        header = open_log(path).header
        order = order_of(header)
        fresh = carry_out(prepare_golden(order, path.parent, recorded=header, cities=cities))
        return compare_golden(path, fresh, order)
    except FireworldError as error:
        return Checked(path=path, header=header, error=str(error))


def carry_out(run: PreparedRun) -> MemoryRecording:
    """Let a run happen.

    Raises:
        PolicyError: the policy fails.
    """
    return MemoryRecording(run.header, run.city, list(run))


def compare_golden(path: Path, fresh: MemoryRecording, order: Order) -> Checked:
    """Compare a golden with a new run of its order.

    Raises:
        LogError: the golden cannot be read, or the order names fields that there are not.
    """
    from fireworld_recorder.diff import compare
    from fireworld_recorder.reader import open_log

    log, beside = open_log(path), text_path(path)
    text = beside.read_text(encoding="utf-8", errors="replace") if beside.is_file() else ""
    return Checked(
        path=path,
        header=log.header,
        fresh=fresh,
        difference=compare(log, fresh, tolerances=order.tolerances, ignore=order.ignore),
        text_is_foreign=not tells_of(text, log),
    )


def is_current(path: Path, fresh: MemoryRecording, order: Order) -> bool:
    """Whether a golden is there, was made by this order and is the same as a new run of it."""
    from fireworld_recorder.reader import open_log

    from fireworld.recording.golden.order import order_of

    try:
        if order_of(open_log(path).header) != order:
            return False
        difference = compare_golden(path, fresh, order).difference
    except FireworldError:
        return False
    return difference is not None and difference.same


def store_golden(path: Path, fresh: MemoryRecording) -> None:
    """Write a golden and its text, replacing what is there; each is written beside and renamed.

    Raises:
        OutputError: they cannot be written.
    """
    store_recording(path, fresh)
    store_text(path)


def store_recording(path: Path, fresh: MemoryRecording) -> None:
    """Write a recording, replacing what is there.

    Raises:
        OutputError: it cannot be written.
    """
    from fireworld_recorder.writer import LogWriter

    with LogWriter(path, fresh.header, fresh.city, force=True) as writer:
        for record in fresh:
            writer.write(record)


def store_text(path: Path) -> bool:
    """Write the text of a golden if it is not there as it would be; return whether it was not.

    Raises:
        LogError: the golden cannot be read.
        OutputError: the text cannot be written.
    """
    from fireworld_recorder.reader import open_log

    text, beside = golden_text(open_log(path)).encode(), text_path(path)
    if beside.is_file() and beside.read_bytes() == text:
        return False
    write_file(beside, text)
    return True


def make_golden_folder(folder: Path) -> None:
    """Make a folder for goldens, if it is not there.

    Raises:
        OutputError: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made: {error.strerror or error}") from None


def changes(difference: Difference) -> list[str]:
    """Say line by line what else is different: in what was asked for, and in the totals."""
    lines = [f"{_words(key)}: {_value(b)}, was {_value(a)}" for key, (a, b) in difference.header.items()]
    before, now = (totals.as_json() for totals in difference.totals)
    lines += [f"{_words(key)}: {_value(now[key])}, was {_value(before[key])}" for key in now if now[key] != before[key]]
    return lines


def _words(key: str) -> str:
    return key.replace("_", " ").removeprefix("n ")


def _value(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    text = "none" if value is None else str(value)
    return text[:12] if len(text) == 64 else text  # of a digest as much as tells it from others
