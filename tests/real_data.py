"""Data of others that is not part of the project: official maps, traces and logs, where they are at hand.

FIREWORLD_REAL_DATA names their folder; else it is looked for at ../shared/real, beside the clone. Tests that need it
skip where it is not there.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

FOLDER = Path(os.environ.get("FIREWORLD_REAL_DATA") or Path(__file__).parents[2] / "shared" / "real")


def real_file(name: str) -> Path:
    """Return the path of a file of the real data; skip the test where it is not there."""
    path = FOLDER / name
    if not path.exists():
        pytest.skip(f"real data is not here: {name} of the folder FIREWORLD_REAL_DATA, or of ../shared/real")
    return path
