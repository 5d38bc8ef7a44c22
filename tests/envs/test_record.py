"""Episodes that learners play, recorded: each can be played again, whatever was done with the worlds meanwhile."""

from __future__ import annotations

import copy
import json
import os
import shutil
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

import fireworld as fw
from fireworld import envs
from fireworld.errors import LogError, OutputError
from fireworld.training.log.played import NOTHING, OWN
from fireworld.training.seeds import Seeds
from tests.envs.played import chosen, play, play_with_forks
from tests.envs.towns import HOT, LATER, SMALL, deadly, pickled

OPTIONS = {
    "plain": {},
    "own targets": {"own_targets": 5, "observation": "targets"},
    "same step": {"autoreset": "same-step", "reward": "change", "seeds": Seeds(7, test=True)},
    "fewer steps": {"steps": 9, "reward": "stock", "first_worker": 30},
    "threads": {"threads": 2, "n": 5, "observation": "graph"},
}


@pytest.mark.parametrize("options", OPTIONS.values(), ids=[*OPTIONS])
def test_every_episode_is_recorded_as_it_went(tmp_path, options):
    path = play(tmp_path / "a.mcap", **options)
    log = fw.open_training(path)
    assert log.state == "complete"
    verified = fw.verify(path)
    assert verified, verified
    method = log.method.as_dict()
    assert {name: method[name] for name in options if name in method and name != "n"} == {
        name: value for name, value in options.items() if name in method and name != "n"
    }
    places = [(line.world, line.episode) for line in log.lines]
    assert len(set(places)) == len(places)
    first = options.get("first_worker", 0)
    assert {world for world, _ in places} == {*range(first, first + options.get("n", 3))}
    for line in log.lines:
        assert line.scenario == (line.world - first + line.episode) % 2
        seeds = options.get("seeds", Seeds(4))
        assert line.seed == seeds.seed(line.world, line.episode)
        assert line.seed_given is False
    assert {line.left for line in log.lines[-options.get("n", 3) :]} >= {True}


def test_what_is_recorded_is_what_learners_got(tmp_path):
    """Returns and ends as the steps have returned them, episode by episode."""
    worlds = envs.worlds([SMALL, LATER], 4, record=tmp_path / "a.mcap", own_targets=3, seeds=3)
    seen, total, known = worlds.reset(), np.zeros(4), []
    for step in range(80):
        actions = chosen(seen, step)
        done = worlds.step(actions)
        seen, info = done.observation, done.info
        total += done.reward
        for index in np.flatnonzero(done.terminated | done.truncated).tolist():
            known.append(
                (index, int(info["episode_number"][index]), int(info["seed"][index]), int(info["step"][index]),
                 bool(done.terminated[index]), float(total[index]), float(info["score"][index]),
                 int(info["n_burnt_out"][index]), int(info["n_civilians_alive"][index]))
            )  # fmt: skip
            total[index] = 0.0
    worlds.close()
    lines = [line for line in fw.open_training(tmp_path / "a.mcap").lines if not line.left]
    assert known == [
        (line.world, line.episode, line.seed, line.n_steps, line.terminated, line.total_reward, line.score,
         line.n_burnt_out, line.n_civilians_alive)
        for line in lines
    ]  # fmt: skip
    assert len(known) > 4
    assert {line.terminated for line in lines} == {True, False}


def test_actions_are_recorded_with_what_they_came_to(tmp_path):
    log = fw.open_training(play(tmp_path / "a.mcap", own_targets=4))
    actions = {int(action) for part in log.parts() for action in part[type(log.lines[0])].action}
    assert actions == {0, 1, 2, 3, OWN, NOTHING}
    episode = log.played_at(0)
    assert episode.decided.action.shape == (log.lines[0].n_steps, log.scenarios[log.lines[0].scenario].brigades.n)
    assert ((episode.decided.target >= 0) == (episode.decided.action == OWN)).all()


def test_forks_and_snapshots_are_played_again_from_the_start(tmp_path):
    path = play_with_forks(tmp_path / "a.mcap")
    log = fw.open_training(path)
    assert fw.verify(path)
    lines = log.lines
    assert all(line.replayable and line.left for line in lines)
    found = {(line.world, line.first_step, line.n_steps, line.seed_given) for line in lines}
    assert found >= {(1, 0, 8, False), (1, 8, 10, True), (2, 8, 10, True), (0, 14, 4, True), (1, 0, 4, True)}
    (forked,) = [k for k, line in enumerate(lines) if (line.world, line.first_step) == (0, 14)]
    assert list(log.played_at(forked).record.seeds) == [0, 8, 14]
    assert [*log.played_at(forked).record.seeds.values()][1:] == [77, 5]
    fw.replay_episode(log, None, forked, tmp_path / "run.mcap")
    assert fw.verify(tmp_path / "run.mcap")
    with pytest.raises(LogError, match="expected a run of one seed"):
        fw.fork(tmp_path / "run.mcap", at=3)
    again = fw.open_episode(log, forked)
    assert again.outcome.score == lines[forked].score
    assert len(again) == 19


def test_a_snapshot_of_worlds_that_are_not_recorded_has_no_past(tmp_path):
    plain = envs.worlds(HOT, 2, seeds=1)
    seen = plain.reset()
    for step in range(5):
        seen = plain.step(chosen(seen, step)).observation
    worlds = envs.worlds(HOT, 2, seeds=1, record=tmp_path / "a.mcap")
    seen = worlds.restore(plain.snapshot())
    digest = plain.world(0).digest()
    for step in range(3):
        seen = worlds.step(chosen(seen, step)).observation
    worlds.close()
    log = fw.open_training(tmp_path / "a.mcap")
    assert [line.replayable for line in log.lines] == [False, False]
    assert log.lines[0].state.hex() == digest
    verified = fw.verify(tmp_path / "a.mcap")
    assert verified
    assert verified.n_unknown == 2
    assert "2 that began in unknown states were not played again" in repr(verified)
    with pytest.raises(LogError, match="began in an unknown state after step 5"):
        fw.open_episode(log, 0)
    assert log.played_at(0).decided.action.shape == (3, 2)


def test_worlds_forget_no_past_over_long(tmp_path):
    """More steps than are held as they were noted."""
    worlds = envs.worlds(HOT, 2, seeds=1, record=tmp_path / "a.mcap", steps=25)
    seen = worlds.reset()
    for step in range(1100):
        seen = worlds.step(chosen(seen, step)).observation
    worlds.close()
    assert len(fw.open_training(tmp_path / "a.mcap")) > 80
    assert fw.verify(tmp_path / "a.mcap")


def test_a_step_that_was_interrupted_is_not_made_up(tmp_path, monkeypatch):
    worlds = envs.worlds(HOT, 2, seeds=1, record=tmp_path / "a.mcap")
    seen = worlds.reset()
    seen = worlds.step(chosen(seen, 0)).observation

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(type(worlds._recorder), "ran", interrupted)
        with pytest.raises(KeyboardInterrupt):
            worlds.step(chosen(seen, 1))
    for step in range(2, 5):
        worlds.step(chosen(worlds.observe(), step))
    worlds.close()
    log = fw.open_training(tmp_path / "a.mcap")
    assert [(line.first_step, line.n_steps, line.replayable) for line in log.lines] == [(3, 2, False)] * 2


def test_a_reward_that_fails_loses_no_step(tmp_path):
    calls = []

    def reward(result, before):
        calls.append(1)
        if len(calls) == 3:
            raise ValueError("x")
        return result.score[:, 0] - before

    worlds = envs.worlds(HOT, 2, seeds=1, record=tmp_path / "a.mcap", reward=reward)
    seen = worlds.reset()
    for step in range(6):
        try:
            seen = worlds.step(chosen(seen, step)).observation
        except ValueError:
            seen = worlds.observe()
    worlds.close()
    assert [line.n_steps for line in fw.open_training(tmp_path / "a.mcap").lines] == [6, 6]
    assert fw.verify(tmp_path / "a.mcap")


def test_copies_do_not_record(tmp_path):
    worlds = envs.worlds(HOT, 2, record=tmp_path / "a.mcap")
    seen = worlds.reset()
    for made in (copy.deepcopy(worlds), pickled(worlds)):
        made.step(chosen(seen, 0))
        made.close()
    assert (tmp_path / "a.mcap.partial").exists()
    worlds.step(chosen(seen, 0))
    worlds.close()
    worlds.close()
    assert len(fw.open_training(tmp_path / "a.mcap")) == 2


def test_worlds_that_nobody_closes_are_closed_at_last(tmp_path):
    worlds = envs.worlds(HOT, 2, record=tmp_path / "a.mcap")
    worlds.step(chosen(worlds.reset(), 0))
    del worlds
    assert len(fw.open_training(tmp_path / "a.mcap")) == 2


def test_worlds_whose_folder_is_gone_say_so_at_last(tmp_path, capsys):
    (tmp_path / "runs").mkdir()
    worlds = envs.worlds(HOT, 2, record=tmp_path / "runs")
    worlds.step(chosen(worlds.reset(), 0))
    shutil.rmtree(tmp_path / "runs")
    del worlds
    assert capsys.readouterr().err.startswith(f"fireworld: {tmp_path / 'runs'}")


def test_a_folder_holds_many_logs(tmp_path):
    many = [envs.worlds(HOT, 1, record=f"{tmp_path}/") for _ in range(3)]
    for worlds in many:
        worlds.step(chosen(worlds.reset(), 0))
    for worlds in many:
        worlds.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"episodes-{k}.mcap" for k in (1, 2, 3)]


def test_mistakes_are_a_line(tmp_path):
    for record, text in [
        (tmp_path / "a.txt", "a.txt: expected a file ending in .mcap, got '.txt'"),
        (f"{tmp_path}/none/", "none: expected an existing folder, got 'none'; make it first"),
        (tmp_path / "none" / "a.mcap", "a.mcap: expected an existing folder .*none"),
        ("", "record: expected the path of a file"),
    ]:
        with pytest.raises(fw.FireworldError, match=text):
            envs.worlds(HOT, 1, record=record)
    (tmp_path / "a.mcap").write_text("mine")
    with pytest.raises(OutputError, match=r"a\.mcap: expected a name that is free.*a folder as record"):
        envs.worlds(HOT, 1, record=tmp_path / "a.mcap")
    assert (tmp_path / "a.mcap").read_text() == "mine"


def test_a_full_disk_is_a_line_each_time(tmp_path, monkeypatch):
    worlds = envs.worlds(HOT, 1, record=tmp_path / "a.mcap", steps=2)
    seen = worlds.reset()
    seen = worlds.step(chosen(seen, 0)).observation

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(worlds._recorder._writer._file._writer, "write_chunk", full)
    with pytest.raises(OutputError, match="no space is left on the disk"):
        worlds.step(chosen(seen, 1))
    worlds.reset()
    worlds.step(chosen(worlds.observe(), 2))
    with pytest.raises(OutputError, match="no space is left on the disk"):
        worlds.step(chosen(worlds.observe(), 3))
    worlds.close()


def test_snapshots_that_make_no_sense_are_refused(tmp_path):
    """What a snapshot says was done goes into a log: it is looked at first."""
    import io

    worlds = envs.worlds(HOT, 2, record=tmp_path / "a.mcap")
    seen = worlds.reset()
    for step in range(4):
        seen = worlds.step(chosen(seen, step)).observation
    with np.load(io.BytesIO(worlds.snapshot())) as held:
        arrays = {name: held[name] for name in held.files}

    def changed(**values):
        data = io.BytesIO()
        np.savez(data, **{**arrays, **{name: change(arrays[name]) for name, change in values.items()}})
        return data.getvalue()

    worlds.restore(changed())
    for values in [
        {"played_action": lambda array: array + 9},
        {"played_action": lambda array: array[:, :2]},
        {"played_target": lambda array: array.astype(np.int64)},
        {"played_known": lambda array: array[:1]},
        {"played_seeds": lambda array: array[:, :2]},
        {"played_seeds": lambda array: array - 5},
        {"played_seeds": lambda array: np.concatenate((array, array))},
        {"played_seeds": lambda array: array[:1]},
    ]:
        with pytest.raises(LogError, match="snapshot"):
            worlds.restore(changed(**values))
    worlds.step(chosen(worlds.observe(), 5))
    worlds.close()
    assert fw.verify(tmp_path / "a.mcap")


def test_dead_brigades_and_cities_of_files(tmp_path):
    scenario = deadly(tmp_path)
    path = play(tmp_path / "a.mcap", scenarios=[scenario], n=2, n_steps=40)
    (tmp_path / "deadly.json").unlink()  # the log has it
    log = fw.open_training(path)
    assert fw.verify(path)
    assert [name for name in log.header.attachments if name.startswith("cities/")]
    fw.replay_episode(log, "deadly", 0, tmp_path / "run.mcap")
    assert fw.verify(tmp_path / "run.mcap")


def test_a_function_of_ones_own_rewards(tmp_path):
    path = play(tmp_path / "a.mcap", reward=lambda result, before: result.score[:, 0] - before)
    log = fw.open_training(path)
    assert log.method.reward == "function"
    assert fw.verify(path)


KILLED = """
    import os, signal, sys
    import numpy as np
    from fireworld import envs
    from tests.envs.played import chosen
    from tests.envs.towns import SMALL

    worlds = envs.worlds(SMALL, 4, record="runs/", first_worker=int(sys.argv[1]), seeds=5)
    seen = worlds.reset()
    for step in range(10**9):
        seen = worlds.step(chosen(seen, step)).observation
        if step == 60:
            print("60 steps", flush=True)
"""


@pytest.mark.slow
def test_a_learner_that_is_killed_leaves_episodes_that_replay(tmp_path):
    """Several processes record to one folder; each is killed at any moment, and loses only what is under way."""
    (tmp_path / "runs").mkdir()
    words = [sys.executable, "-c", textwrap.dedent(KILLED)]
    surroundings = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    learners = [
        subprocess.Popen([*words, str(4 * k)], cwd=tmp_path, env=surroundings, stdout=subprocess.PIPE) for k in range(2)
    ]
    for learner in learners:
        learner.stdout.readline()
    time.sleep(0.3)
    for learner in learners:
        learner.send_signal(signal.SIGKILL)
        learner.communicate()
    logs = sorted((tmp_path / "runs").iterdir())
    assert [path.name for path in logs] == ["episodes-1.mcap.partial", "episodes-2.mcap.partial"]
    worlds = set()
    for path in logs:
        log = fw.open_training(path, partial=True)
        assert log.state == "partial"
        assert len(log) > 4
        assert not any(line.left for line in log.lines)
        worlds |= {line.world for line in log.lines}
        good = tmp_path / path.name.removesuffix(".partial")
        assert fw.recover(path, good).n_steps == len(log)
        assert fw.verify(good)
        fw.replay_episode(path, None, -1, tmp_path / "run.mcap", force=True)
        assert fw.verify(tmp_path / "run.mcap")
    assert len(worlds) == 8


def test_a_forked_process_does_not_write(tmp_path):
    worlds = envs.worlds(HOT, 1, record=tmp_path / "a.mcap", steps=2)
    seen = worlds.reset()
    seen = worlds.step(chosen(seen, 0)).observation
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            worlds.step(chosen(seen, 1))
        except OutputError as error:
            os.write(write, str(error).encode())
        finally:
            worlds.close()
            os._exit(0)
    os.waitpid(child, 0)
    assert "expected the process that made the worlds" in os.read(read, 1000).decode()
    worlds.step(chosen(seen, 1))
    worlds.close()
    assert len(fw.open_training(tmp_path / "a.mcap")) == 1
    assert fw.verify(tmp_path / "a.mcap")
    assert json.loads(fw.open_training(tmp_path / "a.mcap").header.attachments["method.json"])["n_worlds"] == 1
