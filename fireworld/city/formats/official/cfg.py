"""*.cfg of the official program: keys and values, comments, files included."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import PurePosixPath
from typing import Final, Never

from fireworld.errors import CityError, expected

ROOTS: Final = ("kernel.cfg", "kernel-inline.cfg")
"""The file that the official program starts from: the first of these that is there."""
ALONE: Final = ("common.cfg", "gis.cfg", "resq-fire.cfg", "misc.cfg")
"""Files that are read even if nothing includes them."""
TRUE: Final = frozenset({"true", "t", "yes", "y", "1"})
FALSE: Final = frozenset({"false", "f", "no", "n", "0"})
DEPTH_MAX: Final = 20
SEPARATOR: Final = re.compile(r"\+?[:=]")


@dataclass(frozen=True)
class Value:
    """The text of a key, and the file it is from."""

    text: str
    where: str


@dataclass
class Config:
    """A configuration; empty where a map has none."""

    where: str = "configuration"
    values: dict[str, Value] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)
    """Files that are included and not there, or elsewhere."""

    def text(self, key: str, default: str | None = None) -> str | None:
        """Return the text of a key, else the default."""
        found = self.values.get(key)
        return default if found is None else found.text

    def flag(self, key: str, *, default: bool) -> bool:
        """Return what a key says, true or false; CityError if it is neither."""
        text = self.text(key)
        if text is None:
            return default
        if text.lower() not in TRUE | FALSE:
            self.refuse(key, "true or false")
        return text.lower() in TRUE

    def whole(self, key: str, *, low: int, high: int, default: int | None = None) -> int:
        """Return the whole number of a key; CityError if it is none, or there is none and no default."""
        text = self.text(key)
        if text is None and default is not None:
            return default
        if text is None or not re.fullmatch(r"[+-]?\d{1,18}", text) or not low <= int(text) <= high:
            self.refuse(key, f"a whole number from {low} to {high}")
        return int(text)

    def refuse(self, key: str, wanted: str) -> Never:
        """Raise CityError for a key; it names the file."""
        found = self.values.get(key)
        raise CityError(
            expected(found.where if found else self.where, key, wanted, found.text if found else "no value")
        )


def read_config(files: Mapping[str, bytes], *, where: str) -> Config:
    """Read a configuration from the contents of a folder's files by their names, relative to the folder.

    Raises:
        CityError: which names file and line: not UTF-8, a line that is neither a key nor a comment.
    """
    config = Config(where=where)
    seen: set[str] = set()
    for name in (next((root for root in ROOTS if root in files), None), *ALONE):
        if name is not None and name in files:
            _read(config, files, name, seen, 0)
    return config


def _read(config: Config, files: Mapping[str, bytes], name: str, seen: set[str], depth: int) -> None:
    """Read one file, and those that it includes where it does."""
    if name in seen or depth > DEPTH_MAX:
        return
    seen.add(name)
    where = f"{config.where}/{name}"
    try:
        lines = files[name].decode("utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise CityError(expected(where, "", "text in UTF-8", f"another byte at offset {error.start}")) from None
    for number, line in enumerate(lines, start=1):
        text = line.partition("#")[0].strip()
        if text.startswith("!include"):
            target = text.removeprefix("!include").strip()
            inside = _inside(name, target)
            if inside is not None and inside in files:
                _read(config, files, inside, seen, depth + 1)
            else:
                config.missing.append(target)
        elif text:
            _assign(config, text, where=where, number=number)


def _assign(config: Config, text: str, *, where: str, number: int) -> None:
    """Take `key : value`, `key = value` or `key +: value`, which appends."""
    found = SEPARATOR.search(text)
    key = text[: found.start()].strip() if found else ""
    if found is None or not key:
        raise CityError(expected(where, f"line {number}", "key : value, !include FILE or # comment", text))
    value = text[found.end() :].strip()
    if found.group().startswith("+") and key in config.values:
        value = f"{config.values[key].text} {value}"
    config.values[key] = Value(value, where)


def _inside(name: str, target: str) -> str | None:
    """Return the name of an included file relative to the folder; None if it is outside."""
    path = PurePosixPath(target)
    if path.is_absolute() or ".." in path.parts:
        return None
    return str(PurePosixPath(name).parent / path)
