"""Stage: where a recording's layers are put, below one prefix and on the one `step` timeline of a Rerun stream."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import rerun

TIMELINE: Final = "step"
CHUNK_BYTES: Final = 1 << 20
"""Size of the pieces in which wide data is sent: a viewer loads and drops whole chunks."""


class Stage:
    """Sends static things and whole columns to a Rerun stream, all below one entity path.

    Steps may come in several parts, one after another: what is static is sent once, and what is told only where it
    changes is compared with the last step of the part before.

    Args:
        stream: where to.
        prefix: entity path, "" or like "/a".
        steps: (k,) steps of the first part.
        name: what this run is called beside another, "" where it is alone.
    """

    def __init__(self, stream: rerun.RecordingStream, prefix: str, steps: NDArray[np.int64], *, name: str = "") -> None:
        self.stream = stream
        self.prefix = prefix
        self.steps = steps
        self.name = name
        self._sent: set[str] = set()
        self._last: dict[str, NDArray[Any]] = {}

    def path(self, path: str) -> str:
        """Full entity path of a layer."""
        return f"{self.prefix}/{path}"

    def static(self, path: str, *archetypes: Any) -> None:
        """Log what does not change in the run; only the first time for each path."""
        if path not in self._sent:
            self._sent.add(path)
            self.stream.log(self.path(path), *archetypes, static=True)

    def has(self, path: str) -> bool:
        """Whether anything static was sent to a path."""
        return path in self._sent

    def changed(self, path: str, numbers: NDArray[Any]) -> NDArray[np.int64]:
        """Return the rows of (k, w) numbers that differ from the row before, over all parts; the very first counts.

        Args:
            path: what the numbers are of; one call for each part.
            numbers: of the steps of this part.
        """
        if len(numbers) == 0:
            return np.zeros(0, dtype=np.int64)
        last = self._last.get(path)
        differs = np.ones(len(numbers), dtype=bool)
        differs[1:] = np.any(numbers[1:] != numbers[:-1], axis=1)
        differs[0] = last is None or not np.array_equal(last, numbers[0])
        self._last[path] = numbers[-1].copy()
        return np.flatnonzero(differs)

    def rows(self, path: str, *columns: Any, steps: Sequence[int] | NDArray[np.int64] | None = None) -> None:
        """Send columns of one row for each step of the recording, or for each of the steps given.

        Args:
            path: entity path below the prefix.
            columns: column lists of archetypes, already partitioned into rows.
            steps: (rows,) step of each row; steps may repeat.
        """
        import rerun

        rows = self.steps if steps is None else steps
        index = rerun.TimeColumn(TIMELINE, sequence=rows)
        self.stream.send_columns(self.path(path), indexes=[index], columns=[one for many in columns for one in many])

    def blocks(self, bytes_per_step: int, rows: NDArray[np.int64] | None = None) -> Iterator[NDArray[np.int64]]:
        """Split the recording's rows, or those given, into blocks of about CHUNK_BYTES."""
        every = np.arange(len(self.steps)) if rows is None else rows
        size = max(1, CHUNK_BYTES // max(1, bytes_per_step))
        for start in range(0, len(every), size):
            yield every[start : start + size]


def values(archetype: str, columns: Mapping[str, NDArray[Any]]) -> Any:
    """Columns of plain numbers under names of our own, shown when an instance is selected; NaN becomes nothing.

    Args:
        archetype: heading the numbers are shown under.
        columns: name to (rows, width) numbers.
    """
    import rerun

    rows, width = next(iter(columns.values())).shape
    flat = {name: _arrow(np.ascontiguousarray(numbers).reshape(-1)) for name, numbers in columns.items()}
    return rerun.DynamicArchetype.columns(archetype, components=flat).partition(np.full(rows, width))


def _arrow(numbers: NDArray[Any]) -> Any:
    """Make an Arrow array of (k,) numbers; NaN becomes null, with 0 below it: Rerun compares what lies below, too."""
    import pyarrow

    missing = np.isnan(numbers) if numbers.dtype.kind == "f" else np.zeros(0, dtype=bool)
    if not missing.any():
        return pyarrow.array(numbers)
    return pyarrow.array(np.where(missing, numbers.dtype.type(0), numbers), mask=missing)
