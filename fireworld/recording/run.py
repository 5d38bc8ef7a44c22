"""Run: a run that was made or recorded, as people work with it in Python: outcome, steps, tables, pictures."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, overload

import numpy as np

from fireworld.arguments import path_of
from fireworld.errors import FieldError, LogError, expected, one_line
from fireworld.outcome import QUANTITIES, Outcome, outcome_of
from fireworld.records import Array, CityRecord, RunHeader, StepRecord, StoredRun

if TYPE_CHECKING:
    import pandas
    import polars

    from fireworld.picture import Picture
    from fireworld.recording.pages.notebook import PlayedPage


def open_log(path: str | os.PathLike[str], *, partial: bool = False) -> Run:
    """Open a recording; its hashes are checked now, its steps are read when they are asked for.

    Args:
        path: the log.
        partial: accept a log that was cut off or damaged; it ends at its last good step, and `damage` is not None.

    Raises:
        LogError: it is not a log, or (unless `partial`) is cut off or damaged.
        ArgumentError: it is no path.
    """
    from fireworld_recorder.reader import open_log as open_file

    return Run(open_file(path_of("path", path), partial=partial))


class Run:
    """A run: made by `fireworld.run`, or opened from its recording by `fireworld.open_log`.

    It is a `fireworld.records.Recording`: iterating yields the records of its steps, from step 0, the state before the
    first step; `run[41]` is one of them, `run[-1]` the last.
    """

    def __init__(self, recording: StoredRun) -> None:
        self._recording = recording
        self._last: StepRecord | None = None

    @property
    def header(self) -> RunHeader:
        """What identifies the run: scenario, policy, seed, versions, digests."""
        return self._recording.header

    @property
    def city(self) -> CityRecord:
        """The city it took place in, as arrays."""
        return self._recording.city

    @property
    def steps(self) -> Array:
        """(k,) int64: the steps, rising from 0."""
        return self._recording.steps

    @property
    def digest(self) -> str:
        """Identity of the run, 64 hexadecimal digits: the same on every machine."""
        return self._recording.digest

    @property
    def path(self) -> Path | None:
        """The log; None for a run in memory."""
        return getattr(self._recording, "path", None)

    @property
    def state(self) -> str:
        """Whether the log is complete, partial or damaged; a run in memory is complete."""
        return self._recording.state

    @property
    def damage(self) -> str | None:
        """What is wrong with the log and how far it is good; None if nothing is."""
        return self._recording.damage

    @property
    def outcome(self) -> Outcome:
        """How the run stands after its last step.

        Raises:
            LogError: it has no steps.
        """
        return outcome_of(self[-1], self.city)

    def __len__(self) -> int:
        return len(self.steps)

    def __iter__(self) -> Iterator[StepRecord]:
        return iter(self._recording)

    def __getitem__(self, step: int) -> StepRecord:
        """Return the record of a step.

        Args:
            step: its number; -1 is the last one, -2 the one before it.

        Raises:
            LogError: there is no such step.
        """
        steps = self.steps.tolist()
        number = steps[step] if isinstance(step, int) and -len(steps) <= step < 0 else step
        if number not in steps:
            held = f"a step from {steps[0]} to {steps[-1]}" if steps else "a run that has steps"
            raise LogError(expected(self._name, "step", held, step))
        if number != steps[-1]:
            return self._recording.step(number)
        if self._last is None:
            self._last = self._recording.step(number)
        return self._last

    def step(self, number: int) -> StepRecord:
        """Return the record of a step; as `run[number]`."""
        return self[number]

    def column(self, topic: str, name: str = "") -> Array:
        """Return one field over all steps: (k, width) of an array field, (k,) of a value."""
        return self._recording.column(topic, name)

    def ragged(self, topic: str, name: str = "") -> Sequence[Array]:
        """Return one field over all steps as a list of k arrays; for fields whose length changes."""
        return self._recording.ragged(topic, name)

    def series(self, field: str) -> Array:
        """Return one field over the steps.

        Args:
            field: as in "buildings.temperature" or "/buildings.temperature"; `fireworld info --schema` lists them.

        Returns:
            (steps, n) of a field with a value for each building, brigade or civilian, (steps,) of a single value. Of
            what brigades saw and decided, from step 1 on: nothing is decided before.

        Raises:
            FieldError: there is no such field, or its length changes from step to step; then use `ragged`.
        """
        values = self.ragged(field)
        later = values[1:] if len(values) > 1 and values[0].shape == (0,) else values
        if len({value.shape for value in later}) > 1:
            raise FieldError(f"{field}: its length changes from step to step; use ragged")
        return np.stack(later)

    def to_pandas(self, table: str = "steps") -> pandas.DataFrame:
        """Return a table of the run as a data frame.

        Args:
            table: as `fireworld export` writes them: steps, buildings, brigades, decisions, sites ...

        Raises:
            LogError: there is no such table.
            OutputError: pandas is not installed.
        """
        from fireworld_recorder.tables import to_pandas

        return cast("pandas.DataFrame", to_pandas(self._recording, table))

    def to_polars(self, table: str = "steps") -> polars.DataFrame:
        """Return a table of the run as a data frame of polars; as `to_pandas`."""
        from fireworld_recorder.tables import to_polars

        return cast("polars.DataFrame", to_polars(self._recording, table))

    @overload
    def show(self, what: int) -> Picture: ...
    @overload
    def show(self, what: Literal["play"] = "play") -> PlayedPage: ...
    @overload
    def show(self, what: Literal["rerun"]) -> Any: ...
    def show(self, what: int | str = "play") -> Any:
        """Return something that notebooks show: the page that plays the run, a map, or Rerun's widget.

        Args:
            what: "play"; the number of a step for a map of the city after it, -1 is the last; or "rerun".

        Raises:
            ArgumentError: it is none of these.
            LogError: there is no such step.
            ViewError: the run has no steps; for a map: matplotlib is not installed; for "rerun": Rerun, or its widget.
        """
        if isinstance(what, int):
            from fireworld.recording.pages.pictures import map_of

            return map_of(self, self[what])
        from fireworld.recording.pages.notebook import show_run

        return show_run(self._recording, what)

    def film(
        self,
        path: str | os.PathLike[str],
        *,
        fps: float = 10.0,
        every: int = 1,
        whole: bool = False,
        force: bool = False,
    ) -> Path:
        """Write a film of the run.

        Args:
            path: a .gif or .mp4 file.
            fps: steps a second.
            every: only each n-th step.
            whole: show the whole city, not only the part in which it burns.
            force: replace an existing file.

        Raises:
            OutputError: it cannot be written.
            ViewError: matplotlib is not installed.
        """
        from fireworld.recording.pages.pictures import render_film

        output = path_of("path", path)
        render_film(self._recording, output, fps=fps, every=every, whole=whole, force=force)
        return output

    def view(self, *, save: str | os.PathLike[str] | None = None, force: bool = False) -> None:
        """Open the run in Rerun, or save it for Rerun.

        Args:
            save: an .rrd file to write instead of opening a window.
            force: replace an existing file.

        Raises:
            ViewError: Rerun is not installed, or there is no display.
            OutputError: the file cannot be written.
        """
        from fireworld.recording.pages.view import view

        view(self._recording, save=None if save is None else path_of("save", save), force=force)

    @property
    def _name(self) -> str:
        return str(self.path) if self.path is not None else f"run of {self.header.scenario}"

    def __repr__(self) -> str:
        who = self.header.title
        if not len(self):
            return one_line(f"<Run {who}: no steps>")
        outcome = self.outcome
        shown = ", ".join(f"{item.label} {item.text(outcome)}" for item in QUANTITIES[:3])
        return one_line(f"<Run {who}: {shown}; digest {self.digest[:12]}>")

    def _repr_html_(self) -> str:
        from fireworld.html_page import html_figure, html_table, text_cell
        from fireworld.recording.pages.pictures import map_png

        title = self.header.title
        rows = [[text_cell(escape(label)), escape(text)] for label, text in self._facts().items()]
        parts = [f"<p><b>{escape(title)}</b></p>", html_table(["", ""], rows)]
        png = map_png(self, self[-1]) if len(self) else None
        return "\n".join([*parts, *([html_figure(png, "after the last step")] if png is not None else [])])

    def _facts(self) -> Mapping[str, str]:
        """Return what a reader wants to know first, by label."""
        outcome = self.outcome if len(self) else None
        facts = {item.label: item.text(outcome) for item in QUANTITIES} if outcome is not None else {"steps": "none"}
        return {**facts, "digest": self.digest, **({"damage": self.damage} if self.damage else {})}
