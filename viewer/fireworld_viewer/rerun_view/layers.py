"""The layers of one run in a Rerun stream: entities below one prefix, on the one `step` timeline."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
import rerun
from numpy.typing import NDArray

from fireworld_viewer import colors
from fireworld_viewer.story.narration import LogLine

TIMELINE: Final = "step"
CHUNK_BYTES: Final = 1 << 20
"""Size of the pieces in which wide data is sent: a viewer loads and drops whole chunks."""


_UNNAMED: Final = ", unnamed"
_LETTER_SHARE: Final = 0.0085
"""Width of a letter by that of a timeline."""


class Layers:
    """Sends static entities and whole columns to a Rerun stream, all below one entity path.

    Steps may come in several parts, one after another: what is static is sent once, and what is sent only where it
    changes is compared with the last step of the part before.

    The prefix is an entity path, "" or like "/a"; `steps` are the (k,) steps of the first part, to be set before the
    next one. A run beside another has a name, "" where it is alone. `after_block` is called when a block of wide data
    has been sent: a stream that is kept in memory can be taken out of it then.
    """

    def __init__(
        self,
        stream: rerun.RecordingStream,
        prefix: str,
        steps: NDArray[np.int64],
        *,
        name: str = "",
        after_block: Callable[[], object] | None = None,
    ) -> None:
        self.stream = stream
        self._after_block = after_block
        self.prefix = prefix
        self.steps = steps
        self.name = name
        self._sent: set[str] = set()
        self._last: dict[str, NDArray[Any]] = {}

    def static(self, path: str, *archetypes: Any) -> None:
        """Send what does not change in the run; only the first time for each path."""
        if path not in self._sent:
            self._sent.add(path)
            self.stream.log(f"{self.prefix}/{path}", *archetypes, static=True)

    def has(self, path: str) -> bool:
        """Return whether anything static was sent to a path."""
        return path in self._sent

    def changed(self, path: str, numbers: NDArray[Any]) -> NDArray[np.int64]:
        """Return the rows of (k, w) numbers that differ from the row before, over all parts; the very first counts.

        Call it once in each part for what is named by the path.
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
        """Send column lists of archetypes: a row for each step of this part, or for each of the steps given."""
        index = rerun.TimeColumn(TIMELINE, sequence=self.steps if steps is None else steps)
        every = [one for many in columns for one in many]
        self.stream.send_columns(f"{self.prefix}/{path}", indexes=[index], columns=every)

    def blocks(self, bytes_per_step: int, rows: NDArray[np.int64] | None = None) -> Iterator[NDArray[np.int64]]:
        """Split the rows of this part, or those given, into blocks of about CHUNK_BYTES."""
        every = np.arange(len(self.steps)) if rows is None else rows
        size = max(1, CHUNK_BYTES // max(1, bytes_per_step))
        for start in range(0, len(every), size):
            yield every[start : start + size]
            if self._after_block is not None:
                self._after_block()

    def numbers(self, path: str, archetype: str, columns: Mapping[str, NDArray[Any]]) -> None:
        """Send (k, width) numbers by name, in blocks, shown under a heading when an instance is selected."""
        bytes_per_step = sum(column.shape[1] * column.itemsize for column in columns.values())
        for block in self.blocks(bytes_per_step):
            part = {name: column[block] for name, column in columns.items()}
            self.rows(path, number_columns(archetype, part), steps=self.steps[block])

    def strips(
        self, path: str, strips: NDArray[np.float32], per_step: NDArray[Any], *, radius_m: float, rgb: colors.Rgb
    ) -> None:
        """Send line strips, (strips, points, 3), `per_step` of them for each step; nothing if there never were any."""
        if len(strips) == 0 and not self.has(path):
            return
        self.static(path, rerun.LineStrips3D.from_fields(radii=[radius_m], colors=colors.single(rgb)))
        self.rows(path, rerun.LineStrips3D.columns(strips=strips).partition(per_step))

    def states(
        self,
        path: str,
        codes: NDArray[np.integer],
        names: Sequence[str],
        rgb: Sequence[colors.Rgb],
        *,
        complete: bool = False,
    ) -> None:
        """Send a timeline of states: a row wherever the code, (k,) index into names and colors, changes.

        complete: there are no further parts, so that it is known which bands are too short for their names. Rerun cuts
        names where a band ends; these get a state of their own, without one.
        """
        unnamed = [name + _UNNAMED for name in names]
        configuration = rerun.StateConfiguration(
            values=[*names, *unnamed], labels=[*names, *(" " for _ in names)], colors=colors.packed_table([*rgb, *rgb])
        )
        self.static(path, configuration)
        changed = self.changed(path, codes[:, np.newaxis])
        if not len(changed):
            return
        states = [names[code] for code in codes[changed]]
        if complete:
            ends = np.append(self.steps[changed[1:]], self.steps[-1] + 1)
            share = (ends - self.steps[changed]) / (self.steps[-1] + 1 - self.steps[0])
            states = [
                name if one >= _LETTER_SHARE * (len(name) + 1) else name + _UNNAMED
                for name, one in zip(states, share, strict=True)
            ]
        self.rows(path, rerun.StateChange.columns(state=states), steps=self.steps[changed])

    def text(self, path: str, lines: Iterable[LogLine]) -> None:
        """Send lines of text, each at its step, with which it begins: Rerun's own column cuts steps from 100 on."""
        if table := list(lines):
            steps, levels, words, rgb = zip(*table, strict=True)
            texts = [f"{step}  {text}" for step, text in zip(steps, words, strict=True)]
            columns = rerun.TextLog.columns(text=texts, level=levels, color=colors.packed_table(rgb))
            self.rows(path, columns, steps=np.array(steps, dtype=np.int64))


def number_columns(archetype: str, columns: Mapping[str, NDArray[Any]]) -> Any:
    """Return columns of (rows, width) numbers under names and a heading of our own; NaN becomes nothing."""
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
