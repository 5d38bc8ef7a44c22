"""Rows of pictures without a viewer: the frames of a film, and films."""

from __future__ import annotations

import importlib.util
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from fireworld_recorder.reader import Log, open_log
from fireworld_viewer.pictures.figure_files import plain_style
from fireworld_viewer.pictures.film import FILMS, FilmFrames, save_film
from fireworld_viewer.story.steps import ShownStep, read_steps_between

from benchmarks.runs import new_world, write_log
from benchmarks.timing import Contender, Row, compare, measure


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of pictures; none where matplotlib is not installed."""
    if importlib.util.find_spec("matplotlib") is None:
        return
    size, n_steps, seconds = (100, 20, 0.3) if quick else (1000, 300, 3.0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_log(folder / "run.mcap", new_world(size, n_steps))
        log = open_log(folder / "run.mcap")
        shown = read_steps_between([log])
        city = f"{len(log.city.building_id)} buildings, {len(shown)} steps"

        def blitted(_: None) -> None:
            frames = FilmFrames([log], shown)
            for index in range(len(frames)):
                frames.frame(index)

        def anew(_: None) -> None:
            for step in shown[:: len(shown) // 10]:
                FilmFrames([log], [step]).frame(0)

        with plain_style():
            ours = Contender("the city once", blitted, parts=len(shown))
            baseline = Contender("a figure each", anew, parts=len(shown[:: len(shown) // 10]))
            yield compare("pictures", "a frame of a film", city, ours, baseline, seconds=seconds)
            for ending in FILMS:
                if ending == ".gif" or importlib.util.find_spec("av") is not None:
                    yield measure_film(log, shown, folder / f"film{ending}", size=city, seconds=seconds)


def measure_film(log: Log, shown: Sequence[ShownStep], path: Path, *, size: str, seconds: float) -> Row:
    """Measure the writing of a film from a log that is read."""

    def write(_: None) -> None:
        save_film([log], shown, path)

    write(None)
    label = f"{size}, {path.stat().st_size / 1e6:.1f} MB"
    return measure("pictures", "film", label, Contender(f"render {path.suffix}", write), seconds=seconds)
