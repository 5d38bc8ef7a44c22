"""`try_readings`: ask in which readings of the paper its claim holds, and write what was found."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import util
from pathlib import Path
from threading import Event
from typing import Final, Literal

from fireworld.arguments import ArgumentError, path_of, whole_number
from fireworld.errors import ViewError, expected
from fireworld.executors import AnyExecutor, workers_for
from fireworld.html_page import html_frame
from fireworld.reproduction.readings.choices import SHIPPED, load_choices
from fireworld.reproduction.readings.findings import findings_text
from fireworld.reproduction.readings.report import PAGE, write_readings
from fireworld.reproduction.readings.study import FULL, QUICK, SCREEN, OnProgress, ReadingsStudy, measure_readings

Design = Literal["screen", "full"]
SIZES: Final = {"screen": SCREEN, "full": FULL}


@dataclass(frozen=True, repr=False)
class TriedReadings:
    """The paper's experiment in many readings.

    Attributes:
        folder: where everything is: the page, runs, effects and the specification curve as CSV.
        study: what was measured.
    """

    folder: Path
    study: ReadingsStudy

    @property
    def findings(self) -> list[str]:
        """What was found, a sentence each."""
        return findings_text(self.study)

    @property
    def report(self) -> Path:
        """The report as one HTML page."""
        return self.folder / PAGE

    def __repr__(self) -> str:
        return "\n".join(self.findings)

    def _repr_html_(self) -> str:
        """Show the report in a notebook, in a frame of its own."""
        return html_frame(self.report.read_text(encoding="utf-8"))


def try_readings(
    folder: Path | str,
    *,
    file: Path | str | None = None,
    design: Design = "screen",
    repetitions: int | None = None,
    seeds: int | None = None,
    quick: bool = False,
    curriculum: Path | str | None = None,
    resume: bool = False,
    force: bool = False,
    executor: AnyExecutor = None,
    on_progress: OnProgress = lambda *_: None,
    stop: Event | None = None,
) -> TriedReadings:
    """Repeat the paper's experiment in a designed sample of the readings that it leaves open, and the best ones again.

    The same arguments give the same tables, byte for byte, whatever the executor. Trials are kept in the folder as they
    are made, so that what was interrupted can be resumed.

    Args:
        folder: a free name or an empty folder, for the page and the tables.
        file: the choices, as readings.yaml has them; None: fireworld's own.
        design: "screen", 64 readings, 8 trainings of each and 10 seeds; or "full", 128, 5 and 20. Beside
            it each further level of a choice is tried in a reading that is ours in everything else.
        repetitions: trainings of each reading instead.
        seeds: runs of each test instead.
        quick: 8 readings of the first four choices, with small trainings: to see how it looks, not to claim anything.
        curriculum: name or file of a curriculum; None: the paper's.
        resume: continue what an interrupted call left in the folder.
        force: replace what is in the folder.
        executor: who makes the trials. None: as many threads as there are cores; a number of threads; a word of `--on`;
            or an executor of concurrent.futures.
        on_progress: called with what is being done ("trying" or "confirming"), how many trials of it are done, and how
            many there are.
        stop: set it, and the work ends soon.

    Raises:
        ArgumentError: an argument that makes no sense.
        TrainingError: a file that makes no sense, or other settings than those the folder was begun with.
        ScenarioError, CityError: a city that a level names cannot be read.
        OutputError: something is in the folder already, or it cannot be written.
        ViewError: matplotlib is not installed.
        ExecutorError: an executor that is none, or a process that died.
        Interrupted: Ctrl-C, or `stop` was set.
    """
    if design not in SIZES:
        raise ArgumentError(expected("design", "", " or ".join(SIZES), design))
    size = QUICK if quick else SIZES[design]
    if repetitions is not None:
        size = replace(size, trainings=whole_number("repetitions", repetitions, least=1, most=1000))
    if seeds is not None:
        size = replace(size, seeds=whole_number("seeds", seeds, least=1, most=1000))
    workers_for(executor)
    if util.find_spec("matplotlib") is None:
        raise ViewError("try_readings: matplotlib is not installed; try pip install 'fireworld[figures]'")
    place = path_of("folder", folder)
    study = measure_readings(
        place,
        load_choices(SHIPPED if file is None else path_of("file", file)),
        size=size,
        curriculum="paper" if curriculum is None else curriculum,
        resume=resume,
        force=force,
        executor=executor,
        on_progress=on_progress,
        stop=stop,
    )
    write_readings(study, place)
    return TriedReadings(place, study)
