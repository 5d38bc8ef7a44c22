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
    """Sends static things and whole columns to a Rerun stream, all below one entity path."""

    def __init__(self, stream: rerun.RecordingStream, prefix: str, steps: NDArray[np.int64]) -> None:
        self.stream = stream
        self.prefix = prefix
        self.steps = steps

    def path(self, path: str) -> str:
        """Full entity path of a layer."""
        return f"{self.prefix}/{path}"

    def static(self, path: str, *archetypes: Any) -> None:
        """Log what does not change in the run."""
        self.stream.log(self.path(path), *archetypes, static=True)

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
    """Columns of plain numbers under names of our own, shown when an instance is selected.

    Args:
        archetype: heading the numbers are shown under.
        columns: name to (rows, width) numbers.
    """
    import pyarrow
    import rerun

    rows, width = next(iter(columns.values())).shape
    flat = {name: pyarrow.array(np.ascontiguousarray(numbers).reshape(-1)) for name, numbers in columns.items()}
    return rerun.DynamicArchetype.columns(archetype, components=flat).partition(np.full(rows, width))
