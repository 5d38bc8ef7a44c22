"""A training as JSON lines, written while it is under way: needs nothing, and any tool can follow it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

from fireworld.arguments import path_of
from fireworld.errors import OutputError, expected
from fireworld.files import check_outputs, json_line, read_text_file, write_file
from fireworld.training.hooks.hook import Hook

if TYPE_CHECKING:
    from fireworld.training.method import Report
    from fireworld.training.training import Training

HEAD: Final = "training"
END: Final = "end"


class JsonlCallback(Hook):
    """Writes a line for the training, one for every report, and one for how it ended.

    Args:
        path: the file. A training that is continued continues it.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = path_of("path", path)
        self._file: IO[str] | None = None

    @property
    def name(self) -> str:
        """The path."""
        return str(self._path)

    @property
    def path(self) -> Path:
        """The file."""
        return self._path

    def check(self, training: Training) -> None:
        """Raise OutputError if the file is in the way, or there is no folder for it."""
        check_outputs([self._path], force=training.force or training.continues, inputs=training.outputs)

    def begin(self, training: Training) -> None:
        """Write the first line; or take out what is after the checkpoint that a training continues from."""
        head = json_line({"kind": HEAD, **training.parameters})
        lines = [head]
        if training.continues and self._path.exists():
            found = read_lines(self._path)
            if found and json_line(found[0]) != head:
                raise OutputError(expected(str(self._path), "", "the lines of this training", "those of another one"))
            lines += [json_line(one) for one in found[1:] if one.get("n", training.n_reports) < training.n_reports]
        write_file(self._path, "".join(lines))
        self._file = self._path.open("a", encoding="utf-8", buffering=1)  # a line at a time

    def write(self, training: Training, report: Report) -> None:
        """Write a line: its number, the columns of the log, and what else is drawn of it."""
        known = {"kind": training.trainer.unit, "n": training.n_reports - 1}
        self._write({**known, **training.numbers(report), **report.as_dict()})

    def end(self, training: Training) -> None:
        """Write the last line."""
        digest = None if training.team is None else training.team.digest
        path = None if training.team is None or training.path is None else str(training.path)
        self._write({"kind": END, "ending": training.ending, "team": path, "digest": digest})

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()

    def _write(self, values: Mapping[str, Any]) -> None:
        if self._file is not None:
            self._file.write(json_line(values))


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Return the whole lines of a file of JSON lines; a line that was cut off ends it.

    Raises:
        OutputError: it cannot be read.
    """
    found: list[dict[str, Any]] = []
    for line in read_text_file(path).split("\n"):
        try:
            value = json.loads(line)
        except ValueError:
            break
        if not isinstance(value, dict):
            break
        found.append(value)
    return found
