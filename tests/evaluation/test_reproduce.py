"""`fireworld reproduce` on a small town: everything is written, twice the same; faults and Ctrl-C in one line."""

from __future__ import annotations

import signal
from threading import Event

import pytest

from fireworld.cli import reproduce
from fireworld.cli.repetitions import Training, random_tables, without_flags
from fireworld.cli.workers import Workers
from fireworld.evaluation import paper
from fireworld.evaluation.sheets import SHEETS
from fireworld.evaluation.study import ALONE, TOGETHER, TOGETHER_WITHOUT_FLAGS
from fireworld.policy import team
from fireworld.policy.team import load_team
from fireworld.training.curriculum import load_curriculum
from fireworld.training.method import Method
from fireworld.training.trainer import Trainer
from recorder.reader import open_log
from tests.cli.conftest import fireworld  # noqa: F401 - a fixture

CURRICULUM = """
stages:
  - name: alone
    cooperation: false
    base: quick
    set: {brigades.n: 1, steps: 40}
    vary: {fires.0.n_buildings: [1, 2]}
  - name: together
    cooperation: true
    scenarios: [quick, quick]
"""
METHOD = Method(n_episodes_max=25, n_episodes_unchanged=5)
FEW = ("reproduce", "--repetitions", 2, "--seeds", 2, "--out", "found")


@pytest.fixture
def curriculum(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(CURRICULUM)
    return path


@pytest.fixture
def small(tmp_path, monkeypatch, curriculum):
    """A paper whose every scenario is a small town."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(reproduce, "CURRICULUM", curriculum)
    monkeypatch.setattr("fireworld.training.method.PAPER", METHOD)
    monkeypatch.setattr("fireworld.evaluation.paper.TABLE_1", (paper.Lesson("quick", 50, 4.5, 5),))
    test = paper.Test("quick", 2, (90, 60), (5, 1), (3.0, 4.0), 5)
    monkeypatch.setattr("fireworld.evaluation.paper.TABLE_2", (test,))
    monkeypatch.setattr("fireworld.evaluation.paper.TABLE_3", (test,))
    return tmp_path


def train(curriculum, number=1):
    stop, seen = Event(), []
    training = Training(
        curriculum=curriculum, method=METHOD, number=number, grounds={}, stop=stop, on_scenario=lambda: seen.append(1)
    )
    return training(), len(seen)


def test_a_repetition_equals_trainings_from_end_to_end(curriculum):
    """Sharing stage alone changes no table."""
    chosen = load_curriculum(curriculum)
    found, n_scenarios = train(chosen)
    assert n_scenarios == 6
    for name, whole in (
        (TOGETHER, chosen),
        (TOGETHER_WITHOUT_FLAGS, without_flags(chosen)),
        (ALONE, chosen.only(["alone"])),
    ):
        trainer = Trainer(whole, METHOD, seed=1)
        reports = [*trainer]
        assert found.teams[name].digest == trainer.team().digest, name
        assert (found.teams[name].visits == trainer.team().visits).all()
        rewards = [reward for lesson in found.lessons if lesson.team == name for reward in lesson.total_reward]
        assert rewards == [report.total_reward for report in reports][-len(rewards) :]
    assert found.teams[TOGETHER].digest != train(chosen, number=2)[0].teams[TOGETHER].digest
    assert 0.0 <= found.agreement <= 1.0


def test_random_tables_differ_between_brigades_and_repetitions():
    one, other = random_tables(1, n_brigades=2), random_tables(2, n_brigades=2)
    assert one.shape == (2, 4320, 4)
    assert (one == random_tables(1, n_brigades=2)).all()
    assert 0.2 < (one[0].argmax(axis=1) == one[1].argmax(axis=1)).mean() < 0.3
    assert 0.2 < (one[0].argmax(axis=1) == other[0].argmax(axis=1)).mean() < 0.3


def test_everything_is_written_and_twice_the_same(small, fireworld):  # noqa: F811
    done = fireworld(*FEW)
    assert done.code == 0, done.err
    assert "findings" in done.out
    assert "a claim about" in done.out
    folder = small / "found"
    first = {path.name: path.read_bytes() for path in folder.glob("*.csv")}
    assert sorted(first) == sorted(SHEETS)
    assert sorted(path.name for path in (folder / "teams").iterdir()) == sorted(
        f"{name}-{number}.npz" for name in (ALONE, TOGETHER, TOGETHER_WITHOUT_FLAGS) for number in (1, 2)
    )
    assert load_team(folder / "teams" / f"{TOGETHER}-1.npz").tables.shape == (2, 4320, 4)
    recordings = sorted(path.name for path in (folder / "recordings").iterdir())
    assert recordings == ["quick-cooperative.mcap", "quick-non-cooperative.mcap"]
    assert open_log(folder / "recordings" / recordings[0]).header.policy == TOGETHER
    assert {path.stem for path in (folder / "figures").iterdir()} == {
        "returns", "policy-changes", "quick-before", "quick-cooperative", "quick-non-cooperative",
    }  # fmt: skip
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count("data:image/png") == 2 + 2 * 3
    again = fireworld(*FEW)
    assert (again.code, again.out, again.err.count("\n")) == (2, "", 1)
    assert "--force" in again.err
    (folder / "own.csv").write_text("mine")
    assert fireworld(*FEW, "--force", "--jobs", 1).code == 0
    assert (folder / "own.csv").read_text() == "mine"
    assert first == {name: (folder / name).read_bytes() for name in SHEETS}


def test_ctrl_c_keeps_the_teams_that_are_trained(small, fireworld, monkeypatch):  # noqa: F811
    save = team.save_team

    def save_and_interrupt(found, path):
        save(found, path)
        if path.stem == f"{TOGETHER}-1":
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(team, "save_team", save_and_interrupt)
    done = fireworld(*FEW, "--jobs", 1)
    assert done.code == 130
    assert done.err == "interrupted; 1 of 2 trainings are kept in found/teams\n"
    assert len([*(small / "found" / "teams").iterdir()]) == 3
    assert not [*(small / "found").glob("*.csv"), *(small / "found").glob("report.html")]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--out", "no/such/place"), "cannot be made: No such file or directory"),
        (("--out", "small.yaml"), "expected a free name or an empty folder"),
        (("--out", "small.yaml", "--force"), "cannot be made"),
        (("--repetitions", "0"), "Invalid value for '--repetitions'"),
    ],
)
def test_mistakes_take_one_line(small, fireworld, words, message):  # noqa: F811
    done = fireworld("reproduce", *words)
    assert (done.code, done.out) == (2, "")
    assert message in done.err


def test_without_matplotlib_nothing_is_begun(small, fireworld, monkeypatch):  # noqa: F811
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    done = fireworld(*FEW)
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "fireworld[figures]" in done.err
    assert not (small / "found").exists()


def test_a_failing_task_stops_the_others():
    workers = Workers(2, Event())

    def fail():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        workers.run([fail, *[workers.stop.wait] * 3])
    assert workers.stop.is_set()


def test_results_come_in_order_and_none_after_a_stop():
    workers = Workers(3, Event())
    assert workers.run([lambda k=k: k * k for k in range(20)]) == [k * k for k in range(20)]
    workers.stop.set()
    assert workers.run([lambda: 1]) is None
