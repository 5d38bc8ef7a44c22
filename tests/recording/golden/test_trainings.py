"""Golden trainings: added, checked, updated; whatever changes what a team learns is caught, and located."""

from __future__ import annotations

import dataclasses
import json
from xml.etree import ElementTree

import numpy as np
import pytest

from fireworld.errors import LogError, OutputError, TrainingError
from fireworld.recording.golden.check import check_golden, check_goldens
from fireworld.recording.golden.training import TrainingSpec, prepare_training, training_spec_of
from fireworld.recording.golden.update import add_training, store_if_changed, update_goldens
from fireworld.training.log.reader import open_training
from fireworld.training.log.records import Updates
from fireworld.training.log.writer import TrainingWriter
from fireworld.training.methods import sarsa
from fireworld.training.train import train
from tests import command_line

SHORT = ("--set", "n_episodes_max=4", "--set", "n_episodes_unchanged=3")
ADD = ("add", "tiny.yaml", "--train", *SHORT, "--name", "tiny")
TINY = """
stages:
  - name: alone
    cooperation: false
    base: town.yaml
    set: {brigades.n: 1, steps: 12}
    vary: {fires.0.n_buildings: [1, 3]}
  - name: together
    cooperation: true
    base: town.yaml
    set: {brigades.n: 3, steps: 14}
    vary: {fires.0.n_buildings: [2, 4]}
"""


@pytest.fixture
def here(here, monkeypatch):
    """The current folder, with a curriculum in it, of a scenario in it."""
    (here / "town.yaml").write_text(command_line.call(monkeypatch, "scenarios", "show", "quick", "--yaml").out)
    (here / "tiny.yaml").write_text(TINY)
    return here


@pytest.fixture
def kept(here, golden):
    """A folder with a golden training."""
    done = golden(*ADD)
    assert (done.code, done.err) == (0, "")
    return here / "recordings" / "golden"


@pytest.fixture
def other_default(monkeypatch):
    """Let the method have another default, as after an edit of it."""

    def change(**settings):
        monkeypatch.setattr(sarsa, "METHOD", dataclasses.replace(sarsa.METHOD, **settings))

    return change


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_it_is_a_training_log_and_a_text(kept):
    assert sorted(contents(kept)) == ["tiny.mcap", "tiny.txt"]
    log = open_training(kept / "tiny.mcap")
    assert log.done
    assert training_spec_of(log.header) == TrainingSpec(
        curriculum="../../tiny.yaml", settings={"n_episodes_max": "4", "n_episodes_unchanged": "3"}
    )
    text = (kept / "tiny.txt").read_text()
    assert "curriculum             tiny\nscenarios              4\nmethod                 paper\n" in text
    assert "  n_episodes_max       4\n" in text
    table = [line.split() for line in text.splitlines() if line.startswith(("alone ", "together "))]
    assert [line[1:4:2] for line in table] == [
        [log.scenarios[line.scenario].name, str(line.episode)] for line in log.lines
    ]
    assert text.endswith(f"\nteam {log.team().digest}\nhash {log.digest}\n")


def test_it_is_the_training_that_train_makes(kept, here):
    team = train("tiny.yaml", set={"n_episodes_max": 4, "n_episodes_unchanged": 3}, record="plain.mcap")
    log = open_training(kept / "tiny.mcap")
    assert (log.digest, log.team().digest) == (open_training(here / "plain.mcap").digest, team.digest)


def test_nothing_has_changed(kept, golden):
    done = golden("check")
    assert done.code == 0
    assert done.out.splitlines()[-1].split() == ["tiny", "tiny", "paper", "1", "16", "episodes", "same"]


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"alpha": 0.6}, "brigade 0 in state * learned value of *"),
        ({"gamma": 0.9}, "brigade 0 in state * TD error of *"),
        ({"epsilon_decay": 0.5}, "alone-1, episode 1: epsilon 0.5, was 0.9"),
        ({"reward": "change"}, "alone-1, episode 0, step *"),
        ({"choices": "simultaneous"}, "together-1, episode 0, step *"),
        ({"fixed_noise": True}, "alone-1, episode 1: seed *"),
    ],
)
def test_another_default_is_located(kept, golden, other_default, changes, sentence):
    other_default(**changes)
    done = golden("check")
    assert done.code == 1
    first = next(line for line in done.out.splitlines() if line.startswith("tiny: "))
    for part in sentence.split("*"):
        assert part.strip() in first
    (key,) = changes
    words = [str(value).lower() for value in (changes[key], getattr(sarsa.PAPER, key))]
    assert f"  changed: method: {key}: {words[0]}, was {words[1]}; curriculum, seed" in done.out
    assert 'If that is meant: fireworld golden update --reason "..."' in done.out


@pytest.mark.parametrize(
    ("name", "value", "where", "phase"),
    [
        ("RULES", tuple(reversed(sarsa.RULES)), "alone-1, episode 0, step 3", "learn"),
        ("_power", lambda *_: 0.5, "alone-1, episode 0", "draw"),
        ("episode_seed", lambda *_: 77, "alone-1, episode 0", "draw"),
        ("below", lambda *_, bound: 0 * bound, "together-1, episode 3", "end"),
    ],
)
def test_another_rule_exploration_or_draw_is_located(kept, monkeypatch, name, value, where, phase):
    """With the same settings: the code has changed."""
    monkeypatch.setattr(sarsa, name, value)
    found = check_golden(kept / "tiny.mcap")
    assert found.result == "different"
    assert found.difference.header == {}
    assert found.cause.changes == {}
    assert found.headline.startswith("nothing recorded changed; ")
    assert found.difference.first.where.startswith(where)
    assert found.difference.first.phase == phase


def test_another_rule_is_seen_in_a_plain_log_too_after_the_episode(here, monkeypatch):
    """Which has no value after every update: the golden names the step."""
    train("tiny.yaml", set={"n_episodes_max": 2}, record="plain.mcap")
    monkeypatch.setattr(sarsa, "RULES", tuple(reversed(sarsa.RULES)))
    found = check_golden(here / "plain.mcap")
    assert found.sentence.startswith("alone-1, episode 0: values learned from the same steps, tables digest ")


def test_values_after_updates_that_make_no_sense(kept, other_default):
    path = kept / "tiny.mcap"
    log = open_training(path)
    trainer = log.trainer()
    trainer.detailed = True
    with TrainingWriter(path, trainer, header=log.header, force=True) as writer:
        for _ in trainer:
            trainer.records()[-1] = Updates(np.zeros(3))
            writer.write()
        writer.close()
    assert check_golden(path).result == "same", "they are looked at where trainings differ"
    other_default(alpha=0.6)
    found = check_golden(path)
    assert (found.result, found.sentence) == ("cannot", "3 updates of 1 brigades in 4 steps")


def test_another_reward_of_the_scenario_is_located(kept, here):
    path = here / "town.yaml"
    path.write_text(path.read_text().replace("reward: stock", "reward: {burning: -2}"))
    found = check_golden(kept / "tiny.mcap")
    assert found.difference.first.phase == "reward"
    assert found.sentence.startswith("alone-1, episode 0, step 4: reward water damaged 0, was -1")
    assert "curriculum" in found.difference.header
    assert "alone-1.reward.burning: -2.0, was not set" in found.cause.changes["curriculum"]


def test_other_numbers_of_brigades_cannot_be_compared(kept, here, golden):
    path = here / "tiny.yaml"
    path.write_text(path.read_text().replace("brigades.n: 3", "brigades.n: 2"))
    done = golden("check")
    assert done.code == 2
    assert "tiny: now: brigades: expected 3 in together-1" in done.out


def test_for_programs(kept, golden, here, other_default):
    other_default(alpha=0.6)
    done = golden("check", "--json", "--junit", "report.xml", "--keep", "new")
    assert done.code == 1
    (found,) = json.loads(done.out)
    assert (found["name"], found["result"], found["curriculum"], found["method"]) == (
        "tiny",
        "different",
        "tiny",
        "paper",
    )
    assert (found["first"]["phase"], found["header"]) == ("learn", {"alpha": [0.7, 0.6]})
    failure = ElementTree.parse("report.xml").find("testsuite/testcase/failure")
    assert failure.get("message") == f"method changed; {found['sentence']}"
    assert "alpha: 0.6, was 0.7" in failure.text
    new = open_training(here / "new" / "tiny.mcap")
    assert new.method.alpha == 0.6
    assert [path.name for path in (here / "new").iterdir()] == ["tiny.mcap"]


def test_update_says_what_changed(kept, golden, other_default):
    before = contents(kept)
    other_default(alpha=0.6)
    done = golden("update", "--reason", "It learns more slowly.")
    assert (done.code, done.out.splitlines()[-1]) == (0, "1 changed, 0 the same")
    assert "learned value of" in done.out
    after = contents(kept)
    assert after["REASONS.md"].decode().endswith(f"\n* It learns more slowly.\n  * {done.out.splitlines()[0]}\n")
    assert before["tiny.txt"] != after["tiny.txt"]
    assert golden("check").code == 0
    assert golden("update", "--reason", "None.").out == "0 changed, 1 the same\n"


def test_a_search(here, golden, monkeypatch):
    few = ("n_generations=2", "n_candidates=4", "n_best=2", "n_fires=2", "n_steps_max=10")
    words = [word for one in few for word in ("--set", one)]
    done = golden("add", "quick", "--train", "--method", "search", *words, "--seed", 3)
    assert done.out.startswith("recordings/golden/quick-search-training-seed-3.mcap: recorded")
    assert golden("check").code == 0
    from fireworld.training.methods import search

    monkeypatch.setattr(search, "METHOD", dataclasses.replace(search.METHOD, step=0.5))
    done = golden("check")
    assert done.code == 1
    assert "quick-search-training-seed-3: method changed; generation 0: " in done.out


def test_stages(here, golden):
    assert golden("add", "tiny.yaml", "--train", *SHORT, "--stages", "alone").code == 0
    log = open_training(here / "recordings" / "golden" / "tiny-paper-training.mcap")
    assert {line.scenario for line in log.lines} == {0, 1}
    assert golden("check").code == 0


def test_a_plain_training_log_is_trained_as_recorded(here, golden, other_default):
    settings = {"n_episodes_max": 2}
    train("tiny.yaml", set=settings, record="plain.mcap")
    assert "plain.txt: expected the text of this recording" in golden("check", ".").out
    assert golden("update", "--dir", ".", "--reason", "Kept from now on.").code == 0
    other_default(alpha=0.1)
    (here / "tiny.yaml").unlink()
    assert golden("check", ".").code == 0, "its settings and its curriculum are in it"


def test_a_curriculum_that_is_gone(kept, here, golden):
    (here / "tiny.yaml").unlink()
    done = golden("check")
    assert done.code == 2
    assert "tiny.yaml: expected a curriculum file" in done.out


def test_a_spec_that_is_none(kept, here, golden):
    log = open_training(kept / "tiny.mcap")
    header = dataclasses.replace(log.header, attachments={**log.header.attachments, "golden.json": b'{"seed": -1}'})
    trainer = log.trainer()
    with TrainingWriter(here / "odd.mcap", trainer, header=header) as writer:
        for _ in trainer:
            writer.write()
        writer.close()
    done = golden("check", ".")
    assert done.code == 2
    assert "odd: golden.json: " in done.out


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("add", "quick"), "Missing option '--policy' or '--train'"),
        (("add", "quick", "--train", "--policy", "chief"), "--policy and --train exclude each other"),
        (("add", "quick", "--train", "--steps", 3), "--steps is for a run"),
        (("add", "quick", "--policy", "chief", "--stages", "alone"), "--stages is for a training"),
        (("add", "quack", "--train"), "quack: expected a curriculum file"),
        (("add", "quick", "--train", "--method", "magic"), "--method: expected one of"),
        (("add", "quick", "--train", "--set", "beta=1"), "--set: beta: expected one of"),
        (("add", "tiny.yaml", "--train", "--stages", "later"), "--stages: expected stages of tiny"),
        (("add", "quick", "--train", "--name", "../up"), "name: expected letters, digits"),
    ],
)
def test_complaints(here, golden, words, complaint):
    before = sorted(contents(here))
    done = golden(*words)
    assert (done.code, done.out) == (2, "")
    assert complaint in done.err
    assert sorted(contents(here)) == before


def test_ctrl_c_leaves_nothing(here, golden, monkeypatch):
    def interrupted(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(TrainingWriter, "write", interrupted)
    assert golden(*ADD).code == 130
    assert contents(here / "recordings" / "golden") == {}


def test_in_python(here, other_default):
    settings = {"n_episodes_max": 3, "shared_table": True}
    path = add_training("tiny.yaml", settings=settings, stages=["together"], folder=here / "kept")
    assert path == here / "kept" / "tiny-paper-training.mcap"
    assert [one.result for one in check_goldens(here / "kept")] == ["same"]
    with pytest.raises(OutputError, match="an existing golden"):
        add_training("tiny.yaml", folder=here / "kept")
    with pytest.raises(TrainingError, match="n_episodes_max"):
        add_training("tiny.yaml", settings={"n_episodes_max": 0}, name="none", folder=here / "kept")
    other_default(alpha=0.6)
    (result,) = check_goldens(here / "kept")
    assert repr(result) == f"<GoldenResult tiny-paper-training: different, {result.sentence}>"
    (update,) = update_goldens(here / "kept", reason="More slowly.")
    assert (update.done, update.sentence) == ("recording", result.sentence)
    with pytest.raises(LogError, match=r"golden\.json: curriculum: expected a name or a file"):
        prepare_training(TrainingSpec(curriculum=""), here)


def test_stored_only_if_changed(kept):
    path = kept / "tiny.mcap"
    spec = training_spec_of(open_training(path).header)
    assert not store_if_changed(path, prepare_training(spec, kept))
    (kept / "tiny.txt").unlink()
    assert not store_if_changed(path, prepare_training(spec, kept))
    assert (kept / "tiny.txt").is_file()
    assert store_if_changed(path, prepare_training(TrainingSpec(curriculum="quick", settings=spec.settings), kept))
    assert [scenario.name for scenario in open_training(path).scenarios] == ["quick"]


def test_of_two_that_add_one_golden_one_does(here, golden, monkeypatch):
    """As for runs: what another has added meanwhile is not replaced."""
    folder = here / "recordings" / "golden"
    close = TrainingWriter.close

    def late(self):
        (folder / "tiny.mcap").write_bytes(b"of another")
        close(self)

    monkeypatch.setattr(TrainingWriter, "close", late)
    done = golden(*ADD)
    assert done.code == 2
    assert "tiny.mcap: expected a name that is free, got an existing file" in done.err
    assert contents(folder) == {"tiny.mcap": b"of another"}
