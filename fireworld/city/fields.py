"""Reading the parts of a JSON document with errors that name file, place and key."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Never

from fireworld.errors import CityError, expected

REQUIRED: Any = object()


@dataclass(frozen=True)
class Fields:
    """One object of a JSON document, and where it was found."""

    where: str
    prefix: str
    """What stands before its keys in errors, such as `streets.`"""
    value: Any

    def refuse(self, key: str, wanted: str, got: object) -> Never:
        """Raise CityError for one key."""
        raise CityError(expected(self.where, f"{self.prefix}{key}".rstrip(".: "), wanted, got))

    def object(self) -> dict[str, Any]:
        """Return the object itself."""
        if not isinstance(self.value, dict):
            self.refuse("", "an object", _kind(self.value))
        found: dict[str, Any] = self.value
        return found

    def allow_only(self, *known: str) -> None:
        """Raise CityError for keys that nobody reads: they are slips of the pen."""
        for key in self.object():
            if key not in known:
                self.refuse(key, f"one of the keys {', '.join(known)}", "another key")

    def get(self, key: str, default: Any) -> Any:
        """Return what a key holds, or its default; REQUIRED has none."""
        found = self.object().get(key, default)
        if found is REQUIRED:
            self.refuse(key, "this key to be there", "an object without it")
        return found

    def text(self, key: str, *, default: Any = REQUIRED) -> str:
        """Read a short text on one line."""
        found = self.get(key, default)
        if not isinstance(found, str) or not 1 <= len(found) <= 100 or not found.isprintable():
            self.refuse(key, "a text of 1 to 100 printable characters", found)
        return found

    def flag(self, key: str, *, default: Any = REQUIRED) -> bool:
        """Read true or false."""
        found = self.get(key, default)
        if not isinstance(found, bool):
            self.refuse(key, "true or false", found)
        return found

    def integer(self, key: str, *, low: int, high: int, default: Any = REQUIRED) -> int:
        """Read a whole number."""
        return self._whole(key, self.get(key, default), low, high)

    def array(self, key: str, *, default: Any = REQUIRED) -> list[Any]:
        """Read an array."""
        found = self.get(key, default)
        if not isinstance(found, list):
            self.refuse(key, "an array", _kind(found))
        return found

    def integers(self, key: str, *, low: int, high: int) -> list[int]:
        """Read an array of whole numbers."""
        return [self._whole(f"{key}.{index}", item, low, high) for index, item in enumerate(self.array(key))]

    def pairs(self, key: str, *, low: int, high: int) -> list[tuple[int, int]]:
        """Read an array, not empty, of pairs of whole numbers."""
        found = self.array(key)
        if not found:
            self.refuse(key, "at least one pair", "an empty array")
        result = []
        for index, item in enumerate(found):
            if not isinstance(item, list) or len(item) != 2:
                self.refuse(f"{key}.{index}", "a pair of whole numbers", item)
            first, second = (self._whole(f"{key}.{index}.{k}", part, low, high) for k, part in enumerate(item))
            result.append((first, second))
        return result

    def _whole(self, key: str, found: Any, low: int, high: int) -> int:
        """Check that something is a whole number between two bounds; true and 2.0 are not."""
        if not isinstance(found, int) or isinstance(found, bool) or not low <= found <= high:
            self.refuse(key, f"a whole number from {low} to {high}", found)
        return found


def _kind(value: Any) -> str:
    """Name the kind of a JSON value."""
    names = {dict: "an object", list: "an array", str: "a text", bool: "true or false", type(None): "no value (null)"}
    return names.get(type(value), "a number")
