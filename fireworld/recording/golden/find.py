"""Goldens found in their folder: all, those named, or those whose names match an expression."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import Final

from fireworld_recorder.reader import open_log

from fireworld.errors import FireworldError, OutputError, expected
from fireworld.recording.golden.digest import DIGEST_SUFFIX, read_digest
from fireworld.recording.golden.spec import GoldenSpec, path_to, spec_of
from fireworld.recording.golden.store import SUFFIX, is_digest
from fireworld.recording.golden.training import TrainingSpec, training_spec_of
from fireworld.recording.inputs import is_training
from fireworld.training.log.reader import open_training

FOLDER: Final = Path("recordings/golden")
"""Where goldens are, seen from the current folder, unless another place is named."""
_SYNTAX: Final = "parts of names joined by and, or, not and parentheses, as in 'quick and not planner'"
_WORDS: Final = ("and", "or", "not", "(", ")")
Matches = Callable[[str], bool]


def find_goldens(folder: Path = FOLDER, names: Collection[str] = (), *, matching: str = "") -> list[Path]:
    """Return the goldens of a folder, or those of the given names, sorted by name.

    Args:
        folder: where they are.
        names: of those that are wanted; all if there are none.
        matching: an expression that the name must match too, as pytest's -k: parts of names, and, or, not.

    Raises:
        OutputError: there are none, not the ones named, or none that matches; the expression makes no sense; or one is
            there both as a recording and as a digest.
    """
    found = _goldens_by_name(folder)
    if not found:
        got = "a folder without any" if folder.is_dir() else "no such folder"
        wanted = f"a folder of goldens (*{SUFFIX}, *{DIGEST_SUFFIX})"
        raise OutputError(expected(str(folder), "", wanted, got, "try `fireworld golden add`"))
    for name in names:
        if name not in found:
            near = get_close_matches(name, found, n=1)
            hint = f"try {near[0]}" if near else "`fireworld golden list` lists them"
            raise OutputError(expected(str(folder), "", "the name of a golden", name, hint))
    matches = matcher(matching) if matching else lambda _: True
    kept = [path for name, path in found.items() if (not names or name in names) and matches(name)]
    if not kept:
        raise OutputError(expected(str(folder), "-k", "the name of a golden to match", matching))
    return kept


def _files_in(folder: Path) -> list[Path]:
    return [*folder.glob(f"*{SUFFIX}"), *folder.glob(f"*{DIGEST_SUFFIX}")]


def _goldens_by_name(folder: Path) -> dict[str, Path]:
    found: dict[str, Path] = {}
    for path in sorted(_files_in(folder), key=lambda path: path.stem):
        if path.stem in found:
            both = f"{path.stem}{SUFFIX} and {path.stem}{DIGEST_SUFFIX}"
            raise OutputError(
                expected(str(folder), path.stem, "a recording or a digest", f"both, {both}", "remove one")
            )
        found[path.stem] = path
    return found


def spec_in(path: Path) -> GoldenSpec | TrainingSpec:
    """Return the spec of a golden; LogError if it cannot be read."""
    if is_digest(path):
        return read_digest(path).spec
    return training_spec_of(open_training(path).header) if is_training(path) else spec_of(open_log(path).header)


def unused_goldens(folder: Path, *, used: Collection[Path], ran: Collection[Path], whole: bool) -> list[Path]:
    """Return the goldens of tests that no test uses any more; never one that no test made.

    Args:
        folder: of the goldens.
        used: those that tests have used, with any ending.
        ran: files of tests all of whose tests ran.
        whole: all tests ran that there are: then goldens of files that are gone are unused, too.
    """
    stems = {path.with_suffix("") for path in used}
    return [
        path
        for path in sorted(_files_in(folder))
        if path.with_suffix("") not in stems and _is_unused(path, ran=ran, whole=whole)
    ]


def _is_unused(path: Path, *, ran: Collection[Path], whole: bool) -> bool:
    try:
        test = spec_in(path).test
    except FireworldError:
        return False  # nobody knows whose it is
    file = path_to(path.parent, test)
    return bool(test) and (file in ran or (whole and not file.exists()))


def matcher(expression: str) -> Matches:
    """Return a test of names by an expression; case does not matter (OutputError: no such syntax)."""
    tokens = re.findall(r"[()]|[^\s()]+", expression)
    rest = iter([*tokens, ""])
    state = _Reader(rest, next(rest), expression)
    found = state.either()
    if state.word or not tokens:
        raise state.error()
    return found


class _Reader:
    """Reads an expression, word by word."""

    def __init__(self, rest: Iterator[str], word: str, expression: str) -> None:
        self.word = word
        self._rest, self._expression = rest, expression

    def either(self) -> Matches:
        """Read parts that are joined by or."""
        return self._joined("or", self._both, any)

    def error(self) -> OutputError:
        """Return what says how it should be written."""
        return OutputError(expected("-k", "", _SYNTAX, self._expression))

    def _both(self) -> Matches:
        return self._joined("and", self._one, all)

    def _joined(self, word: str, read: Callable[[], Matches], decide: Callable[[Iterable[bool]], bool]) -> Matches:
        """Read parts that are joined by a word; `decide` says what they come to."""
        parts = [read()]
        while self._take(word):
            parts.append(read())
        return lambda name: decide(part(name) for part in parts)

    def _one(self) -> Matches:
        if self._take("not"):
            inner = self._one()
            return lambda name: not inner(name)
        if self._take("("):
            inner = self.either()
            if not self._take(")"):
                raise self.error()
            return inner
        part = self.word.lower()
        if not part or part in _WORDS:
            raise self.error()
        self.word = next(self._rest)
        return lambda name: part in name.lower()

    def _take(self, word: str) -> bool:
        if self.word.lower() != word:
            return False
        self.word = next(self._rest)
        return True
