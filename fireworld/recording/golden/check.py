"""Golden recordings, run or trained again and compared."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal
from xml.etree.ElementTree import Element, SubElement

from fireworld_recorder.diff import RunComparison, compare
from fireworld_recorder.reader import Log, open_log
from fireworld_recorder.totals import plain

from fireworld.cause import Cause
from fireworld.errors import FireworldError, OutputError, expected
from fireworld.executors import AnyExecutor, On, workers_for
from fireworld.files import check_output, read_text_file
from fireworld.findings import Finding
from fireworld.junit import clean, report
from fireworld.recording.cause import run_cause
from fireworld.recording.difference_text import change_lines, totals_rows
from fireworld.recording.golden.again import run_again
from fireworld.recording.golden.digest import compare_digest, read_digest
from fireworld.recording.golden.find import FOLDER, find_goldens
from fireworld.recording.golden.keep import Kept, keep_new, kept_paths
from fireworld.recording.golden.spec import prepare_golden, spec_of
from fireworld.recording.golden.store import is_digest, text_path
from fireworld.recording.golden.text import is_text_of
from fireworld.recording.golden.training import prepare_training, training_changes, training_spec_of
from fireworld.recording.inputs import is_training
from fireworld.recording.run import Run
from fireworld.records import RunHeader
from fireworld.simulation.built import CityCache
from fireworld.training.log.difference import TrainingDifference, compare_trainings
from fireworld.training.log.reader import TrainingLog, open_training
from fireworld.training.log.records import TrainingHeader
from fireworld.training.log.verify import TrainedAgain

Result = Literal["same", "different", "cannot"]


@dataclass(frozen=True, kw_only=True)
class GoldenResult:
    """The result of running a golden again, or of training it again."""

    path: Path
    header: RunHeader | TrainingHeader | None = None
    """Of the golden; None if it cannot be read."""
    fresh: Run | TrainedAgain | None = None
    """The new run or training; None if there was none."""
    difference: RunComparison | TrainingDifference | None = None
    cause: Cause | None = None
    """What was changed since it was recorded; None if it could not be run or compared."""
    seconds: float = 0.0
    """What running and comparing took."""
    error: str = ""
    """Why it could not be run or compared."""
    kept: Kept | None = None
    """Where the new run or training was kept, if that was asked for and it differs."""
    text_is_foreign: bool = False
    """The text beside the golden describes another recording, or is missing."""

    @property
    def name(self) -> str:
        """Name of the golden."""
        return self.path.stem

    @property
    def kind(self) -> str:
        """What it is a golden of: a run or a training."""
        return "training" if isinstance(self.header, TrainingHeader) else "run"

    @property
    def differs(self) -> bool:
        """Whether there is a new run or training, and it is not the recorded one."""
        return self.difference is not None and not self.difference.same

    @property
    def result(self) -> Result:
        """How the check ended; "cannot" if the golden could not be run or compared."""
        if self.difference is None:
            return "cannot"
        return "different" if self.differs or self.text_is_foreign else "same"

    @property
    def sentence(self) -> str:
        """What is wrong, in a line; empty if nothing is."""
        if self.difference is None:
            return self.error
        if self.difference.first is not None:
            return self.difference.first.sentence
        if self.text_is_foreign:
            return f"{text_path(self.path).name}: expected the text of this recording, found none or another's"
        return ""

    @property
    def headline(self) -> str:
        """What is wrong, in a line that begins with what changed; empty if nothing is."""
        return f"{self.cause.short}; {self.sentence}" if self.cause is not None and self.differs else self.sentence

    @property
    def lines(self) -> list[str]:
        """What stands below the headline: what changed, and what else is different, line by line."""
        cause = self.cause.lines if self.cause is not None and self.differs else []
        return [*cause, *self.changes]

    @property
    def changes(self) -> list[str]:
        """What else is different, line by line."""
        if isinstance(self.difference, TrainingDifference):
            return [*training_changes(self.difference)]
        return change_lines(self.difference) if self.difference is not None else []

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """What was run by what policy, or trained in by what method, seed and last step; "-" if it cannot be read."""
        header, difference = self.header, self.difference
        if isinstance(header, TrainingHeader):
            length = f"{difference.n_parts} {header.unit}s" if isinstance(difference, TrainingDifference) else "-"
            return header.curriculum, header.method, str(header.seed), length
        if header is None:
            return "-", "-", "-", "-"
        outcome = difference.totals[0].outcome if isinstance(difference, RunComparison) else None
        length = str(outcome.steps) if outcome is not None else "-"
        return header.scenario, header.policy, str(header.seed), length

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values; of a difference, a is the golden and b the new run or training."""
        header, difference = self.header, self.difference
        common: dict[str, Any] = {
            "name": self.name,
            "result": self.result,
            "seed": header and header.seed,
            "sentence": self.sentence,
            "cause": self.cause and self.cause.to_dict(),
        }
        if isinstance(header, TrainingHeader):
            found = difference.to_dict() if isinstance(difference, TrainingDifference) else {"first": None}
            return {**common, "curriculum": header.curriculum, "method": header.method, **found}
        run = difference if isinstance(difference, RunComparison) else None
        return {
            **common,
            "scenario": header and header.scenario,
            "policy": header and header.policy,
            "first": run and plain(run.first),
            "header": plain(run.header) if run else {},
            "totals": run and plain(run.totals),
        }

    def finding(self, *, name: str = "", file: str = "", line: int = 1) -> Finding:
        """Return the result for the pages of a CI server.

        Args:
            name: what is said to be checked; the golden if left out.
            file: what an annotation points to, and the line in it; the golden, or its text, if left out.
            line: in that file.
        """
        difference = self.difference
        runs = difference.totals if isinstance(difference, RunComparison) and self.differs else ()
        text = text_path(self.path)
        return Finding(
            name=name or self.name,
            verdict=self.result,
            headline=self.headline,
            cause=self.cause.lines if self.cause is not None and self.differs else (),
            first=self.sentence,
            heads=("", "golden", "new") if runs else (),
            rows=[*totals_rows(*runs)] if runs else (),
            file=file or str(text if text.is_file() else self.path),
            line=line,
            links=self.kept.links if self.kept is not None else {},
            picture=str(self.kept.picture) if self.kept is not None and self.kept.picture is not None else "",
        )

    def __repr__(self) -> str:
        return f"<GoldenResult {self.name}: {self.result}{f', {self.sentence}' if self.sentence else ''}>"


def check_goldens(
    folder: Path = FOLDER,
    names: Collection[str] = (),
    *,
    matching: str = "",
    keep: Path | None = None,
    force: bool = False,
    jobs: int = 1,
    executor: AnyExecutor = None,
    on_result: Callable[[GoldenResult], object] = lambda _: None,
) -> Iterator[GoldenResult]:
    """Run goldens again, or train them again, one at each step of the iteration, and compare.

    Scenarios, curricula, policies and code are taken as they are now.

    Args:
        folder: of the goldens.
        names: of those to check; all if there are none.
        matching: an expression that their names must match, as for `find_goldens`.
        keep: folder in which the new runs and trainings that differ are recorded, with pages.
        force: replace files in `keep`.
        jobs: how many are run at a time; with more than one each in a process, and the results are without new runs.
        executor: who runs them instead, as for `fw.compare`; workers elsewhere find the same files at the same paths.
        on_result: called as soon as one is done.

    Raises:
        OutputError: there are no such goldens, or `keep` cannot be used.
        ExecutorError: an executor that is none, or workers that died.
    """
    paths = find_goldens(folder, names, matching=matching)
    if keep is not None and keep.resolve() == folder.resolve():
        raise OutputError(expected(str(keep), "", "another folder than that of the goldens", "the same"))
    if keep is not None and not force:
        for taken in (new for path in paths for new in kept_paths(path, keep) if new.exists()):
            check_output(taken)
    if executor is None and jobs == 1:
        return _in_turn(paths, keep, on_result)
    return _side_by_side(paths, keep, on_result, executor or On("processes", min(jobs, len(paths))))


def _in_turn(
    paths: Sequence[Path], keep: Path | None, on_result: Callable[[GoldenResult], object]
) -> Iterator[GoldenResult]:
    cities = CityCache()
    for path in paths:
        result = _check(path, keep, cities)
        on_result(result)
        yield result


def _side_by_side(
    paths: Sequence[Path], keep: Path | None, on_result: Callable[[GoldenResult], object], executor: AnyExecutor
) -> Iterator[GoldenResult]:
    tasks = [partial(_check_alone, path, keep) for path in paths]
    yield from workers_for(executor).run(tasks, lambda _, result: on_result(result)) or ()


def _check_alone(path: Path, keep: Path | None) -> GoldenResult:
    """Check a golden in a process of its own, from which no run is sent."""
    return replace(_check(path, keep, CityCache()), fresh=None)


def _check(path: Path, keep: Path | None, cities: CityCache) -> GoldenResult:
    result = check_golden(path, cities=cities)
    return result if keep is None else keep_new(result, keep)


def check_golden(path: Path, *, cities: CityCache | None = None) -> GoldenResult:
    """Do a golden's spec again and compare; if that is not possible the result has the error."""
    header: RunHeader | TrainingHeader | None = None
    fresh: Run | TrainedAgain
    began = time.perf_counter()
    try:
        if is_digest(path):
            header = read_digest(path).header
            fresh = run_again(prepare_golden(spec_of(header), path.parent, cities=cities))
        elif is_training(path):
            golden = open_training(path)
            header = golden.header
            fresh = prepare_training(training_spec_of(header), path.parent, recorded=golden, cities=cities)
        else:
            header = open_log(path).header
            fresh = run_again(prepare_golden(spec_of(header), path.parent, recorded=header, cities=cities))
        return replace(compare_golden(path, fresh), seconds=time.perf_counter() - began)
    except FireworldError as error:
        return GoldenResult(path=path, header=header, error=str(error), seconds=time.perf_counter() - began)


def compare_golden(path: Path, fresh: Run | TrainedAgain) -> GoldenResult:
    """Compare a golden with a new run of its spec; or train for it, and compare.

    Raises:
        LogError: the golden cannot be read; the spec names fields that do not exist; or the trainings cannot be
            compared.
    """
    golden: Log | TrainingLog
    difference: RunComparison | TrainingDifference
    if is_digest(path) and isinstance(fresh, Run):
        kept = read_digest(path)
        difference, cause = compare_digest(kept, fresh), run_cause(kept.header, fresh.header)
        return GoldenResult(path=path, header=kept.header, fresh=fresh, difference=difference, cause=cause)
    if isinstance(fresh, TrainedAgain):
        golden = open_training(path)
        difference = compare_trainings(golden, fresh, names=("golden", "now"))
        cause = difference.cause
    else:
        golden, spec = open_log(path), spec_of(fresh.header)
        difference = compare(golden, fresh, tolerances=spec.tolerances, ignore=spec.ignore)
        cause = run_cause(golden.header, fresh.header)
    return GoldenResult(
        path=path,
        header=golden.header,
        fresh=fresh,
        difference=difference,
        cause=cause,
        text_is_foreign=not is_text_of(_text_beside(path), golden),
    )


def _text_beside(path: Path) -> str:
    beside = text_path(path)
    return read_text_file(beside) if beside.is_file() else ""


def goldens_junit(results: Sequence[GoldenResult]) -> bytes:
    """Return results as JUnit XML: a difference is a failure, what cannot be run an error."""
    cases = []
    for result in results:
        place = {"file": clean(str(result.path)), "line": "1", "time": f"{result.seconds:.3f}"}
        case = Element("testcase", {"classname": "golden", "name": clean(result.name), **place})
        if result.result != "same":
            kind = "error" if result.difference is None else "failure"
            fault = SubElement(case, kind, {"message": clean(result.headline), "type": result.result})
            fault.text = clean("\n".join((result.headline, *result.lines)))
        cases.append(case)
    return report("fireworld golden", "fireworld golden", cases)
