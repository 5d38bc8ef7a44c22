"""Differences: two recordings or runs, compared step by step."""

from __future__ import annotations

import filecmp
import os
from collections.abc import Collection, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, overload

from fireworld.errors import LogError, expected
from fireworld.files import check_output, write_file
from fireworld.recording.inputs import AnyRun, is_training, open_run, run_name
from fireworld.records import StoredRun
from fireworld.shown import text_table

KEYS_SHOWN: Final = 3
"""Keys of scenarios that cannot be compared."""

if TYPE_CHECKING:
    from fireworld_recorder.diff import RunComparison
    from fireworld_recorder.match import Rules
    from fireworld_recorder.spread import Spread, SpreadRow
    from fireworld_recorder.step_difference import FirstDifference
    from fireworld_recorder.totals import Totals

    from fireworld.cause import Cause
    from fireworld.findings import Finding
    from fireworld.recording.pages.notebook import PlayedPage
    from fireworld.training.log.difference import TrainingDifference
    from fireworld.training.log.reader import TrainingLog


class Difference:
    """How two runs, A and B, compare; made by `diff`.

    Runs of one digest are known to be the same without reading their steps.

    Attributes:
        runs: A and B.
        names: their files, or what they ran.
        known_same: whether the runs have one digest and are compared as a whole.
        rows: how far the difference has come at every step, once `found` is there; empty for runs of one digest.
    """

    def __init__(
        self,
        runs: tuple[StoredRun, StoredRun],
        *,
        tolerances: Mapping[str, float],
        ignore: Collection[str],
        steps: tuple[int | None, int | None],
        known_same: bool,
    ) -> None:
        self.runs = runs
        self.names = run_name(runs[0]), run_name(runs[1])
        self.known_same = known_same
        self.rows: list[SpreadRow] = []
        self._tolerances, self._ignore, self._steps = tolerances, ignore, steps

    @property
    def same(self) -> bool:
        """Whether the runs are the same, whatever their headers say."""
        return self.known_same or self.found.same

    @property
    def first(self) -> FirstDifference | None:
        """The first difference; None if there is none."""
        return None if self.known_same else self.found.first

    @property
    def totals(self) -> tuple[Totals, Totals]:
        """How both runs came out, at the last step of each that was compared."""
        return self.found.totals

    @property
    def header(self) -> Mapping[str, tuple[str | int, str | int]]:
        """What the runs' headers say differently; no difference by itself."""
        from fireworld_recorder.header import header_differences

        return header_differences(self.runs[0].header, self.runs[1].header)

    @cached_property
    def cause(self) -> Cause:
        """What the runs were made of differently: scenario, policy, seed, simulator; no difference by itself."""
        from fireworld.recording.cause import run_cause

        return run_cause(self.runs[0].header, self.runs[1].header)

    @property
    def spread(self) -> Spread:
        """How the difference spread from step to step; empty for runs of one digest."""
        return self.found.spread

    @cached_property
    def rules(self) -> Rules:
        """What is compared, and how exactly."""
        from fireworld_recorder.match import Rules

        return Rules(self._tolerances, self._ignore)

    @cached_property
    def found(self) -> RunComparison:
        """The whole comparison, as the recorder made it."""
        from fireworld_recorder.diff import StepRange, compare

        return compare(
            *self.runs,
            tolerances=self._tolerances,
            ignore=self._ignore,
            steps=StepRange(first=self._steps[0], last=self._steps[1]),
            watch=self.rows.append,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as plain values, as `fireworld diff --json` writes it."""
        from fireworld_recorder.totals import plain

        recordings = [{"path": run_name(run), "state": run.state, "damage": run.damage} for run in self.runs]
        digests = [run.digest for run in self.runs]
        known: dict[str, Any] = {
            "same": self.same,
            "digests": digests,
            "recordings": recordings,
            "cause": self.cause.to_dict(),
            **plain(self.found),
        }
        return known

    def finding(self, *, links: Mapping[str, str] | None = None, picture: str = "") -> Finding:
        """Return the comparison for the pages of a CI server, with links and a picture that are there already."""
        from fireworld.findings import Finding
        from fireworld.recording.difference_text import totals_rows, verdict

        name, cause = f"{self.names[1]} against {self.names[0]}", self.cause
        if self.same:
            lines = cause.lines if cause.changes else ()
            return Finding(name=name, verdict="same", headline="the same", cause=lines, rows=())
        sentence = verdict(self.found)
        return Finding(
            name=name,
            verdict="different",
            headline=f"{cause.short}; {sentence}",
            cause=cause.lines,
            first=sentence,
            heads=("", "A", "B"),
            rows=[*totals_rows(*self.totals)],
            file=self._file,
            links=links or {},
            picture=picture,
        )

    def summary(self) -> str:
        """Return the comparison as Markdown: what changed, the first difference, how both runs came out."""
        from fireworld.markdown import markdown_page

        return markdown_page("diff", [self.finding()])

    def save_summary(self, path: Path | str, *, force: bool = False) -> None:
        """Write the Markdown to a file, and beside it in a folder FILE-files a page that plays both, and a picture.

        Args:
            path: the file.
            force: replace existing files.

        Raises:
            OutputError: the file, or one of the others, exists or cannot be written.
            LogError: a recording changed since it was opened.
        """
        from fireworld.recording.pages.summary import save_summary

        save_summary(self, Path(path), force=force)

    def junit(self) -> bytes:
        """Return the comparison as JUnit XML, with a test case for each topic."""
        from fireworld.recording.difference_text import difference_junit

        return difference_junit(self.found, self.rules, self.cause, names=self.names, file=self._file)

    @property
    def _file(self) -> str:
        """Run A as a file, "" if it is none."""
        return self.names[0] if getattr(self.runs[0], "path", None) is not None else ""

    @overload
    def show(self, what: Literal["play"] = "play") -> PlayedPage: ...
    @overload
    def show(self, what: Literal["rerun"]) -> Any: ...
    def show(self, what: str = "play") -> Any:
        """Return something that notebooks show: a page that plays both runs from their first difference on, or Rerun.

        Args:
            what: "play", or "rerun" for its widget.

        Raises:
            ArgumentError: it is neither.
            ViewError: a run has no steps; for "rerun": Rerun, or its widget, is not installed.
        """
        from fireworld.recording.pages.notebook import show_difference

        return show_difference(self, what)

    def page(self) -> str:
        """Return the comparison as an HTML page with maps and curves, which needs no other file.

        Raises:
            ViewError: matplotlib is not installed.
            LogError: a recording changed since it was opened.
        """
        from fireworld.recording.pages.difference_page import difference_page

        return difference_page(self)

    def save_html(self, path: Path | str, *, force: bool = False) -> None:
        """Write the page to a file.

        Args:
            path: the file.
            force: replace an existing file.

        Raises:
            OutputError: it exists, or cannot be written.
            ViewError: matplotlib is not installed.
            LogError: a recording changed since it was opened.
        """
        check_output(Path(path), force=force)
        write_file(Path(path), self.page())

    def __repr__(self) -> str:
        from fireworld.recording.difference_text import head_lines, totals_rows

        if self.known_same:
            line = f"the same: {len(self.runs[0])} steps, digest {self.runs[0].digest}"
            return "\n".join([line, *(self.cause.lines if self.cause.changes else ())])
        table = text_table(("", *self.names), totals_rows(*self.totals), "<>>")
        return "\n".join([*head_lines(self.found, self.cause), "", table])

    def _repr_html_(self) -> str:
        from fireworld.recording.pages.difference_page import difference_body

        return "\n".join(difference_body(self, {}))


@overload
def diff(a: TrainingLog, b: TrainingLog) -> TrainingDifference: ...
@overload
def diff(
    a: AnyRun,
    b: AnyRun,
    *,
    tolerances: Mapping[str, float] | None = None,
    ignore: Collection[str] = (),
    first_step: int | None = None,
    last_step: int | None = None,
    any_scenario: bool = False,
    partial: bool = False,
) -> Difference: ...
def diff(
    a: AnyRun | TrainingLog,
    b: AnyRun | TrainingLog,
    *,
    tolerances: Mapping[str, float] | None = None,
    ignore: Collection[str] = (),
    first_step: int | None = None,
    last_step: int | None = None,
    any_scenario: bool = False,
    partial: bool = False,
) -> Difference | TrainingDifference:
    """Compare run B with run A, step by step, exactly unless something else is asked for.

    Two trainings are compared part by part, as `fireworld.training.log.difference.diff_trainings` does; of what can be
    asked for they know `partial` alone.

    Args:
        a: the run that is right, or came first: a recording's path, or a run.
        b: the run to compare with it.
        tolerances: by `topic.field` or `field`: the largest difference that is ignored.
        ignore: topics, `topic.field`s or `field`s that are not compared.
        first_step: first step to compare.
        last_step: last step to compare.
        any_scenario: compare runs of two scenarios too, if their cities are the same.
        partial: compare a cut-off or damaged recording too, as far as it is good.

    Raises:
        LogError: a recording cannot be read, the runs cannot be compared, or a field or range of steps does not exist.
    """
    if is_training(a) and is_training(b):
        asked = (tolerances, ignore, first_step is not None, last_step is not None, any_scenario)
        if any(asked):
            wanted = "no tolerance, ignored field, range of steps or other scenario"
            raise LogError(expected("diff of trainings", "", wanted, "one of these"))
        from fireworld.training.log.difference import diff_trainings

        return diff_trainings(a, b, partial=partial)
    if first_step is not None and last_step is not None and first_step > last_step:
        raise LogError(expected("--from and --to", "", "a range of steps", f"{first_step} to {last_step}"))
    runs = _open_both(a, b, partial=partial)
    ends = [last_step] if last_step is not None else []
    ends += [int(run.steps.max(initial=-1)) for run in runs if run.damage is not None]
    same_digest = bool(runs[0].digest) and runs[0].digest == runs[1].digest  # runs in memory may have none
    difference = Difference(
        runs,
        tolerances=tolerances or {},
        ignore=ignore,
        steps=(first_step, min(ends, default=None)),
        known_same=same_digest and first_step is None and last_step is None,
    )
    if tolerances or ignore:
        _ = difference.rules  # raises for a name that does not exist
    if not (any_scenario or same_digest):
        _check_same_scenario(difference)
    if not difference.known_same and difference.first is not None and difference.first.step is None:
        cities = f"{runs[0].city.name} in {difference.names[0]} and {runs[1].city.name} in {difference.names[1]}"
        raise LogError(f"cannot compare runs in different cities, {cities}: {difference.first.sentence}")
    return difference


def _check_same_scenario(difference: Difference) -> None:
    """Raise LogError if two runs are of different scenarios, with the keys that differ."""
    from fireworld.recording.cause import scenario_text
    from fireworld.shown import at_most

    found = difference.cause.changes.get("scenario")
    if found:
        first, second = (
            f"{scenario_text(run.header)} in {name}"
            for run, name in zip(difference.runs, difference.names, strict=True)
        )
        keys = "; ".join(at_most(found, KEYS_SHOWN))
        what = f"cannot compare runs of different scenarios, {first} and {second}: {keys}"
        raise LogError(f"{what}; try --any-scenario if that is meant")


def _open_both(a: object, b: object, *, partial: bool) -> tuple[StoredRun, StoredRun]:
    """Open what has to be opened; files of the same bytes are read once."""
    runs: list[StoredRun] = []
    for given in (a, b):
        run = runs[0] if runs and _same_bytes(a, b) else open_run(given, partial=True)
        if run.damage is not None and not partial:
            hint = f"--partial to compare it that far, or `fireworld recover {run_name(run)}`"
            raise LogError(f"{run_name(run)}: {run.damage}; try {hint}")
        runs.append(run)
    return runs[0], runs[1]


def _same_bytes(a: object, b: object) -> bool:
    if not (isinstance(a, str | os.PathLike) and isinstance(b, str | os.PathLike)):
        return a is b
    try:
        return filecmp.cmp(a, b, shallow=False)
    except OSError:
        return False  # opening it raises the error
