"""`fireworld train` and `fireworld policy`: as a user calls them, with every way to go wrong."""

from __future__ import annotations

import json
import signal
import time

import numpy as np
import pytest
from fireworld_recorder.reader import open_log

from fireworld.errors import OutputError
from fireworld.policy.teams.team import load_team, write_team
from fireworld.training.methods.sarsa import SarsaTrainer
from tests.training.conftest import SHORT_WORDS

TRAIN = ("train", "tiny.yaml", *SHORT_WORDS, "-o")


@pytest.fixture
def files(here):
    """The files in the current folder, by name."""
    return lambda: sorted(path.name for path in here.iterdir() if path.suffix != ".yaml")


def test_train_twice_and_follow(here, fireworld, files):
    done = fireworld(*TRAIN, "a.npz", "--log", "a.csv")
    assert done.code == 0
    digest = load_team(here / "a.npz").digest
    assert done.out == f"a.npz: seed 1, 3 tables of 4320 states, digest {digest}\n"
    assert "seed 1: alone-1: " in done.err
    assert fireworld(*TRAIN, "b.npz").code == 0
    same = fireworld("policy", "diff", "a.npz", "b.npz")
    assert (same.code, same.out) == (0, "the same: 4320 states\n")
    run = fireworld("run", "quick", "--policy", "a.npz", "--steps", 9, "--record", "a.mcap", "--json")
    assert run.code == 0
    assert run.err == "a.npz: 3 tables for 2 brigades: the last 1 are not used\n"
    assert json.loads(run.out)["policy"] == "a.npz"
    assert open_log(here / "a.mcap").header.attachments["policy.npz"] == (here / "a.npz").read_bytes()
    assert fireworld("verify", "a.mcap").code == 0
    assert files() == ["a.csv", "a.mcap", "a.npz", "b.npz"]


def test_repetitions_and_stages(here, fireworld, files):
    done = fireworld(*TRAIN, "t.npz", "--stages", "alone", "--repetitions", 2, "--seed", 4, "--log", "l.csv")
    assert done.code == 0
    assert files() == ["l-1.csv", "l-2.csv", "t-1.npz", "t-2.npz"]
    assert [line.split(",")[0] for line in done.out.splitlines()] == ["t-1.npz: seed 4", "t-2.npz: seed 5"]
    assert load_team(here / "t-2.npz").tables.shape == (1, 270, 4)


def test_ctrl_c_and_resume(here, fireworld, files, monkeypatch):
    whole, run_episode, n_left = fireworld(*TRAIN, "whole.npz"), SarsaTrainer._run_episode, [5]

    def interrupted(*arguments):
        n_left[0] -= 1
        if n_left[0] == 0:
            signal.raise_signal(signal.SIGINT)
            time.sleep(0.5)
        return run_episode(*arguments)

    monkeypatch.setattr(signal, "getsignal", lambda _: signal.default_int_handler)
    monkeypatch.setattr(SarsaTrainer, "_run_episode", interrupted)
    done = fireworld(*TRAIN, "t.npz")
    assert done.code == 130
    assert done.out == ""
    assert "; continue from t.npz.checkpoint with --resume" in done.err
    assert files() == ["t.npz.checkpoint", "whole.npz"]
    again = fireworld(*TRAIN, "t.npz")
    assert again.code == 2
    assert again.err.count("\n") == 1
    other = fireworld(*TRAIN, "t.npz", "--resume", "--seed", 9)
    assert other.code == 2
    assert other.err.startswith("fireworld: t.npz.checkpoint: seed: expected 9, got 1")
    resumed = fireworld(*TRAIN, "t.npz", "--resume")
    assert resumed.code == 0
    assert resumed.out == whole.out.replace("whole", "t")
    assert files() == ["t.npz", "whole.npz"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("train", "absent", "-o", "t.npz"), "fireworld: absent: expected a curriculum file or one of "),
        ((*TRAIN, "t.npz", "--method", "magic"), "fireworld: --method: expected one of paper"),
        ((*TRAIN, "t.npz", "--set", "alpha"), "fireworld: --set: expected KEY=VALUE, got 'alpha'; try alpha=0.1"),
        ((*TRAIN, "t.npz", "--set", "alpha=7"), "fireworld: method: alpha: expected a number from 0 to 1, got 7.0"),
        (
            (*TRAIN, "t.npz", "--stages", "al"),
            "fireworld: --stages: expected stages of tiny: alone, together, got 'al'",
        ),
        ((*TRAIN, "t.npz", "--resume"), "fireworld: --resume: expected a checkpoint to continue from"),
        ((*TRAIN, "no/t.npz"), "fireworld: no/t.npz: expected an existing folder"),
        ((*TRAIN, "t.npz", "--log", "no/l.csv"), "fireworld: no/l.csv: expected an existing folder"),
        ((*TRAIN, "t.npy"), "fireworld: t.npy: expected a file ending in .npz, got '.npy'"),
        (
            (*TRAIN, "t.npz", "--log", "t.npz"),
            "fireworld: t.npz: expected a file of its own for every input and output, got one name twice",
        ),
        ((*TRAIN, "t.npz", "--force", "--resume"), "fireworld: --force and --resume exclude each other"),
        ((*TRAIN, "t.npz", "--seed", 2**32 - 1, "--repetitions", 2), "fireworld: --repetitions: expected seeds up to"),
        (("policy", "show", "absent.npz"), "fireworld: absent.npz: expected a team file, got No such file"),
        (("run", "quick", "--policy", "absent.npz"), "fireworld: absent.npz: expected a team file, got No such file"),
        (("run", "quick", "--policy", "bad.npz"), "fireworld: bad.npz: expected a team file (.npz), got BadZipFile"),
    ],
)
def test_what_cannot_be_done(here, fireworld, files, words, message):
    (here / "bad.npz").write_bytes(b"no archive")
    done = fireworld(*words)
    assert (done.code, done.out) == (2, "")
    assert message in done.err
    assert files() == ["bad.npz"], "nothing is made"


def test_policy_show_and_diff(here, fireworld):
    for name, seed in (("a.npz", 1), ("b.npz", 2)):
        assert fireworld(*TRAIN, name, "--seed", seed).code == 0
    shown = fireworld("policy", "show", "a.npz", "0", "volume=very-low", "--limit", 3).out
    assert "a.npz: 3 tables of 4320 states, with what the others do" in shown
    assert "trained in tiny, 4 scenarios, seed 1" in shown
    assert "state 0: free to spread over 0 sides" in shown
    assert "brigade 0, 1, 2: never visited in training" in shown
    assert "volume=very-low: 720 states, " in shown
    content = json.loads(fireworld("policy", "show", "a.npz", "1193", "--json").out)
    assert [state["brigade"] for state in content["states"]] == [0, 1, 2]
    assert content["provenance"]["curriculum"]["name"] == "tiny"
    differing = fireworld("policy", "diff", "a.npz", "b.npz", "--limit", 2)
    assert differing.code == 1
    assert "another action in " in differing.out
    assert "more; --limit shows more of them" in differing.out
    content = json.loads(fireworld("policy", "diff", "a.npz", "b.npz", "--json").out)
    assert not content["same"]
    assert content["n_changed"] > 0
    assert len(content["changed"]) <= 20
    assert fireworld(*TRAIN, "c.npz", "--stages", "alone").code == 0
    alone = fireworld("policy", "diff", "a.npz", "c.npz", "--limit", 2)
    assert (alone.code, alone.err) == (1, "")
    assert " of 4320 states, " in alone.out
    assert fireworld("policy", "show", "a.npz", "5000").code == 2


def test_a_full_disk_keeps_the_checkpoint(here, fireworld, files, monkeypatch):
    assert fireworld(*TRAIN, "whole.npz").code == 0
    with monkeypatch.context() as changed:
        changed.setattr("fireworld.training.training.write_team", _failing("t.npz"))
        done = fireworld(*TRAIN, "t.npz")
    assert (done.code, done.out) == (2, "")
    assert done.err.splitlines()[-1] == (
        "fireworld: t.npz: cannot be written: No space left on device; continue from t.npz.checkpoint with --resume"
    )
    assert files() == ["t.npz.checkpoint", "whole.npz"]
    assert fireworld(*TRAIN, "t.npz", "--resume").code == 0
    assert (here / "t.npz").read_bytes() == (here / "whole.npz").read_bytes()


def _failing(name):
    """Return a writer that finds no space left for one file."""

    def save(team, path, **more):
        if path.name == name:
            raise OutputError(f"{path}: cannot be written: No space left on device")
        write_team(team, path, **more)

    return save


def write_old_team(path, *, form="fireworld-team/1", shape=(2, 270, 4), nan_at=None, **provenance):
    tables = np.zeros(shape)
    if nan_at is not None:
        tables[nan_at] = np.nan
    header = np.frombuffer(json.dumps({"format": form, **provenance}).encode(), dtype=np.uint8)
    np.savez(path, header=header, tables=tables, visits=np.zeros(shape, dtype=np.int64))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"shape": (2, 5040, 4)}, "tables: expected float64 tables of shape (brigades, 4320 or 270, 4), got "),
        ({"form": "fireworld-team/9"}, "format: expected fireworld-team/2, got 'fireworld-team/9'"),
        ({"nan_at": (1, 17, 2)}, "tables[1, 17, 2]: expected a finite number, got nan"),
    ],
)
def test_team_files_that_cannot_be_followed(here, fireworld, files, changes, message):
    write_old_team(here / "bad.npz", **changes)
    content = (here / "bad.npz").read_bytes()
    for words in (
        ("run", "quick", "--policy", "bad.npz", "--record", "a.mcap"),
        ("policy", "show", "bad.npz"),
        (*TRAIN, "bad.npz", "--resume"),
    ):
        done = fireworld(*words)
        assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
        assert done.err.startswith(f"fireworld: bad.npz: {message}")
    assert files() == ["bad.npz"]
    assert (here / "bad.npz").read_bytes() == content


@pytest.mark.parametrize("n_bytes", [0, 100, 1000, -40])
def test_a_checkpoint_cut_off_is_left_as_it_is(here, fireworld, files, n_bytes):
    assert fireworld(*TRAIN, "t.npz").code == 0
    content = (here / "t.npz").read_bytes()[:n_bytes]
    (here / "t.npz").unlink()
    (here / "t.npz.checkpoint").write_bytes(content)
    done = fireworld(*TRAIN, "t.npz", "--resume")
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert done.err.startswith("fireworld: t.npz.checkpoint: expected a team file (.npz), got BadZipFile")
    assert files() == ["t.npz.checkpoint"]
    assert (here / "t.npz.checkpoint").read_bytes() == content


@pytest.mark.parametrize(
    ("stage", "message"),
    [
        ("scenarios: [train-9]", "own.yaml: stages.0: scenario: expected the name of a scenario or a .yaml file, got "),
        ("base: nowhere.yaml", "own.yaml: stages.0: nowhere.yaml: "),
        ("base: quick, vary: {brigades.m: [1]}", "own.yaml: stages.0: "),
    ],
)
def test_a_curriculum_of_what_is_not_there(here, fireworld, files, stage, message):
    (here / "own.yaml").write_text(f"stages:\n  - {{name: alone, cooperation: false, {stage}}}\n")
    done = fireworld("train", "own.yaml", "-o", "t.npz")
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert done.err.startswith(f"fireworld: {message}")
    assert files() == []


@pytest.mark.parametrize(
    ("trained", "run", "note"),
    [
        ("simultaneous", "in-turn", "; --set choices=simultaneous runs it as trained\n"),
        ("in-turn", "simultaneous", "; --set choices=in-turn runs it as trained\n"),
        ("simultaneous", "simultaneous", ""),
        ({}, "in-turn", ""),
    ],
)
def test_a_team_trained_with_other_choices(here, fireworld, trained, run, note):
    write_old_team(here / "t.npz", method={"choices": trained})
    done = fireworld("run", "quick", "--steps", 3, "--policy", "t.npz", "--set", f"choices={run}", "--json")
    assert done.code == 0
    assert done.err == (note and f"t.npz: trained with choices {trained}, run with choices {run}{note}")
