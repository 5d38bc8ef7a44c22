"""The folder of a reproduction: made, cleared of an earlier one, and written to file by file."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from fireworld.errors import OutputError, expected

SETTINGS: Final = "kept/settings.json"
"""What the work in a folder was begun with."""
FOLDERS: Final = ("kept", "teams", "recordings", "figures")


def make_folder(folder: Path, *, force: bool) -> None:
    """Make the folder, with room for everything in it.

    Raises:
        OutputError: it cannot be made, or something is in it already.
    """
    try:
        if not force and folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            begun = "--resume goes on with it, " if (folder / SETTINGS).is_file() else ""
            hint = f"{begun}--force replaces what is there"
            raise OutputError(expected("--out", "", "a free name or an empty folder", str(folder), hint))
        folder.mkdir(exist_ok=True)
        for name in FOLDERS:
            (folder / name).mkdir(exist_ok=True)
        (folder / SETTINGS).unlink(missing_ok=True)  # the first to go: half a clearance is nothing to go on from
        for path in _products(folder):
            path.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"--out: {folder}: cannot be made: {error.strerror or error}") from None


def find_folder(folder: Path) -> None:
    """See that there is a reproduction in a folder to go on with.

    Raises:
        OutputError: there is none.
    """
    if not (folder / SETTINGS).is_file():
        got = f"no {folder / SETTINGS}"
        raise OutputError(expected("--resume", "", "a reproduction to go on with", got, "leave out --resume"))
    try:
        for name in FOLDERS:
            (folder / name).mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"--out: {folder}: cannot be made: {error.strerror or error}") from None


def _products(folder: Path) -> list[Path]:
    """List what an earlier reproduction may have left in a folder, and nothing else."""
    from fireworld.reproduction.sheets import SHEETS
    from fireworld.reproduction.study import TEAMS

    scattered = [path for name in ("training", "tests") for path in folder.glob(f"kept/{name}-*.json*")]
    scattered += [path for team in TEAMS for path in folder.glob(f"teams/{team}-*.npz*")]
    scattered += [path for team in TEAMS for path in folder.glob(f"recordings/*-{team}.mcap*")]
    return [*scattered, *folder.glob("figures/*.png"), *(folder / name for name in (*SHEETS, "report.html"))]
