"""What a verification of any recording has: whether it came out the same, and whether it is the one that is trusted."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final

from fireworld.arguments import ArgumentError
from fireworld.errors import expected
from fireworld.version import simulator_version

TRUST_LEAST: Final = 12
"""Digits of a digest that identify a recording, for who does not write all 64."""


@dataclass(frozen=True, repr=False, kw_only=True)
class Verified:
    """Whether a recording is still what this fireworld computes, and is what it was trusted for; true if both."""

    name: str
    """The recording's file, or what was run."""
    digest: str
    """Of the recording."""
    recorded_by: str
    """Version of the simulator that recorded it, and the beginning of its digest, if the recording has that."""
    trust: str = ""
    """What the digest should be, or begin with; "": anything."""
    difference: Any = None
    """How it differs when it is computed again, the recording's values as `a`; None if it does not."""

    @property
    def same(self) -> bool:
        """Whether everything is computed as it is recorded."""
        return self.difference is None

    @property
    def is_trusted(self) -> bool:
        """Whether the digest is the one that was asked for, if one was."""
        return self.digest.startswith(self.trust)

    def __bool__(self) -> bool:
        return self.same and self.is_trusted

    @property
    def notes(self) -> list[str]:
        """What to know of a recording that is not verified, line by line: of its digest, and of its simulator."""
        lines = []
        if not self.is_trusted:
            lines.append(expected(self.name, "digest", self.trust, self.digest, "this is not the recording you trust"))
        if not self.same and self.recorded_by != simulator_version():
            lines.append(f"recorded by fireworld {self.recorded_by}; this is {simulator_version()}")
        return lines

    def known(self) -> dict[str, Any]:
        """Return the beginning of what `fireworld verify --json` writes."""
        trusted = {"trust": self.trust, "is_trusted": self.is_trusted} if self.trust else {}
        return {"same": self.same, **trusted, "recorded_by": self.recorded_by}


def trust_of(value: object) -> str:
    """Return a digest that a recording should have, or its beginning; "" for None.

    Raises:
        ArgumentError: it is no digest.
    """
    if value is None:
        return ""
    digits = value.lower() if isinstance(value, str) else ""
    if not re.fullmatch(f"[0-9a-f]{{{TRUST_LEAST},64}}", digits):
        wanted = f"a digest: {TRUST_LEAST} to 64 hexadecimal digits, as `fireworld info` shows it"
        raise ArgumentError(expected("trust", "", wanted, value))
    return digits
