"""Learned teams: one base class, one file format, one module for each kind.

* `team.py`: `Team`, `load_team`, and the registry of kinds.
* `NAME_team.py`: a kind of team; `NAME_words.py`: what such a team does, in words.
* `npz.py`: files of arrays with a header; how teams show themselves: `fireworld.shown`.
* Here: the teams that come with fireworld, team files in `fireworld/shipped/teams`, each named without its suffix.

Another kind is a module `NAME_team.py` with a subclass of `Team`; docs/training.md says what it needs.
"""

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
