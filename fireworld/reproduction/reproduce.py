"""`reproduce`: train, test and judge the paper's method, and write its tables beside ours."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import util
from pathlib import Path
from threading import Event
from typing import Final

from fireworld.arguments import ArgumentError, path_of, whole_number
from fireworld.errors import TrainingError, ViewError, expected
from fireworld.executors import AnyExecutor, workers_for
from fireworld.html_page import html_frame
from fireworld.interrupt import Interrupted, gentle_interrupt
from fireworld.reproduction.csv_files import csv_files
from fireworld.reproduction.findings import Finding, caveat, findings, report_text
from fireworld.reproduction.folder import REPORT, ReproductionFolder
from fireworld.reproduction.measurement import Measurement, OnProgress, Parts
from fireworld.reproduction.paper import DEFAULT_WORLD, WORLDS, World
from fireworld.reproduction.paper_tables import PaperTables, make_tables
from fireworld.reproduction.recordings import pictures, record_run, runs_to_record
from fireworld.reproduction.report_page import report_page
from fireworld.reproduction.study import Study
from fireworld.training.curriculum import Curriculum, load_curriculum
from fireworld.training.methods.sarsa import PAPER

FIRST_SEED: Final = 1000  # of the tests
N_REPETITIONS: Final = 20
N_SEEDS: Final = 20
N_REPETITIONS_QUICK: Final = 2
N_SEEDS_QUICK: Final = 5


@dataclass(frozen=True, repr=False)
class Reproduction:
    """The paper's experiment, repeated.

    Attributes:
        folder: where everything is: the report, tables as CSV, teams, recordings, figures.
        study: what was measured.
        tables: the paper's Tables 1 to 3, and ours.
    """

    folder: Path
    study: Study
    tables: PaperTables

    @property
    def findings(self) -> list[Finding]:
        """What was found, the paper's main claim first."""
        return findings(self.study, self.tables)

    @property
    def caveat(self) -> str | None:
        """A warning where the study is too small for claims about learning."""
        return caveat(self.study)

    @property
    def report(self) -> Path:
        """The report as one HTML page."""
        return self.folder / REPORT

    def __repr__(self) -> str:
        return report_text(self.study, self.tables)

    def _repr_html_(self) -> str:
        """Show the report in a notebook, in a frame of its own."""
        return html_frame(self.report.read_text(encoding="utf-8"))


def reproduce(
    folder: Path | str,
    *,
    repetitions: int | None = None,
    seeds: int | None = None,
    quick: bool = False,
    world: str | None = None,
    curriculum: Path | str | None = None,
    record_trainings: bool = False,
    resume: bool = False,
    force: bool = False,
    executor: AnyExecutor = None,
    on_progress: OnProgress = lambda *_: None,
    stop: Event | None = None,
) -> Reproduction:
    """Repeat the paper's experiment: train its teams, test them beside controls, and judge its Tables 1 to 3.

    The same arguments give the same tables, byte for byte, whatever the executor. What is trained and tested is kept in
    the folder at once, so that an interrupted reproduction can be resumed.

    Args:
        folder: a free name or an empty folder, for the report, tables, teams, recordings and figures.
        repetitions: trainings; None: 20, or 2 if quick.
        seeds: runs of each test; None: 20, or 5 if quick.
        quick: few repetitions and seeds: to see how it looks, not to claim anything.
        world: "paper", a world like the paper's; "tests", a denser city with smaller fires; None: that of the folder if
            it is resumed, else "paper".
        curriculum: name or file of a curriculum that ends with the scenarios of Table 1; None: that of the world.
        record_trainings: keep the training log of every training in the folder's `trainings`, and read from it how the
            team learned; the tables are the same.
        resume: continue what an interrupted call left in the folder.
        force: replace an earlier reproduction in the folder.
        executor: who trains and tests. None: as many threads as there are cores; a number of threads; "threads",
            "processes", or an executor of concurrent.futures.
        on_progress: called with what is being done ("training", "testing", "recording" or "drawing"), how many parts of
            it are done, and how many there are; also in other threads.
        stop: set it, and the work ends soon.

    Raises:
        ArgumentError: an argument that makes no sense.
        OutputError: something is in the folder already, there is nothing to resume, or a file cannot be written.
        TrainingError: the curriculum cannot be read; or what is to be resumed is damaged or was begun with others.
        ViewError: matplotlib is not installed.
        ExecutorError: an executor that is none, or a process that died.
        Interrupted: Ctrl-C, or `stop` was set.
    """
    n_repetitions, n_seeds = (N_REPETITIONS_QUICK, N_SEEDS_QUICK) if quick else (N_REPETITIONS, N_SEEDS)
    if repetitions is not None:
        n_repetitions = whole_number("repetitions", repetitions, least=1, most=1000)
    if seeds is not None:
        n_seeds = whole_number("seeds", seeds, least=1, most=1000)
    workers_for(executor)
    if util.find_spec("matplotlib") is None:
        raise ViewError("reproduce: matplotlib is not installed; try pip install 'fireworld[figures]'")
    place = ReproductionFolder(path_of("folder", folder))
    chosen = _world(world, place if resume else None)
    trained_in = _curriculum(chosen.curriculum if curriculum is None else curriculum, chosen)
    if resume:
        place.find()
    else:
        place.make(force=force)
    test_seeds = range(FIRST_SEED, FIRST_SEED + n_seeds)
    with gentle_interrupt(stop) as asked:
        try:
            measurement = Measurement(
                place,
                trained_in,
                PAPER,
                n_repetitions,
                test_seeds,
                world=chosen,
                record_trainings=bool(record_trainings),
                stop=asked,
                on_progress=on_progress,
            )
            if resume:
                place.check_settings(measurement.identity)
            else:
                place.write_settings(measurement.identity)
            if record_trainings:
                place.make_trainings()
            return _carry_out(measurement, executor)
        except KeyboardInterrupt:
            kept = f"{place.n_trained(n_repetitions)} of {n_repetitions} trainings are kept in {place.path}"
            raise Interrupted(f"interrupted; {kept}: continue with --resume") from None


def _world(given: str | None, resumed: ReproductionFolder | None) -> World:
    """Return a world by its name; None: that of the folder that is resumed, or else the default."""
    if given is not None and given not in WORLDS:
        raise ArgumentError(expected("world", "", "one of " + ", ".join(WORLDS), given))
    if given is None and resumed is not None:
        begun_with = resumed.tests
        for world in WORLDS.values():
            if begun_with == {row.scenario for row in world.tests}:
                return world
    return WORLDS[given or DEFAULT_WORLD]


def _curriculum(given: Path | str, world: World) -> Curriculum:
    """Read a curriculum."""
    curriculum = load_curriculum(given)
    together = {scenario.name for stage in curriculum.stages if stage.cooperation for scenario in stage.scenarios}
    missing = [row.scenario for row in world.table_1 if row.scenario not in together]
    if missing:
        wanted = "all scenarios of the paper's Table 1 in stages with cooperation"
        raise TrainingError(expected(str(given), "", wanted, f"none of {', '.join(missing)}"))
    return curriculum


def _carry_out(measurement: Measurement, executor: AnyExecutor) -> Reproduction:
    """Train, test, judge, record, draw, write."""
    place, on_progress = measurement.folder, measurement.on_progress
    study, first = measurement.run(executor)
    tables = make_tables(study)
    for name, text in csv_files(study, tables).items():
        place.write(name, text)
    to_record = runs_to_record(first, study.world)
    parts, recorded = Parts("recording", len(to_record), on_progress), []
    for run in to_record:
        if measurement.stop.is_set():
            raise Interrupted("interrupted")
        recorded.append(record_run(*run, seed=FIRST_SEED, folder=place.path / "recordings", cities=measurement.cities))
        parts.done()
    drawn, images = pictures(study, recorded), {}
    parts = Parts("drawing", len(drawn), on_progress)
    for name, draw in drawn.items():
        images[name] = draw()
        place.write(f"figures/{name}.png", images[name])
        parts.done()
    place.write(REPORT, report_page(study, tables, images))
    return Reproduction(place.path, study, tables)
