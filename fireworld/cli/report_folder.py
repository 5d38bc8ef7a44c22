"""The folder of a reproduction: made, cleared of an earlier one, and written to file by file."""

from __future__ import annotations

from pathlib import Path

from fireworld.errors import OutputError, expected


def make_folder(folder: Path, *, force: bool) -> None:
    """Make the folder, with room for everything in it.

    Raises:
        OutputError: it cannot be made, or something is in it already.
    """
    try:
        if not force and folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise OutputError(
                expected("--out", "", "a free name or an empty folder", str(folder), "--force replaces what is there")
            )
        folder.mkdir(exist_ok=True)
        for name in ("teams", "recordings", "figures"):
            (folder / name).mkdir(exist_ok=True)
        for path in _products(folder):
            path.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"--out: {folder}: cannot be made: {error.strerror or error}") from None


def _products(folder: Path) -> list[Path]:
    """List what an earlier reproduction may have left in a folder, and nothing else."""
    from fireworld.evaluation.sheets import SHEETS
    from fireworld.evaluation.study import TEAMS

    scattered = [path for team in TEAMS for path in folder.glob(f"teams/{team}-*.npz")]
    scattered += [path for team in TEAMS for path in folder.glob(f"recordings/*-{team}.mcap*")]
    return [*scattered, *folder.glob("figures/*.png"), *(folder / name for name in (*SHEETS, "report.html"))]


def write_file(path: Path, data: bytes) -> None:
    """Write a file, beside and renamed.

    Raises:
        OutputError: it cannot be written.
    """
    partial = path.with_name(path.name + ".partial")
    try:
        partial.write_bytes(data)
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from None
