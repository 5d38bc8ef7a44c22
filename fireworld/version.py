"""The version of fireworld, and how simulators of one version differ; recordings hold both."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import Final

__version__ = "0.1.0"
_SIMULATOR: Final = (
    "city", "draws.py", "events.py", "kernels", "parameters.py", "planning", "policy", "rewards.py", "scenario",
    "scores.py", "simulation",
)  # fmt: skip
_SHOWN: Final = 12


@lru_cache(maxsize=1)
def simulator_digest() -> str:
    """Return a digest of the sources of all that computes a run, 64 hexadecimal digits: the same on every machine."""
    folder = Path(__file__).parent
    content = hashlib.sha256()
    for name in _SIMULATOR:
        place = folder / name
        for path in sorted(place.rglob("*")) if place.is_dir() else [place]:
            if path.suffix in {".py", ".npy"}:
                data = path.read_bytes()
                text = data.replace(b"\r\n", b"\n") if path.suffix == ".py" else data
                content.update(path.relative_to(folder).as_posix().encode() + b"\0" + text + b"\0")
    return content.hexdigest()


def simulator_version(version: str = __version__, digest: str | None = None) -> str:
    """Return a version with the beginning of a simulator's digest, "0.1.0+4a6f0c1d2e3b"; without one if that is "".

    Args:
        version: of fireworld; this one unless another is given.
        digest: of the simulator's sources; None: of this one's.
    """
    found = simulator_digest() if digest is None else digest
    return f"{version}+{found[:_SHOWN]}" if found else version
