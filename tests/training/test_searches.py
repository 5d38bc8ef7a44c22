"""`fireworld train --method search`: files, checkpoints and what is in the way."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.errors import OutputError, TrainingError
from fireworld.executors import threads
from fireworld.policy.teams.team import load_team, write_team
from fireworld.simulation.built import CityCache
from fireworld.training import training as training_module
from fireworld.training.curriculum import load_curriculum
from fireworld.training.methods.search import Search
from fireworld.training.training import Training

SETTINGS = {"n_generations": 4, "n_candidates": 5, "n_best": 2, "n_fires": 2, "n_steps_max": 12}
WORDS = ("train", "tiny.yaml", "--method", "search", *(w for k, v in SETTINGS.items() for w in ("--set", f"{k}={v}")))


@pytest.fixture(scope="module")
def cities():
    return CityCache()


@pytest.fixture
def make(here, curriculum, cities):
    def make(name="team.npz", *, seed=1, force=False, **changes):
        trainer = Search(**{**SETTINGS, **changes}).trainer(curriculum, seed=seed, cities=cities)
        return Training(trainer, here / name, force=force)

    return make


def carry_out(run, *, until=10):
    """Search, and ask to stop after a number of generations."""
    workers, seen = threads(1), []

    def report(_, generation):
        seen.append(generation.generation)
        if len(seen) == until:
            workers.stop.set()

    run.run(workers, [report])
    return seen


def test_an_interrupted_search_continues_bit_for_bit(make, here):
    whole = make("whole.npz")
    whole.begin()
    assert carry_out(whole) == [0, 1, 2, 3]
    first = make()
    first.begin()
    assert carry_out(first, until=2) == [0, 1]
    assert first.team is None
    assert first.checkpoint.exists()
    assert not first.path.exists()
    second = make()
    assert second.resume()
    assert carry_out(second) == [2, 3]
    assert (here / "team.npz").read_bytes() == (here / "whole.npz").read_bytes()
    assert not second.checkpoint.exists()
    third = make()
    assert third.resume()
    assert carry_out(third) == [], "it is done"


def test_nothing_to_continue_from(make):
    assert not make().resume()


@pytest.mark.parametrize(
    ("change", "wanted"),
    [({"seed": 2}, "seed: expected 2, got 1"), ({"n_fires": 1}, r"method\.n_fires: expected 1, got 2")],
)
def test_a_checkpoint_of_another_search_is_refused(make, change, wanted):
    begun = make()
    carry_out(begun, until=1)
    content = begun.checkpoint.read_bytes()
    with pytest.raises(TrainingError, match=wanted):
        make(**change).resume()
    assert begun.checkpoint.read_bytes() == content


def test_a_checkpoint_is_in_the_way_of_another_beginning(make):
    carry_out(make(), until=1)
    with pytest.raises(OutputError, match="continue from it with --resume"):
        make().begin()
    make(force=True).begin()


@pytest.mark.parametrize(
    ("name", "array", "wanted"),
    [
        ("spread", np.zeros(3), "spread: expected 17 numbers >= 0"),
        ("spread", np.full(17, -1.0), "spread: expected 17 numbers >= 0"),
        ("spread", np.full(17, np.nan), r"spread\[0\]: expected a finite number"),
        ("generation", np.array([9]), "generation: expected a whole number up to 4"),
        ("generation", np.array([1.0]), "generation: expected a whole number up to 4"),
    ],
)
def test_a_checkpoint_that_makes_no_sense(make, monkeypatch, name, array, wanted):
    monkeypatch.setattr(
        training_module,
        "write_team",
        lambda *words, extra, **options: write_team(*words, extra={**extra, name: array}, **options),
    )
    carry_out(make(), until=1)
    with pytest.raises(TrainingError, match=wanted):
        make().resume()


def test_a_cut_off_checkpoint(make):
    run = make()
    carry_out(run, until=1)
    run.checkpoint.write_bytes(run.checkpoint.read_bytes()[:-30])
    with pytest.raises(TrainingError, match=r"expected a team file \(.npz\)"):
        make().resume()


def test_a_full_disk_keeps_the_checkpoint(make, monkeypatch):
    def fail(team, path, **options):
        if path.name == "team.npz":
            raise OutputError(f"{path}: cannot be written: No space left on device")
        write_team(team, path, **options)

    monkeypatch.setattr(training_module, "write_team", fail)
    run = make()
    with pytest.raises(OutputError, match=r"No space left on device; continue from .*team\.npz\.checkpoint with"):
        carry_out(run)
    monkeypatch.undo()
    again = make()
    assert again.resume()
    assert carry_out(again) == []
    assert again.path.exists()


def test_from_the_command_line(here, fireworld):
    done = fireworld(*WORDS, "-o", "a.npz", "--repetitions", 2, "--set", "own_targets=false")
    assert done.code == 0, done.err
    one, two = (load_team(here / f"a-{number}.npz") for number in (1, 2))
    assert done.out.splitlines() == [
        f"a-{number}.npz: seed {number}, a ranking of the paper's actions, digest {team.digest}"
        for number, team in ((1, one), (2, two))
    ]
    assert one.digest != two.digest
    assert one.provenance["curriculum"]["digest"] == load_curriculum("tiny.yaml").digest
    assert fireworld("run", "quick", "--policy", "a-1.npz", "--steps", 3).code == 0


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        (("-o", "a.npz", "--set", "alpha=0.1"), "expected one of own_targets, cooperation"),
        (("-o", "a.npz", "--set", "n_fires=many"), "n_fires: expected a whole number, got 'many'"),
        (("-o", "a.npz", "--set", "cooperation=maybe"), "cooperation: expected true or false, got 'maybe'"),
        (("-o", "a.npz", "--set", "n_best=60"), "n_best: expected at most n_candidates, 48"),
        (("-o", "a.npz", "--resume"), "expected a checkpoint to continue from"),
        (("-o", "nowhere/a.npz"), "expected an existing folder"),
    ],
)
def test_mistakes(here, fireworld, words, wanted):
    done = fireworld(*WORDS[:4], *words)
    assert done.code == 2
    assert wanted in done.err
    assert sorted(path.name for path in here.iterdir()) == ["tiny.yaml"]
