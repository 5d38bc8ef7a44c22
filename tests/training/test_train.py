"""`train`: the same teams as the command line's, from Python; files, callbacks, and every mistake in one line."""

from __future__ import annotations

import signal
from threading import Thread

import numpy as np
import pytest

from fireworld.errors import FireworldError, OutputError, TrainingError
from fireworld.interrupt import Interrupted
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import load_team
from fireworld.scenario import load_scenario
from fireworld.training.curriculum import find_curriculum, load_curriculum
from fireworld.training.methods.sarsa import PAPER, EpisodeReport
from fireworld.training.train import train
from fireworld.training.training import StopTraining
from tests.training.conftest import SHORT, SHORT_WORDS

FEW = {"n_episodes_max": 6, "n_episodes_unchanged": 3}
SEARCH = {"n_generations": 3, "n_candidates": 4, "n_best": 2, "n_fires": 2, "n_steps_max": 10}
TARGETS = {"n_lessons": 3, "n_fights": 3, "n_steps_max": 10, "hidden": 3}
EVOLUTION = {"n_generations": 3, "n_pairs": 2, "n_fires": 2, "n_steps_max": 10, "hidden": 2}
ROLLOUTS = {"n_generations": 3, "n_fights": 2, "n_steps_max": 10, "hidden": 3, "horizon": 5, "n_epochs": 2}
IMITATION = {"n_generations": 2, "n_fights": 2, "n_steps_max": 10, "hidden": 0, "start": "none", "n_epochs": 2}
SETTINGS = {
    "paper": FEW,
    "search": SEARCH,
    "assignment": SEARCH,
    "targets": TARGETS,
    "evolution": EVOLUTION,
    "imitation": IMITATION,
    "rollouts": ROLLOUTS,
}


@pytest.fixture
def files(here):
    """The files in the current folder, by name."""
    return lambda: sorted(path.name for path in here.iterdir() if path.suffix != ".yaml")


def stop_after(n_reports):
    """Return a callback that stops a training."""

    def callback(training, report):
        if training.n_reports == n_reports:
            raise StopTraining

    return callback


def test_what_the_command_line_makes(here, fireworld, files):
    assert fireworld("train", "tiny.yaml", *SHORT_WORDS, "--seed", 3, "-o", "a.npz", "--log", "a.csv").code == 0
    team = train("tiny.yaml", seed=3, set=FEW, output="b.npz", log="b.csv")
    assert isinstance(team, TableTeam)
    for suffix in ("npz", "csv"):
        assert (here / f"a.{suffix}").read_bytes() == (here / f"b.{suffix}").read_bytes()
    assert load_team("b.npz").digest == team.digest
    assert files() == ["a.csv", "a.npz", "b.csv", "b.npz"]


def test_without_files(here, files):
    team = train("tiny.yaml", set=FEW, stages="alone", seed=np.int64(2))
    assert team.tables.shape == (1, 270, 4)
    assert team.provenance["seed"] == 2
    assert team.digest == train(load_curriculum("tiny.yaml"), method=SHORT, stages=["alone"], seed=2).digest
    assert files() == []


def test_a_search(here):
    found = [train("tiny.yaml", method="search", set=SEARCH, jobs=jobs) for jobs in (1, 3)]
    assert all(isinstance(team, RankingTeam) for team in found)
    assert found[0].digest == found[1].digest
    assert found[0].provenance["method"]["n_fires"] == 2


@pytest.mark.parametrize(("n_brigades", "n_states"), [(1, 270), (2, 4320)])
def test_one_scenario_is_a_curriculum(here, n_brigades, n_states):
    scenario = load_scenario("quick").with_settings({"brigades.n": str(n_brigades), "steps": "12"})
    (here / "mine.yaml").write_text(scenario.to_yaml())
    team = train(scenario, method=SHORT)
    assert team.tables.shape == (n_brigades, n_states, 4)
    assert train("mine.yaml", method=SHORT).digest == team.digest
    assert team.provenance["curriculum"]["name"] == "quick"


def test_names_are_those_of_curricula_or_scenarios():
    assert find_curriculum("contested").digest == load_curriculum("contested").digest
    (stage,) = find_curriculum("test-1").stages
    assert (stage.name, stage.cooperation, stage.scenarios) == ("test-1", True, (load_scenario("test-1"),))


def test_callbacks_see_every_report(here):
    seen, shares = [], []

    def note(training, report):
        seen.append(report)
        shares.append(training.trainer.share_done)
        assert training.n_reports == len(seen)
        assert training.seed == 1
        assert training.trainer.team().provenance["scenarios_done"] == training.trainer.progress.scenario_number

    train("tiny.yaml", set=FEW, log="a.csv", callbacks=[note])
    assert all(isinstance(report, EpisodeReport) for report in seen)
    rows = [line.split(",") for line in (here / "a.csv").read_text().splitlines()]
    assert rows[1:] == [[str(value) for value in report.as_dict().values()] for report in seen]
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < shares[-1] == 1.0
    assert [report.text.partition(":")[0] for report in seen if report.milestone] == [
        "alone-1",
        "alone-2",
        "together-1",
        "together-2",
    ]


@pytest.mark.parametrize("n_reports", [1, 7, 12])
def test_stopped_by_a_callback_and_resumed(here, files, n_reports):
    whole = train("tiny.yaml", set=FEW, output="whole.npz", log="whole.csv")
    options = {"set": FEW, "output": "a.npz", "log": "a.csv"}
    so_far = train("tiny.yaml", **options, callbacks=[stop_after(n_reports)])
    assert so_far.digest != whole.digest
    assert files() == ["a.npz.checkpoint", "whole.csv", "whole.npz"]
    assert train("tiny.yaml", **options, resume=True).digest == whole.digest
    for suffix in ("npz", "csv"):
        assert (here / f"a.{suffix}").read_bytes() == (here / f"whole.{suffix}").read_bytes()
    assert train("tiny.yaml", **options, resume=True).digest == whole.digest, "it is done"


def test_stopped_without_an_output(here, files):
    team = train("tiny.yaml", set=FEW, log="a.csv", callbacks=[stop_after(4)])
    assert team.visits.any()
    assert files() == ["a.csv"]
    assert len((here / "a.csv").read_text().splitlines()) == 5


@pytest.mark.parametrize("method", ["paper", "search", "targets"])
def test_ctrl_c_leaves_a_checkpoint(here, files, method, monkeypatch):
    monkeypatch.setattr(signal, "getsignal", lambda _: signal.default_int_handler)
    options = {"method": method, "set": SETTINGS[method], "output": "a.npz"}

    def interrupt(training, report):
        if training.n_reports == 2:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted, match=r"^interrupted after 2 \w+s; continue from a.npz.checkpoint with --resume$"):
        train("tiny.yaml", **options, callbacks=[interrupt])
    assert files() == ["a.npz.checkpoint"]
    assert train("tiny.yaml", **options, resume=True).digest == train("tiny.yaml", **options, force=True).digest


def test_in_a_thread_of_the_callers(here):
    found = []
    thread = Thread(target=lambda: found.append(train("tiny.yaml", set=FEW, stages="alone")))
    thread.start()
    thread.join()
    assert found[0].digest == train("tiny.yaml", set=FEW, stages="alone").digest


def test_a_callback_that_fails_is_the_callers_matter(here, files):
    def fail(training, report):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        train("tiny.yaml", set=FEW, output="a.npz", callbacks=[fail])
    assert files() == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"curriculum": "absent"},
            "^absent: expected a curriculum file or one of conditions, contested, .*, or a scenario, got No ",
        ),
        (
            {"curriculum": 3},
            "^curriculum: expected a curriculum or a scenario: an object, a name or a path, got 'int'$",
        ),
        (
            {"method": "magic"},
            "^--method: expected one of paper, assignment, .*, search, targets, got 'magic'$",
        ),
        ({"method": 3}, "^--method: expected a name or a Method, got 'int'$"),
        ({"seed": -1}, "^seed: expected a whole number from 0 to 4294967295, got -1$"),
        ({"seed": 1.0}, "^seed: expected a whole number from 0 to 4294967295, got 1.0$"),
        ({"seed": True}, "^seed: expected a whole number"),
        ({"set": {"speed": 3}}, "^--set: speed: expected one of rule, alpha"),
        ({"set": {"alpha": 7}}, "^method: alpha: expected a number from 0 to 1, got 7.0$"),
        ({"set": ["alpha=7"]}, r"^set: expected values by key, as in .*, got \['alpha=7'\]$"),
        ({"stages": "al"}, "^--stages: expected stages of tiny: alone, together, got 'al'$"),
        ({"stages": 1}, "^--stages: expected names of stages, got 'int'$"),
        ({"output": 3}, "^output: expected the path of a file, got 3$"),
        ({"output": "no/t.npz"}, "^no/t.npz: expected an existing folder"),
        ({"output": "t.npy"}, "^t.npy: expected a file ending in .npz, got '.npy'$"),
        ({"output": "t.npz", "log": "t.npz"}, "^t.npz: expected a file of its own"),
        ({"resume": True}, "^--resume: expected an output or a record to continue from, got 'none'$"),
        ({"output": "t.npz", "resume": True}, "^--resume: expected a checkpoint to continue from, got no t.npz.check"),
        ({"output": "t.npz", "resume": True, "force": True}, "^--force and --resume exclude each other$"),
        ({"jobs": 0}, "^jobs: expected a whole number from 1 to 1000, got 0$"),
        ({"callbacks": print}, r"^callbacks: expected a list of functions of \(training, report\), got <built-in"),
        ({"callbacks": [3]}, r"^callbacks: expected a list of functions of \(training, report\), got \[3\]$"),
    ],
)
def test_what_cannot_be_done(here, files, options, message):
    with pytest.raises(FireworldError, match=message) as caught:
        train(**{"curriculum": "tiny.yaml", "method": PAPER, **options})
    assert "\n" not in str(caught.value)
    assert files() == []


def test_nothing_is_replaced_unless_asked(here):
    train("tiny.yaml", set=FEW, stages="alone", output="a.npz")
    content = (here / "a.npz").read_bytes()
    with pytest.raises(OutputError, match=r"^a.npz: expected a name that is free"):
        train("tiny.yaml", set=FEW, stages="alone", output="a.npz", seed=2)
    with pytest.raises(TrainingError, match=r"^a.npz: seed: expected 2, got 1; name what it was begun with"):
        train("tiny.yaml", set=FEW, stages="alone", output="a.npz", seed=2, resume=True)
    assert (here / "a.npz").read_bytes() == content
    train("tiny.yaml", set=FEW, stages="alone", output="a.npz", seed=2, force=True)
    assert (here / "a.npz").read_bytes() != content
