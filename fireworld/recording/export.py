"""Export: a recording as tables for data tools, and what a damaged one still holds as a recording of its own."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from fireworld_recorder.recover import Recovery
from fireworld_recorder.recover import recover as recover_file
from fireworld_recorder.tables import TABLES, find_table

from fireworld.errors import OutputError
from fireworld.recording.inputs import AnyRun, is_training, open_run
from fireworld.records import StepRecord

if TYPE_CHECKING:
    from fireworld.training.log.reader import TrainingLog


def export(
    log: AnyRun | TrainingLog,
    folder: Path | str,
    *,
    form: str = "parquet",
    tables: Collection[str] | None = None,
    force: bool = False,
    on_step: Callable[[StepRecord | None], object] = lambda _: None,
) -> dict[str, int]:
    """Write a recording as tables, for pandas, polars, DuckDB and the like: as Parquet, CSV or JSON lines.

    A training has other tables than a run; see `fireworld.training.log.export.TABLES`.

    Args:
        log: the path of a recording, or a run; one that was cut off or damaged is exported as far as it is good.
        folder: the folder to make, with a file for each table; of JSON lines the file.
        form: "parquet", "csv" or "jsonl".
        tables: names of the tables to write; None: all.
        force: replace an earlier export.
        on_step: called after each step, or part of a training.

    Returns:
        Rows by table.

    Raises:
        LogError: the recording cannot be read.
        OutputError: there is no such form, pyarrow is not installed (for Parquet), or the folder exists or cannot be
            written.
    """
    if form != "parquet":
        return _export_text(log, Path(folder), form, tables=tables, force=force, on_step=on_step)
    if find_spec("pyarrow") is None:
        raise OutputError("export: pyarrow is not installed; try pip install 'fireworld[archive]'")
    if is_training(log):
        from fireworld.training.log.export import export_training
        from fireworld.training.log.reader import opened

        training = opened(log, partial=True)
        return export_training(training, Path(folder), tables=tables, force=force, on_part=lambda: on_step(None))
    for name in tables or ():
        find_table(name)
    run = open_run(log, partial=True)
    from fireworld_recorder import parquet

    chosen = TABLES if tables is None else tables
    return parquet.export(run, Path(folder), tables=chosen, force=force, on_step=on_step)


def _export_text(
    log: AnyRun | TrainingLog,
    place: Path,
    form: str,
    *,
    tables: Collection[str] | None,
    force: bool,
    on_step: Callable[[StepRecord | None], object],
) -> dict[str, int]:
    if is_training(log):
        from fireworld.training.log.export import export_training_text
        from fireworld.training.log.reader import opened

        training = opened(log, partial=True)
        on_part = partial(on_step, None)
        return export_training_text(training, place, form, tables=tables, force=force, on_part=on_part)
    from fireworld_recorder.text_tables import export_text

    return export_text(open_run(log, partial=True), place, form, tables=tables, force=force, on_step=on_step)


def recover(log: Path | str, output: Path | str, *, force: bool = False) -> Recovery:
    """Write the committed steps of a cut-off or damaged recording as a recording of their own.

    Args:
        log: the path of the recording, whatever its state.
        output: the recording to write.
        force: replace an existing file.

    Returns:
        How much was recovered, and what was wrong.

    Raises:
        LogError: the recording holds no good step, or cannot be read at all.
        OutputError: the output exists, its folder does not, or it cannot be written.
    """
    if is_training(log):
        from fireworld.training.log.records import TRAINING

        return recover_file(log, output, force=force, kind=TRAINING)
    return recover_file(log, output, force=force)
