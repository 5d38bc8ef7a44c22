"""Any episode of a training as the log of a run: replayed, compared, verified, forked."""

import dataclasses

import numpy as np
import pytest
from fireworld_recorder.writer import LogWriter

import fireworld as fw
from fireworld.errors import LogError, OutputError, PolicyError, TrainingError
from fireworld.records import CHOICES
from fireworld.training.log import episode_run
from fireworld.training.log.reader import open_training
from fireworld.training.log.replay import replay_episode, replay_every
from fireworld.training.train import train
from tests.training.log.conftest import SHORT
from tests.training.log.test_log import VARIANTS


@pytest.mark.parametrize("settings", VARIANTS, ids=str)
def test_an_episode_is_replayed_with_all_that_was_learned(make_log, tmp_path, settings):
    log = open_training(make_log(**settings))
    for number in (0, len(log) // 2, len(log) - 1):
        found = log.episode_at(number)
        record = found.record
        path = tmp_path / f"{number}.mcap"
        digest = replay_episode(log, record.scenario, record.episode, path)
        run = fw.open_log(path)
        assert run.digest == digest
        assert len(run) == record.n_steps + 1
        assert run.outcome.score == record.score
        assert run.outcome.total_reward == record.total_reward
        assert bool(fw.verify(path))
        check_decisions(run, found)


def check_decisions(run, found):
    """Compare the decisions of a run with those of the episode."""
    errors = np.zeros(len(found.state))
    for row, step in enumerate(run):
        if row == 0:
            continue
        made, column = step.decisions, row - 1
        how = found.choice[:, column]
        chose = how > 0
        np.testing.assert_array_equal(made.action, np.where(chose, found.action[:, column].astype(int), -1))
        np.testing.assert_array_equal(made.explored.astype(bool), how == CHOICES.index("explored"))
        updated = ~np.isnan(found.td_error[:, column])
        errors[updated] = found.td_error[updated, column]
        np.testing.assert_array_equal(made.td_error, errors)
        looked = np.isin(how, [CHOICES.index("greedy"), CHOICES.index("explored")])
        if looked.any():
            assert made.epsilon == found.record.epsilon
        values = made.q_values.reshape(-1, 4) if len(made.q_values) else np.zeros((len(how), 4))
        greedy = how == CHOICES.index("greedy")
        np.testing.assert_array_equal(values[greedy].argmax(axis=1), made.action[greedy])
        assert step.observations.state_index[looked].tolist() == found.state[looked, column].tolist()


def test_whole_episodes_are_written_at_once_as_replay_writes_them(curriculum, make_log, tmp_path):
    made, again = tmp_path / "made", tmp_path / "again"
    made.mkdir()
    again.mkdir()
    train(curriculum, set=SHORT, output=tmp_path / "t.npz", record=made, full_every=3)
    assert (made / "training.mcap").read_bytes() == make_log().read_bytes()
    written = replay_every(make_log(), 3, again)
    names = sorted(path.name for path in again.iterdir())
    assert names[:2] == ["alone-1-0000.mcap", "alone-1-0003.mcap"]
    assert sorted(path.name for path in made.iterdir()) == [*names, "training.mcap"]
    assert {path.name for path in written} == set(names)
    for name in names:
        assert (made / name).read_bytes() == (again / name).read_bytes()


def test_an_episode_that_comes_out_otherwise_is_not_written(make_log, tmp_path, monkeypatch):
    log = open_training(make_log())
    take = episode_run.take_reward
    monkeypatch.setattr(episode_run, "take_reward", lambda reward, learner: take(2 * reward, learner))
    n_refused = 0
    for number, line in enumerate(log.lines):
        path = tmp_path / f"{number}.mcap"
        try:
            replay_episode(log, line.scenario, line.episode, path)
        except LogError as error:
            assert "this fireworld learns otherwise" in str(error)  # noqa: PT017 - not every episode comes out otherwise
            n_refused += 1
            assert not [*tmp_path.glob(f"{number}.*")]
    assert n_refused > 0


def test_verify_finds_what_was_learned_otherwise(make_log, tmp_path):
    """A TD error that was changed is found by learning again, for nothing else depends on it in that run."""
    log = open_training(make_log())
    replay_episode(log, "together-2", 0, tmp_path / "a.mcap")
    run = fw.open_log(tmp_path / "a.mcap")
    with LogWriter(tmp_path / "b.mcap", run.header, run.city) as writer:
        for step in run:
            if step.step == 4:
                made = step.decisions
                changed = dataclasses.replace(made, td_error=made.td_error + np.array([0.0, 0.0, 0.5]))
                writer.write(dataclasses.replace(step, decisions=changed))
            else:
                writer.write(step)
    found = fw.verify(tmp_path / "b.mcap")
    assert not found
    assert "step 4" in repr(found)
    assert "td error" in repr(found)


def test_a_fork_of_an_episode_names_its_policy(make_log, tmp_path):
    replay_episode(make_log(), "together-2", 0, tmp_path / "a.mcap")
    with pytest.raises(PolicyError, match="policy: expected a policy that does not change"):
        fw.fork(tmp_path / "a.mcap", at=3, record=tmp_path / "b.mcap")
    fw.fork(tmp_path / "a.mcap", at=3, policy="easiest", record=tmp_path / "b.mcap")
    assert bool(fw.verify(tmp_path / "b.mcap"))


def test_what_is_in_the_way_stays(make_log, tmp_path):
    (tmp_path / "a.mcap").write_text("mine")
    with pytest.raises(OutputError, match=r"a\.mcap"):
        replay_episode(make_log(), "alone-1", 0, tmp_path / "a.mcap")
    with pytest.raises(OutputError, match="expected an existing folder"):
        replay_every(make_log(), 2, tmp_path / "none")
    with pytest.raises(LogError, match="scenario: expected one of alone-1"):
        replay_every(make_log(), 2, tmp_path, scenario="x")
    with pytest.raises(LogError, match="method: expected one that learns in episodes, got 'search'"):
        replay_every(make_log("search"), 2, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]


def test_whole_episodes_need_a_folder_and_episodes(curriculum, tmp_path):
    with pytest.raises(OutputError, match="--full-every: expected an existing folder as --record, got 'none'"):
        train(curriculum, set=SHORT, full_every=2)
    with pytest.raises(TrainingError, match="--full-every: expected a method that learns in episodes, got 'search'"):
        train(curriculum, method="search", record=tmp_path, full_every=2)
    assert list(tmp_path.iterdir()) == []
