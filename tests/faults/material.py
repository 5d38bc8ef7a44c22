"""What the cases of a campaign are made of: logs of every kind, teams, goldens, in a folder, made once."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from tests.envs.played import play
from tests.fuzz import test_onnx
from tests.training.conftest import SHORT_WORDS, TINY

MINE = """
class Mine:
    def decide(self, observation):
        return {choice}
"""
TINY_TRAINING = ("train", "tiny.yaml", *SHORT_WORDS, "--jobs", "1")
SEARCH_WORDS = (
    "--method",
    "search",
    "--set",
    "n_generations=2",
    "--set",
    "n_candidates=6",
    "--set",
    "n_best=2",
    "--set",
    "n_fires=4",
)
TINY_SEARCH = ("train", "tiny.yaml", *SEARCH_WORDS, "--jobs", "1")
RUN_LOGS = ("run.mcap", "other.mcap", "team.mcap", "scene.mcap", "mine.mcap")
PLAYED_LOGS = ("played.mcap",)
TRAINING_LOGS = ("training.mcap", "search.mcap", *PLAYED_LOGS)
N_STEPS = 12
HAS_MINARI = find_spec("minari") is not None


def warm() -> None:
    """Import what commands import, so that forks need not."""
    os.environ["MPLBACKEND"] = "agg"
    os.environ["MINARI_DATASETS_PATH"] = "minari"  # in the folder of a call, not in that of who tries
    from fireworld.cli import COMMANDS

    for name in COMMANDS:
        importlib.import_module(f"fireworld.cli.{name.replace('-', '_')}")
    for name in (
        "matplotlib.pyplot",
        "onnx",
        "pyarrow.parquet",
        "rerun",
        "fireworld.conformance.check",
        "fireworld.envs.datasets.loading",
        "fireworld.envs.datasets.minari_form",
        "fireworld.evaluation.compare",
        "fireworld.evaluation.new_scenarios",
        "fireworld.recording.difference",
        "fireworld.recording.explanation",
        "fireworld.recording.fork",
        "fireworld.recording.golden.update",
        "fireworld.recording.pages.play",
        "fireworld.recording.pages.run_page",
        "fireworld.reproduction.reproduce",
        "fireworld.training.log.verify",
        "fireworld_recorder.parquet",
        "fireworld_viewer.pictures.film",
        "fireworld_viewer.rerun_view.app",
        "fireworld_viewer.rerun_view.live",
        *(("minari",) if HAS_MINARI else ()),
    ):
        importlib.import_module(name)


def make(folder: Path) -> None:
    """Make everything in a folder, within this process: that loads the kernels."""
    folder.mkdir(parents=True)
    before = Path.cwd()
    os.chdir(folder)
    try:
        _make(folder)
    finally:
        os.chdir(before)


def _make(folder: Path) -> None:
    steps = ("--steps", N_STEPS)
    (folder / "tiny.yaml").write_text(TINY)
    for name, choice in (("mine.py", 0), ("mine_changed.py", 3)):
        (folder / name).write_text(MINE.format(choice=choice))
    _do("run", "quick", "--policy", "chief", *steps, "--record", "run.mcap")
    _do("run", "quick", "--policy", "easiest", *steps, "--record", "other.mcap")
    _do("run", "quick", "--policy", "paper-cooperative", *steps, "--record", "team.mcap")
    _do("run", "quick", "--policy", "best", *steps, "--record", "scene.mcap", "--scene", "foxglove")
    _do("run", "quick", "--policy", "mine.py:Mine", *steps, "--record", "mine.mcap")
    _do(*TINY_TRAINING, "-o", "team.npz", "--record", "training.mcap")
    _do(*TINY_SEARCH, "-o", "ranking.npz", "--record", "search.mcap")
    play(folder / "played.mcap", scenarios=["quick"], n=2, n_steps=24, steps=8, own_targets=2)
    (folder / "net.onnx").write_bytes(test_onnx.GOOD)
    _do("golden", "add", "quick", "--policy", "chief", *steps, "--name", "plain", "--dir", "golden")
    for name, words in (("first", ()), ("second", ("--set", "brigades.n=3"))):
        _do("golden", "add", "quick", "--policy", "mine.py:Mine", *steps, *words, "--name", name, "--dir", "stale")
    _do("compare", "chief", "easiest", "--scenarios", "quick", "--seeds", 2, "--results", "known.parquet", "--jobs", 1)
    for source in ("run.mcap", "training.mcap"):
        data = (folder / source).read_bytes()
        (folder / f"cut-{source}").write_bytes(data[: len(data) * 2 // 3])
    shutil.copytree(Path(__file__).parents[1] / "data" / "traces", folder / "traces")


def _do(*words: Any) -> None:
    """Call a command within this process."""
    from fireworld.cli import main

    before, sys.argv = sys.argv, ["fireworld", *map(str, words)]
    said = io.StringIO()
    code: Any = 0
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            main()
    except SystemExit as stop:
        code = stop.code
    finally:
        sys.argv = before
    assert not code, f"{' '.join(sys.argv)}: {said.getvalue()}"
