"""The teams that come with fireworld: the team files in `fireworld/shipped/teams`, each named without its suffix."""

from __future__ import annotations

from pathlib import Path
from typing import Final

_FOLDER: Final = Path(__file__).parents[2] / "shipped" / "teams"
_SUFFIX: Final = ".npz"


def team_names() -> list[str]:
    """Return the names of the teams."""
    return sorted(path.stem for path in _FOLDER.glob(f"*{_SUFFIX}"))


def team_path(name: str) -> Path:
    """Return the file of a team."""
    return _FOLDER / f"{name}{_SUFFIX}"
