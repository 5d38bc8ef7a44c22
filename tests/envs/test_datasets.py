"""Datasets: what learners saw, did and got, written, and loaded back to the last bit."""

from __future__ import annotations

import json
import os
import shutil
from importlib.util import find_spec

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import fireworld as fw
from fireworld import envs
from fireworld.arguments import ArgumentError
from fireworld.envs.datasets.recorded import recorded
from fireworld.envs.datasets.trajectory import Shape, trajectory_of
from fireworld.errors import FireworldError, LibraryError, LogError, OutputError
from fireworld.policy.words import FEATURES
from tests.envs.played import chosen, play, play_with_forks
from tests.envs.towns import HOT, LATER, SMALL, deadly

needs_minari = pytest.mark.skipif(
    any(find_spec(name) is None for name in ("minari", "gymnasium")), reason="pip install 'fireworld[minari]'"
)
ignores_warnings = pytest.mark.filterwarnings("ignore")


@pytest.fixture(autouse=True)
def minari_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
    return tmp_path / "minari"


@pytest.fixture
def logs(tmp_path):
    """A run of a policy without values, one with values and targets of its own, and what a learner played."""
    for policy in ("easiest", "best"):
        fw.run(SMALL, policy=policy, seed=3, record=tmp_path / f"{policy}.mcap")
    play(tmp_path / "a.mcap", own_targets=4)
    return [tmp_path / name for name in ("easiest.mcap", "best.mcap", "a.mcap")]


@pytest.mark.parametrize("observation", ["features", "targets"])
def test_a_trajectory_is_what_the_learner_saw_and_got(tmp_path, observation):
    options = {"own_targets": 3, "observation": observation, "reward": "change"}
    worlds = envs.worlds(SMALL, 1, seeds=4, record=tmp_path / "a.mcap", **options)
    seen, rewards, actions = [worlds.reset()], [], []
    for step in range(60):
        actions.append(chosen(seen[-1], step))
        done = worlds.step(actions[-1])
        seen.append(done.observation)
        rewards.append(done.reward[0])
        if done.terminated[0] or done.truncated[0]:
            break
    worlds.close()
    (episode,) = recorded(tmp_path / "a.mcap")
    found = trajectory_of(episode, Shape(observation, "scenario", 3))
    assert found.seen.keys() == seen[0].keys()
    for name in seen[0]:
        np.testing.assert_array_equal(found.seen[name], np.concatenate([one[name] for one in seen]))
    assert found.reward.tolist() == rewards
    given = np.concatenate(actions)
    np.testing.assert_array_equal(found.action[found.decides], given[found.decides])
    assert found.state_digest == worlds.world(0).digest()


@pytest.mark.parametrize("choices", ["in-turn", "simultaneous"])
@pytest.mark.parametrize("policy", ["best", "random", "paper-cooperative"])
def test_a_trajectory_of_a_run_is_what_is_recorded(tmp_path, policy, choices):
    run = fw.run(LATER, policy=policy, seed=2, set={"choices": choices})
    (episode,) = recorded(run)
    found = trajectory_of(episode, Shape("features", "scenario", 64))
    steps = [*run][1:]
    recorded_features = np.stack([[getattr(step.observations, one.name) for one in FEATURES] for step in steps])
    np.testing.assert_array_equal(found.seen["features"][:-1], np.moveaxis(recorded_features, 1, 2))
    assert found.reward.tolist() == [step.rewards.total for step in steps]
    decided = np.stack([step.decisions.action for step in steps])
    np.testing.assert_array_equal(found.decides, decided >= 0)
    assert found.score.tolist() == [step.score.score for step in run]


def test_rows(logs, tmp_path):
    n_rows = fw.export_rlds(logs, tmp_path / "d")
    steps, episodes = (pq.read_table(tmp_path / "d" / f"{name}.parquet").to_pydict() for name in ("steps", "episodes"))
    n = sum(k * (t + 1) for k, t in zip(episodes["n_brigades"], episodes["n_steps"], strict=True))
    assert n_rows == {"steps": n, "episodes": len(episodes["seed"]), "scenarios": 3}
    assert sum(steps["is_first"]) == sum(steps["is_last"]) == sum(episodes["n_brigades"])
    ended = sum(b for b, end in zip(episodes["n_brigades"], episodes["terminated"], strict=True) if end)
    assert sum(steps["is_terminal"]) == ended > 0
    assert [one for one in steps["discount"] if one != 1.0] == [0.0] * ended
    assert set(steps["digest"]) == set(episodes["digest"])
    for number, total in enumerate(episodes["total_reward"]):
        rewards = [
            reward
            for reward, episode, brigade in zip(steps["reward"], steps["episode"], steps["brigade"], strict=True)
            if (episode, brigade) == (number, 0)
        ]
        assert sum(rewards) == total
    masks = np.array(steps["action_mask"])
    assert masks.shape[1] == 68  # `best` names targets of its own
    assert masks[np.arange(n), steps["action"]].all()
    metadata = pq.read_schema(tmp_path / "d" / "steps.parquet").metadata
    assert metadata[b"fireworld.format"] == b"fireworld-rlds/1"
    assert [one["name"] for one in json.loads(metadata[b"fireworld.origin"])["logs"]] == [path.name for path in logs]


FORMS = [
    "parquet",
    pytest.param("minari", marks=[needs_minari, ignores_warnings, pytest.mark.slow]),
]


def written(form, logs, tmp_path, **options):
    """Write a dataset; return what loads it."""
    if form == "parquet":
        fw.export_rlds(logs, tmp_path / "dataset", **options)
        return tmp_path / "dataset"
    fw.export_minari(logs, "fireworld/test/mine-v0", **options)
    return "fireworld/test/mine-v0"


@pytest.mark.parametrize("form", FORMS)
def test_datasets_are_loaded_back_bit_for_bit(form, logs, tmp_path):
    dataset = fw.load_dataset(written(form, logs, tmp_path))
    assert dataset.shape == {"observation": "features", "reward": "score", "own_targets": 64}
    assert len(dataset) == 2 + len(fw.open_training(logs[2]))
    assert "episodes" in repr(dataset)
    for number, facts in enumerate(dataset.facts):
        digest = dataset.replay(number, tmp_path / "run.mcap", force=True)
        run = fw.open_log(tmp_path / "run.mcap")
        assert fw.verify(run)
        assert run.digest == digest == dataset.run(number).digest
        if number < 2:
            assert facts.run_digest == digest
        else:
            assert digest == fw.open_episode(logs[2], number - 2).digest
    assert dataset.run(0).digest == fw.open_log(logs[0]).digest  # of a policy that gives no values the very same run
    assert dataset[-1].action.shape == (dataset.facts[-1].n_steps, dataset.facts[-1].n_brigades)
    with pytest.raises(fw.FireworldError, match="number: expected"):
        dataset[len(dataset)]


@pytest.mark.parametrize("form", FORMS)
def test_forks_and_files_of_cities(form, tmp_path):
    forks = play_with_forks(tmp_path / "forks.mcap")
    cities = play(tmp_path / "cities.mcap", scenarios=[deadly(tmp_path)], n=1, n_steps=40)
    (tmp_path / "deadly.json").unlink()
    dataset = fw.load_dataset(written(form, [forks, cities], tmp_path))
    for number in range(len(dataset)):
        assert fw.verify(dataset.run(number))
    assert {facts.first_step for facts in dataset.facts} >= {0, 8, 14}


@pytest.mark.parametrize("form", FORMS)
def test_what_was_changed_in_a_dataset_is_found(form, tmp_path, minari_folder):
    play(tmp_path / "a.mcap", n=1, n_steps=40)
    dataset = fw.load_dataset(written(form, tmp_path / "a.mcap", tmp_path))
    facts = dataset.facts[0]
    dataset.facts[0] = type(facts)(
        **{name: getattr(facts, name) for name in facts.__struct_fields__} | {"digest": "0" * 64}
    )
    with pytest.raises(LogError, match="episode 0: digest: expected 0000"):
        dataset.replay(0, tmp_path / "run.mcap")
    assert not (tmp_path / "run.mcap").exists()


def test_a_row_that_was_changed_is_found(tmp_path):
    play(tmp_path / "a.mcap", n=1, n_steps=40)
    fw.export_rlds(tmp_path / "a.mcap", tmp_path / "d")
    path = tmp_path / "d" / "steps.parquet"
    table = pq.read_table(path)
    action = np.where(table["decides"].to_numpy(), (table["action"].to_numpy() + 2) % 4, 0)
    changed = table.set_column(table.column_names.index("action"), "action", pa.array(action))
    pq.write_table(changed, path)
    with pytest.raises(LogError, match="episode 0"):
        fw.load_dataset(tmp_path / "d").run(0)


def test_episodes_in_unknown_states_are_left_out(tmp_path, fireworld):
    plain = envs.worlds(HOT, 1, seeds=1)
    plain.step(chosen(plain.reset(), 0))
    worlds = envs.worlds(HOT, 1, seeds=1, record=tmp_path / "a.mcap", steps=4)
    seen = worlds.restore(plain.snapshot())
    worlds.step(chosen(seen, 1))
    seen = worlds.reset()
    worlds.step(chosen(seen, 2))
    worlds.close()
    done = fireworld("export", tmp_path / "a.mcap", "--rlds", tmp_path / "d")
    assert done.code == 0
    assert "1 episodes began in states that nobody knows, and are left out" in done.err
    assert len(fw.load_dataset(tmp_path / "d")) == 1


def test_the_command(logs, tmp_path, fireworld):
    done = fireworld("export", *logs, "--rlds", tmp_path / "d", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert (found["own_targets"], found["reward"], found["n_unknown"]) == (64, "score", 0)
    done = fireworld("export", logs[2], "--rlds", tmp_path / "d", "--observation", "targets", "--force")
    assert done.code == 0
    assert f"{tmp_path / 'd'}: " in done.out
    assert fw.load_dataset(tmp_path / "d").shape["observation"] == "targets"
    for words, text in [
        ((logs[0],), "Give one of --parquet, --csv, --jsonl, --rlds and --minari"),
        ((logs[0], logs[1], "--parquet", "x"), "--parquet takes one LOG"),
        ((logs[0], "--parquet", "x", "--reward", "score"), "--parquet takes one LOG"),
        ((logs[0], "--rlds", "x", "--tables", "steps"), "--tables goes with --parquet"),
        ((logs[0], "--rlds", tmp_path / "d"), "expected a name that is free or an empty folder"),
        ((logs[2], "--rlds", tmp_path / "e", "--own-targets", 1), "try more own targets"),
        ((tmp_path / "none.mcap", "--rlds", tmp_path / "e"), "cannot be read"),
    ]:
        done = fireworld("export", *words)
        assert done.code == 2, words
        assert text in done.err
    assert not (tmp_path / "e").exists()


def test_what_makes_no_dataset(tmp_path):
    fw.train("quick", set={"n_episodes_max": 2}, record=tmp_path / "t.mcap")
    with pytest.raises(LogError, match=r"expected a run, or what a learner played.*fireworld replay"):
        fw.export_rlds(tmp_path / "t.mcap", tmp_path / "d")
    for name in (tmp_path / "none", tmp_path):
        with pytest.raises(LogError, match=r"expected a folder with steps\.parquet, or a dataset of Minari"):
            fw.load_dataset(name)
    with pytest.raises(ArgumentError, match="observation: expected one of features, targets, got 'graph'"):
        fw.export_rlds(play(tmp_path / "a.mcap", n_steps=20), tmp_path / "d", observation="graph")
    assert not (tmp_path / "d").exists()


def test_a_folder_of_any_name(tmp_path):
    folder = tmp_path / os.fsdecode(b"\xff\xfe")
    fw.export_rlds(play(tmp_path / "a.mcap", n=1, n_steps=20), folder)
    assert fw.verify(fw.load_dataset(folder).run(0))


def test_damaged_files_are_a_line(logs, tmp_path):
    fw.export_rlds(logs[2], tmp_path / "d")
    random = np.random.default_rng(1)
    for name in ("steps", "episodes", "scenarios"):
        whole = (tmp_path / "d" / f"{name}.parquet").read_bytes()
        for _ in range(12):
            data = bytearray(whole)
            data[random.integers(len(data))] ^= 1 << int(random.integers(8))
            (tmp_path / "d" / f"{name}.parquet").write_bytes(
                data[: int(random.integers(len(data) // 2, len(data) + 1))]
            )
            try:
                fw.load_dataset(tmp_path / "d").run(0)
            except FireworldError as error:
                assert str(error).isprintable()  # noqa: PT017 - not every byte matters
        (tmp_path / "d" / f"{name}.parquet").write_bytes(whole)
    assert fw.verify(fw.load_dataset(tmp_path / "d").run(0))


@needs_minari
@ignores_warnings
@pytest.mark.slow
def test_minari_makes_the_environment_again_and_it_goes_the_same_way(tmp_path, minari_folder):
    import minari

    play(tmp_path / "a.mcap", scenarios=[SMALL], own_targets=3)
    folder = fw.export_minari(tmp_path / "a.mcap", "fireworld/small/random-v0")
    assert folder == minari_folder / "fireworld" / "small" / "random-v0"
    assert [*minari.list_local_datasets()] == ["fireworld/small/random-v0"]
    dataset = minari.load_dataset("fireworld/small/random-v0")
    env = dataset.recover_environment()
    assert dataset.observation_space == env.observation_space
    assert dataset.action_space == env.action_space
    for number in range(len(dataset)):
        episode, (metadata,) = dataset[number], dataset.storage.get_episode_metadata([number])
        seen, info = env.reset(options=metadata["options"])
        assert info["seed"] == metadata["fireworld"]["seed"]
        for step in range(len(episode.rewards)):
            assert all(np.array_equal(seen[name], episode.observations[name][step]) for name in seen)
            assert all(dataset.observation_space[name].contains(seen[name]) for name in seen)
            seen, reward, terminated, truncated, _ = env.step(episode.actions[step])
            assert reward == episode.rewards[step]
            assert (terminated, truncated) == (episode.terminations[step], episode.truncations[step])
    env.close()
    assert fw.verify(fw.load_dataset(folder).run(0))
    with pytest.raises(OutputError, match="expected a name that is free"):
        fw.export_minari(tmp_path / "a.mcap", "fireworld/small/random-v0")
    with pytest.raises(ArgumentError, match="expected the name of a dataset, as in fireworld/quick/random-v0"):
        fw.export_minari(tmp_path / "a.mcap", "no version")


@needs_minari
@ignores_warnings
@pytest.mark.slow
def test_a_dataset_of_minari_that_fails_leaves_nothing(tmp_path, minari_folder, monkeypatch):
    from fireworld.envs.datasets import minari_form

    play(tmp_path / "a.mcap", n=1, n_steps=30)

    def fails(*_):
        raise LogError("x")

    monkeypatch.setattr(minari_form, "trajectory_of", fails)
    with pytest.raises(LogError):
        fw.export_minari(tmp_path / "a.mcap", "fireworld/small/random-v0")
    assert not [*minari_folder.rglob("*")]


def test_what_is_missing_is_named(tmp_path, monkeypatch):
    from fireworld.envs.datasets import minari_form

    monkeypatch.setattr(minari_form, "find_spec", lambda _: None)
    with pytest.raises(LibraryError, match=r"minari is not installed; try pip install 'fireworld\[minari\]'"):
        fw.export_minari(tmp_path / "a.mcap", "fireworld/small/random-v0")
    shutil.rmtree(tmp_path / "minari", ignore_errors=True)
