"""User-facing errors; each writes its own one-line message."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from typing import Final

SHOWN_MAX: Final = 80
"""Characters of a user's value that a message shows."""
DETAIL_MAX: Final = 200
"""Characters of another exception's message that a message shows."""


class FireworldError(Exception):
    """Base of every error that a user's input, file or flag can cause; its message is one printable line."""

    def __str__(self) -> str:
        return one_line(super().__str__())


class ScenarioError(FireworldError):
    """A scenario that cannot be read or makes no sense."""


class CityError(FireworldError):
    """A city or map that cannot be read or cannot be simulated."""


class TraceError(FireworldError):
    """A reference trace that cannot be read or does not fit its city."""


class PolicyError(FireworldError):
    """A policy that cannot be found, loaded or asked for a decision."""


class TrainingError(FireworldError):
    """A curriculum, method, team file or checkpoint that cannot be used."""


class LogError(FireworldError):
    """A recording that cannot be read, written, compared or replayed."""


class FieldError(LogError, ValueError):
    """A field that recordings do not have, or that has another length in every step."""


class ViewError(FireworldError):
    """A view that cannot be made here: no viewer, no display, cities that differ."""


class OutputError(FireworldError):
    """An output that cannot be written: it exists, its folder does not, the disk is full."""


class LibraryError(FireworldError, ImportError):
    """A library that only a part of fireworld needs, and that is not installed."""


def expected(where: str, key: str, wanted: str, got: object, hint: str = "") -> str:
    """Return an error message in the form that all of fireworld's have.

    Args:
        where: the file (or flag) at fault.
        key: the key inside it, as a dotted path; empty for the whole file.
        wanted: what would have been right.
        got: what was found; shown as Python writes it, shortened.
        hint: what to try, if there is something to try.
    """
    place = f"{where}: {key}" if key else where
    text = _cut(got, SHOWN_MAX) if isinstance(got, str) and " " in got else shown(got)
    return one_line(f"{place}: expected {wanted}, got {text}" + (f"; {hint}" if hint else ""))


def shown(value: object) -> str:
    """Return a value as Python writes it, shortened; only its type, if its class cannot write it."""
    with suppress(Exception, SystemExit):
        return _cut(repr(value), SHOWN_MAX)
    return f"something of type {type(value).__name__}"


def described(error: BaseException) -> str:
    """Return an exception in one line: "ValueError: no such state"; only its type, if its class cannot write it."""
    text = ""
    with suppress(Exception, SystemExit):
        text = _cut(" ".join(str(error).split()), DETAIL_MAX)
    return one_line(f"{type(error).__name__}: {text}" if text else type(error).__name__)


def nearest(name: str, known: Iterable[str], *, n: int = 1, otherwise: str = "") -> str:
    """Return a hint for a name that is not known: "try" and the n most like it, or `otherwise` if none is like it."""
    from difflib import get_close_matches

    found = get_close_matches(name, sorted(known), n=n)
    return f"try {', '.join(found)}" if found else otherwise


def one_line(message: str) -> str:
    """Escape what cannot be printed: a line break in a user's name or key must not make two lines of the message."""
    return "".join(character if character.isprintable() else repr(character)[1:-1] for character in message)


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 3] + "..."
