"""`fireworld reproduce` on a small town: everything is written, twice the same; faults and Ctrl-C in one line."""

from __future__ import annotations

import json
import shutil
import signal
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from threading import Event

import msgspec
import numpy as np
import pytest
from fireworld_recorder.reader import open_log

from fireworld.errors import FireworldError, OutputError, TrainingError
from fireworld.policy.teams.team import load_team
from fireworld.reproduction import folder as reproduction_folder
from fireworld.reproduction import paper
from fireworld.reproduction.csv_files import CSV_FILES
from fireworld.reproduction.repetitions import random_tables, train_repetition, without_flags
from fireworld.reproduction.reproduce import reproduce
from fireworld.reproduction.study import ALONE, TOGETHER, TOGETHER_WITHOUT_FLAGS
from fireworld.reproduction.trainings import RepetitionLogs
from fireworld.scenario import load_scenario
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import load_curriculum
from fireworld.training.log.reader import open_training
from fireworld.training.methods.sarsa import Sarsa, SarsaTrainer
from fireworld.training.train import train as fw_train

pytestmark = pytest.mark.heavy

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
METHOD = Sarsa(n_episodes_max=25, n_episodes_unchanged=5)
FEW = ("reproduce", "--repetitions", 2, "--seeds", 2, "--out", "found")


@pytest.fixture
def curriculum(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(CURRICULUM)
    return path


TEST = paper.PaperTest("quick", 2, (90, 60), (5, 1), (3.0, 4.0), 5)
SMALL_PAPER = paper.World(
    "paper", "a small town", "paper", (paper.PaperTraining("quick", 50, 4.5, 5),), (TEST,), (TEST,)
)


@pytest.fixture
def small(tmp_path, monkeypatch, curriculum):
    """A paper whose every scenario is a small town."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("fireworld.reproduction.reproduce.PAPER", METHOD)
    monkeypatch.setitem(paper.WORLDS, "paper", replace(SMALL_PAPER, curriculum=str(curriculum)))
    return tmp_path


def train(curriculum, number=1, **more):
    seen = []
    words = {"cities": CityCache(), "stop": Event(), "on_scenario": lambda: seen.append(1), **more}
    return train_repetition(curriculum, METHOD, number, **words), len(seen)


@pytest.fixture
def trained(monkeypatch):
    """Numbers of the repetitions that are trained."""
    numbers = []

    def train_and_note(curriculum, method, number, **words):
        numbers.append(number)
        return train_repetition(curriculum, method, number, **words)

    monkeypatch.setattr("fireworld.reproduction.measurement.train_repetition", train_and_note)
    return numbers


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
        trainer = SarsaTrainer(whole, METHOD, seed=1)
        reports = [*trainer]
        assert found.teams[name].digest == trainer.team().digest, name
        assert (found.teams[name].visits == trainer.team().visits).all()
        rewards = [reward for curve in found.curves if curve.team == name for reward in curve.total_reward]
        assert rewards == [report.total_reward for report in reports][-len(rewards) :]
    assert found.teams[TOGETHER].digest != train(chosen, number=2)[0].teams[TOGETHER].digest
    assert 0.0 <= found.agreement <= 1.0


def test_graduates_are_the_team_after_each_scenario(tmp_path):
    path = tmp_path / "three.yaml"
    path.write_text(CURRICULUM.replace("[quick, quick]", "[quick, a.yaml, b.yaml]"))
    for name in ("a", "b"):
        (tmp_path / f"{name}.yaml").write_text(msgspec.structs.replace(load_scenario("quick"), name=name).to_yaml())
    chosen = load_curriculum(path)
    found, _ = train(chosen, with_graduates=True)
    assert list(found.graduates) == ["quick", "a", "b"]
    trainer, after = SarsaTrainer(chosen, METHOD, seed=1), {}
    assert trainer.graduate is None
    for report in trainer:
        if not trainer.progress.episode:
            after[report.scenario] = trainer.graduate
            n_brigades, n_before = trainer.graduate.tables.shape[0], len(trainer.progress.tables)
            assert trainer.graduate.provenance["scenarios_done"] == trainer.progress.scenario_number
            if n_brigades == n_before == 2 and not trainer.done:  # one table was drawn for all, after this was noted
                assert (trainer.progress.tables[0] == trainer.progress.tables[1]).all()
    for name, team in found.graduates.items():
        np.testing.assert_array_equal(team.tables, after[name].tables)
    assert found.graduates["b"].digest == found.teams[TOGETHER].digest
    assert (found.graduates["a"].tables[0] != found.graduates["a"].tables[1]).any()
    assert not train(chosen)[0].graduates


def test_recorded_trainings_are_trainings_from_end_to_end(curriculum, tmp_path):
    """Each log, also that whose stage alone was copied, is what `train --record` writes; curves are read from them."""
    chosen = load_curriculum(curriculum)
    plain, _ = train(chosen)
    found, _ = train(chosen, logs=RepetitionLogs(tmp_path, 1))
    assert {name: team.digest for name, team in found.teams.items()} == {
        name: team.digest for name, team in plain.teams.items()
    }
    for name, whole in ((TOGETHER, chosen), (TOGETHER_WITHOUT_FLAGS, without_flags(chosen))):
        fw_train(whole, method=METHOD, record=tmp_path / "whole.mcap", force=True)
        path = tmp_path / f"{name}-1.mcap"
        assert path.read_bytes() == (tmp_path / "whole.mcap").read_bytes(), name
        assert found.logs[name] == open_training(path).digest
        assert open_training(path).team().digest == found.teams[name].digest
    assert not [*tmp_path.glob("*.partial")]
    assert len(found.curves) == len(plain.curves)
    for ours, theirs in zip(found.curves, plain.curves, strict=True):
        np.testing.assert_equal(vars(ours), vars(theirs))


def test_random_tables_differ_between_brigades_and_repetitions():
    one, other = random_tables(1, n_brigades=2), random_tables(2, n_brigades=2)
    assert one.shape == (2, 4320, 4)
    assert (one == random_tables(1, n_brigades=2)).all()
    assert 0.2 < (one[0].argmax(axis=1) == one[1].argmax(axis=1)).mean() < 0.3
    assert 0.2 < (one[0].argmax(axis=1) == other[0].argmax(axis=1)).mean() < 0.3


def test_everything_is_written_and_twice_the_same(small, fireworld):
    done = fireworld(*FEW)
    assert done.code == 0, done.err
    assert "findings" in done.out
    assert "a claim about" in done.out
    folder = small / "found"
    first = {path.name: path.read_bytes() for path in folder.glob("*.csv")}
    assert sorted(first) == sorted(CSV_FILES)
    assert sorted(path.name for path in (folder / "teams").iterdir()) == sorted([
        *(f"{name}-{number}.npz" for name in (ALONE, TOGETHER, TOGETHER_WITHOUT_FLAGS) for number in (1, 2)),
        f"{TOGETHER}-1-after-quick.npz",
    ])  # fmt: skip
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
    assert first == {name: (folder / name).read_bytes() for name in CSV_FILES}


class Killed(BaseException):
    """What nothing catches, like the end of a process."""


@pytest.fixture
def undrawn(monkeypatch):
    """No images, which take most of the time."""
    monkeypatch.setattr("fireworld.reproduction.reproduce.pictures", lambda *_: {})


def test_from_python_with_an_executor_it_is_the_same(small, undrawn, curriculum):
    """The tables of threads and processes are equal; what is done shows itself."""
    told, found = [], {}
    there = ProcessPoolExecutor(2, get_context("spawn"))
    with there, ThreadPoolExecutor(2) as here:
        for name, executor in (("threads", 1), ("here", here), ("there", there)):
            words = {"repetitions": 2, "seeds": 2, "executor": executor}
            found[name] = reproduce(name, on_progress=lambda *words: told.append(words), **words)
            assert [max(n for what, n, _ in told if what == each) for each in ("training", "testing")] == [12, 23]
            assert {(what, n) for what, _, n in told} == {
                ("training", 12),
                ("testing", 23),
                ("recording", 5),
                ("drawing", 0),
            }
            told.clear()
    folders = [
        {path: data for path, data in contents(small / name).items() if path.suffix in {".csv", ".json", ".npz"}}
        for name in found
    ]
    assert all([*each.values()] == [*folders[0].values()] for each in folders)
    one = found["there"]
    assert one.folder == Path("there")
    assert repr(one).startswith("in a small town; paper: ours [95 % interval]\nscenario  quantity")
    assert [finding.question in repr(one) for finding in one.findings] == [True] * len(one.findings)
    assert one.caveat in repr(one)
    assert one._repr_html_().startswith('<iframe srcdoc="&lt;!doctype html&gt;')
    assert len(one.study.curves) == 12


def test_a_folder_of_an_earlier_version_is_resumed(small, undrawn, trained, monkeypatch):
    monkeypatch.setattr("fireworld.reproduction.measurement.__version__", "0.1.0")
    earlier = Path(__file__).parent / "data" / "reproduction-1"
    for name in ("kept", "teams"):
        shutil.copytree(earlier / name, small / "found" / name)
    reproduce("found", repetitions=2, seeds=2, resume=True)
    assert trained == [2]
    for path in (earlier / "expected").iterdir():
        assert (small / "found" / path.name).read_bytes() == path.read_bytes(), path.name


def test_a_folder_is_resumed_in_its_world(begun, undrawn, trained, fireworld, monkeypatch):
    """Whatever the default is by then, as in folders from before there were two worlds; another one is refused."""
    small_town = paper.WORLDS["paper"]
    monkeypatch.setitem(paper.WORLDS, "paper", paper.PAPER)
    monkeypatch.setitem(paper.WORLDS, "tests", replace(small_town, name="tests"))
    assert "settings.json: curriculum" in refusal(fireworld, begun, "--world", "paper")
    assert fireworld(*FEW, "--resume").code == 0
    assert trained == [2]


def test_readings_have_no_world(small, fireworld):
    done = fireworld(*FEW, "--readings", "--world", "paper")
    assert (done.code, done.out) == (2, "")
    assert "--readings begins with the world tests" in done.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"repetitions": 0}, "repetitions: expected a whole number from 1 to 1000, got 0"),
        ({"seeds": "many"}, "seeds: expected a whole number"),
        ({"curriculum": "nowhere"}, "nowhere"),
        ({"world": "dense"}, "world: expected one of paper, tests, got 'dense'"),
        ({"executor": "fibres"}, "executor: expected"),
        ({"resume": True}, "resume: expected a reproduction to continue"),
    ],
)
def test_wrong_arguments_take_one_line_and_leave_nothing(small, words, message):
    with pytest.raises(FireworldError, match=message) as caught:
        reproduce("found", **words)
    assert "\n" not in str(caught.value)
    assert not (small / "found").exists()


def test_a_curriculum_without_table_1_takes_one_line(small, curriculum, monkeypatch):
    monkeypatch.setitem(paper.WORLDS, "paper", paper.PAPER)
    with pytest.raises(TrainingError, match="expected all scenarios of the paper's Table 1"):
        reproduce("found", curriculum=curriculum)
    assert not (small / "found").exists()


WHOLE = {}


@pytest.fixture
def whole(small, undrawn, fireworld):
    """The files of a reproduction without an interruption, by their path in its folder; made once for all tests."""
    if not WHOLE:
        assert fireworld(*FEW[:-1], "whole").code == 0
        folder = small / "whole"
        WHOLE.update({str(path.relative_to(folder)): data for path, data in contents(folder).items()})
    return WHOLE


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def assert_whole(folder, whole):
    """Compare a folder with that of an uninterrupted reproduction, file by file."""
    assert whole == {str(path.relative_to(folder)): data for path, data in contents(folder).items()}


def at_write(monkeypatch, name, act):
    """Do something once, before a piece of work is kept under a name."""
    write = reproduction_folder.write_file

    def write_file(path, data):
        if path.name == name:
            monkeypatch.setattr(reproduction_folder, "write_file", write)
            act()
        write(path, data)

    monkeypatch.setattr(reproduction_folder, "write_file", write_file)


def kept_files(small):
    return sorted(path.name for path in (small / "found" / "kept").iterdir())


def test_ctrl_c_and_resume(small, fireworld, whole, trained, monkeypatch):
    at_write(monkeypatch, "tests-1.json", lambda: signal.raise_signal(signal.SIGINT))
    done = fireworld(*FEW, "--jobs", 1)
    assert done.code == 130
    assert done.err == "interrupted; 1 of 2 trainings are kept in found: continue with --resume\n"
    assert kept_files(small) == ["settings.json", "tests-1.json", "training-1.json"]
    assert not [*(small / "found").glob("*.csv"), *(small / "found").glob("report.html")]
    refused = fireworld(*FEW)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "--resume continues it, --force replaces what is there" in refused.err
    trained.clear()
    resumed = fireworld(*FEW, "--resume")
    assert resumed.code == 0, resumed.err
    assert trained == [2], "the first is not trained again"
    assert_whole(small / "found", whole)
    again = fireworld(*FEW, "--resume")
    assert (again.code, again.out) == (0, resumed.out)
    assert trained == [2], "what is done can be judged and drawn once more"


def test_with_recorded_trainings_it_is_the_same(small, fireworld, whole, trained, monkeypatch):
    """Interrupted and resumed, too: of the finished repetition the curves are read from its logs."""
    at_write(monkeypatch, "training-2.json", lambda: signal.raise_signal(signal.SIGINT))
    assert fireworld(*FEW, "--record-trainings", "--jobs", 1).code == 130
    logs = small / "found" / "trainings"
    names = [f"{team}-{number}.mcap" for team in (TOGETHER, TOGETHER_WITHOUT_FLAGS) for number in (1, 2)]
    assert sorted(path.name for path in logs.iterdir()) == sorted(names)
    assert json.loads((small / "found" / "kept" / "training-1.json").read_text()).keys() == {
        "teams", "graduates", "logs"
    }  # fmt: skip
    trained.clear()
    resumed = fireworld(*FEW, "--record-trainings", "--resume")
    assert resumed.code == 0, resumed.err
    found = {str(path.relative_to(small / "found")): data for path, data in contents(small / "found").items()}
    assert {name for name in found if found[name] != whole.get(name)} == {
        *(f"trainings/{name}" for name in names),
        *(f"kept/{name}.json" for name in ("settings", "training-1", "training-2")),
    }
    assert whole.keys() <= found.keys()
    (small / "found" / "kept" / "training-2.json").unlink()
    (logs / f"{names[1]}.partial").write_bytes((logs / names[1]).read_bytes()[:-5000])
    assert fireworld(*FEW, "--record-trainings", "--resume").code == 0
    assert trained == [2]
    assert found == {str(path.relative_to(small / "found")): data for path, data in contents(small / "found").items()}
    assert fireworld("verify", logs / names[0]).code == 0
    assert "record_trainings: expected False, got True" in refusal(fireworld, small / "found")
    (logs / names[0]).write_bytes((logs / names[1]).read_bytes())
    refused = refusal(fireworld, small / "found", "--record-trainings", "--jobs", 1)
    assert f"trainings/{names[0]}: expected the training " in refused
    assert "delete found/kept/training-1.json and it is trained anew" in refused
    (logs / names[0]).unlink()
    assert names[0] in refusal(fireworld, small / "found", "--record-trainings", "--jobs", 1)
    assert fireworld(*FEW, "--force", "--jobs", 1).code == 0
    assert [*logs.iterdir()] == []


def test_recording_is_asked_for_at_the_beginning(begun, fireworld):
    assert "record_trainings: expected True, got False" in refusal(fireworld, begun, "--record-trainings")


def test_a_kill_and_resume(small, fireworld, whole, monkeypatch):
    def die():
        raise Killed

    at_write(monkeypatch, "training-2.json", die)  # its teams are written by then
    assert fireworld(*FEW, "--jobs", 1).code == 2
    assert kept_files(small) == ["settings.json", "tests-1.json", "training-1.json"]
    assert fireworld(*FEW, "--resume", "--jobs", 1).code == 0
    assert_whole(small / "found", whole)


def test_a_full_disk_keeps_what_was_done(small, fireworld, monkeypatch):
    def fail():
        raise OutputError("found/kept/tests-2.json: cannot be written: No space left on device")

    at_write(monkeypatch, "tests-2.json", fail)
    done = fireworld(*FEW, "--jobs", 1)
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert {"training-1.json", "tests-1.json", "training-2.json"} < set(kept_files(small))


@pytest.fixture
def begun(small, undrawn, fireworld, monkeypatch):
    """A folder with one repetition kept."""
    with monkeypatch.context() as once:
        at_write(once, "tests-1.json", lambda: signal.raise_signal(signal.SIGINT))
        assert fireworld(*FEW, "--jobs", 1).code == 130
    return small / "found"


def refusal(fireworld, folder, *words):
    """Ask to go on; return what is said against it. Nothing is changed."""
    before = contents(folder)
    done = fireworld(*FEW, *words, "--resume")
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert contents(folder) == before
    return done.err


def test_other_settings_are_refused(begun, fireworld, monkeypatch):
    settings = "fireworld: found/kept/settings.json: "
    hint = "; name what it was begun with, or begin again with --force\n"
    assert refusal(fireworld, begun, "--repetitions", 3) == f"{settings}repetitions: expected 3, got 2{hint}"
    assert refusal(fireworld, begun, "--seeds", 1) == f"{settings}seeds: expected [1000], got [1000, 1001]{hint}"
    monkeypatch.setattr("fireworld.reproduction.reproduce.PAPER", METHOD.with_settings({"gamma": "0.9"}))
    assert refusal(fireworld, begun) == f"{settings}method.gamma: expected 0.9, got 0.5{hint}"
    monkeypatch.setattr("fireworld.reproduction.reproduce.PAPER", METHOD)
    monkeypatch.setattr("fireworld.reproduction.measurement.__version__", "9")
    assert refusal(fireworld, begun) == f"{settings}fireworld: expected 9, got '0.1.0'{hint}"


def test_a_changed_curriculum_is_refused(begun, fireworld, curriculum):
    curriculum.write_text(CURRICULUM.replace("steps: 40", "steps: 41"))
    assert "settings.json: curriculum.digest: expected " in refusal(fireworld, begun)


@pytest.mark.parametrize("name", ["settings.json", "training-1.json", "tests-1.json"])
@pytest.mark.parametrize("damage", ["cut off", "{}", "[1]"])
def test_damage_is_named(begun, fireworld, name, damage):
    path = begun / "kept" / name
    path.write_bytes(path.read_bytes()[:-9] if damage == "cut off" else damage.encode())
    assert refusal(fireworld, begun, "--jobs", 1).startswith(f"fireworld: found/kept/{name}: ")


def test_changed_tests_and_teams_are_named(begun, fireworld):
    path = begun / "kept" / "tests-1.json"
    whole = json.loads(path.read_text())
    whole["quick"][TOGETHER]["score"].pop()
    text, path_text = json.dumps(whole), path.read_text()
    path.write_text(text)
    assert "of 2 runs, got 'others'; delete it and it is made anew" in refusal(fireworld, begun, "--jobs", 1)
    path.write_text(path_text)
    team = begun / "teams" / f"{TOGETHER}-1.npz"
    team.write_bytes((begun / "teams" / f"{ALONE}-1.npz").read_bytes())
    assert refusal(fireworld, begun, "--jobs", 1).startswith(
        f"fireworld: found/teams/{TOGETHER}-1.npz: expected the team "
    )
    team.unlink()
    assert "expected a team file, got No such file" in refusal(fireworld, begun, "--jobs", 1)


def test_nothing_to_resume(small, fireworld):
    done = fireworld(*FEW, "--resume")
    assert (done.code, done.out) == (2, "")
    assert done.err == (
        "fireworld: resume: expected a reproduction to continue, got no found/kept/settings.json; leave out --resume\n"
    )
    assert not (small / "found").exists()
    assert fireworld(*FEW, "--resume", "--force").code == 2


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--out", "no/such/place"), "cannot be made: No such file or directory"),
        (("--out", "small.yaml"), "expected a free name or an empty folder"),
        (("--out", "small.yaml", "--force"), "cannot be made"),
        (("--repetitions", "0"), "Invalid value for '--repetitions'"),
    ],
)
def test_mistakes_take_one_line(small, fireworld, words, message):
    done = fireworld("reproduce", *words)
    assert (done.code, done.out) == (2, "")
    assert message in done.err


def test_without_matplotlib_nothing_is_begun(small, fireworld, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    done = fireworld(*FEW)
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "fireworld[figures]" in done.err
    assert not (small / "found").exists()
