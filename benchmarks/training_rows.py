"""Rows of recorded trainings: what recording costs, and what reading, verifying and comparing take."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

from benchmarks.timing import Contender, Row, compare, measure
from fireworld.recording.record import run
from fireworld.training.curriculum import Curriculum, load_curriculum
from fireworld.training.log.difference import diff_trainings
from fireworld.training.log.reader import open_training
from fireworld.training.log.replay import replay_episode
from fireworld.training.log.verify import verify_training
from fireworld.training.train import train

CURRICULUM: Final = "paper"
SETTINGS: Final = {"n_episodes_max": 5}
"""Of the quick table."""


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of recorded trainings."""
    curriculum = load_curriculum(CURRICULUM)
    with tempfile.TemporaryDirectory() as name:
        yield from _rows(curriculum, Path(name), settings=SETTINGS if quick else {}, seconds=1.0 if quick else 120.0)


def _rows(curriculum: Curriculum, folder: Path, *, settings: dict[str, object], seconds: float) -> Iterator[Row]:
    """Yield the rows; each contender trains or reads the whole training."""
    log, other, episode = folder / "a.mcap", folder / "b.mcap", folder / "ep.mcap"

    def plain(_: object) -> object:
        return train(curriculum, set=settings)

    def recorded(_: object) -> object:
        return train(curriculum, set=settings, record=log, force=True)

    ours, baseline = Contender("recorded", recorded), Contender("not recorded", plain)
    row = compare("training", "train", CURRICULUM, ours, baseline, seconds=seconds)
    opened = open_training(log)
    n_steps = sum(line.n_steps for line in opened.lines)
    size = f"{len(opened)} episodes, {n_steps} steps, {log.stat().st_size / 1e6:.1f} MB"
    yield replace(row, size=size)
    verified = Contender("verified", lambda _: verify_training(log))
    yield replace(compare("training", "verify", CURRICULUM, verified, baseline, seconds=seconds), size=size)
    train(curriculum, set={**settings, "alpha": 0.6}, record=other)
    differ = Contender("compared", lambda _: diff_trainings(log, other))
    yield measure("training", "diff, from the first episode on", size, differ, seconds=seconds / 10)
    name, last = opened.scenarios[-1].name, opened.lines[-1].episode
    replayed = Contender("replayed", lambda _: replay_episode(log, name, last, episode, force=True))
    run_quick = Contender("run of quick", lambda _: run("quick", policy="chief", record=folder / "q.mcap", force=True))
    what = "replay an episode, opening included"
    yield compare("training", what, f"{opened.lines[-1].n_steps} steps", replayed, run_quick, seconds=seconds / 10)
