"""Where two trainings first differ: the learning rule, the exploration, the reward, the draws, each is located."""

import numpy as np
import pytest

import fireworld as fw
from fireworld.errors import LogError
from fireworld.kernels import learning
from fireworld.training.log.difference import diff_trainings
from fireworld.training.log.reader import open_training
from fireworld.training.log.verify import verify_training
from fireworld.training.methods import sarsa


def test_equal_trainings(make_log, log_path):
    found = diff_trainings(log_path, log_path)
    assert found.same
    assert [*found.describe()] == [f"the same: {len(open_training(log_path))} episodes"]
    assert verify_training(log_path, team=log_path.with_suffix(".npz")).same
    assert bool(fw.verify(log_path))


@pytest.mark.parametrize(
    ("settings", "phase", "words"),
    [
        ({"alpha": 0.6}, "learn", "learned value of"),
        ({"gamma": 0.9}, "learn", "TD error of"),
        ({"epsilon_decay": 0.5}, "draw", "epsilon"),
        ({"reward": "change"}, "reward", "reward"),
        ({"seed": 2}, "draw", "seed"),
        ({"rule": "q-learning"}, "learn", "TD error of"),
    ],
)
def test_the_first_difference_names_the_cause(make_log, log_path, settings, phase, words):
    found = diff_trainings(log_path, make_log(**settings))
    first = found.first
    assert first is not None
    assert (first.phase, found.same) == (phase, False)
    assert words in first.sentence
    (key,) = settings
    assert list(found.header) == [key]
    assert list(found.cause.changes) == ["seed" if key == "seed" else "method"]
    check_by_hand(first, log_path, make_log(**settings))
    assert found.to_dict()["first"]["sentence"] == first.sentence
    for row in found.spread:
        assert row.first == 0 or row.n_equal > 0


def check_by_hand(first, a, b):
    """Every part before is the same, and the named one is not."""
    for number, (one, other) in enumerate(
        zip(open_training(a).raw_parts(), open_training(b).raw_parts(), strict=False)
    ):
        same = dict(one)["/episode"] == dict(other)["/episode"]
        assert same == (number < first.part)
        if not same:
            break
    else:
        pytest.fail("no part differs")
    if first.step is None:
        return
    x, y = (open_training(path).episode_at(first.part) for path in (a, b))
    row = first.step - 1
    n_before = min(row, x.state.shape[1], y.state.shape[1])
    for name in ("state", "action", "choice", "value_before", "td_error", "value_after"):
        np.testing.assert_array_equal(getattr(x, name)[:, :n_before], getattr(y, name)[:, :n_before])


def test_how_it_spread(make_log, log_path):
    found = diff_trainings(log_path, make_log(alpha=0.6))
    assert [row.scenario for row in found.spread] == ["alone-1", "alone-2", "together-1", "together-2"]
    for row in found.spread:
        a, b = (open_training(path) for path in (log_path, make_log(alpha=0.6)))
        lines = [[line for line in log.lines if log.scenarios[line.scenario].name == row.scenario] for log in (a, b)]
        assert row.n_episodes == (len(lines[0]), len(lines[1]))
        assert row.total_reward[0] == pytest.approx(np.mean([line.total_reward for line in lines[0][-20:]]))
        assert 0.0 <= row.agreement <= 1.0
        tables = [log.episode(row.scenario, -1).tables_after for log in (a, b)]
        assert row.value_difference == pytest.approx(np.abs(tables[0] - tables[1]).max())
    text = "\n".join(block for block in found.describe() if isinstance(block, str))
    assert "alpha: 0.6, was 0.7" in text


def test_searches(make_log):
    found = diff_trainings(make_log("search"), make_log("search", spread=0.5))
    assert found.first is not None
    assert (found.first.number, found.first.phase) == (0, "draw")
    assert "weights of ranking 0" in found.first.sentence
    assert diff_trainings(make_log("search"), make_log("search")).same
    assert verify_training(make_log("search")).same


def test_what_cannot_be_compared(make_log, log_path, tmp_path, curriculum):
    with pytest.raises(LogError, match=r"method: expected paper, as in .*, got 'search'"):
        diff_trainings(log_path, make_log("search"))
    fw.train("quick", set={"n_episodes_max": 1}, record=tmp_path / "q.mcap")
    with pytest.raises(LogError, match=r"brigades: expected 1 in alone-1, as in .*, got 2 in quick"):
        diff_trainings(log_path, tmp_path / "q.mcap")
    with pytest.raises(LogError, match="diff of trainings"):
        fw.diff(log_path, log_path, tolerances={"hp": 1})
    start = open_training(log_path).found.starts[0].offset
    (tmp_path / "cut.mcap").write_bytes(log_path.read_bytes()[: start + 1])
    with pytest.raises(LogError, match=r"cut\.mcap: .*there is nothing to compare"):
        diff_trainings(log_path, tmp_path / "cut.mcap", partial=True)
    with pytest.raises(LogError, match="it is the log of a training, not of a run; `fireworld replay` makes"):
        fw.open_log(log_path)


def test_verify_finds_a_changed_draw_of_the_table(log_path, monkeypatch):
    monkeypatch.setattr(sarsa.SarsaTrainer, "_draw_table", lambda self: len(self.progress.tables) - 1)
    found = verify_training(log_path)
    log = open_training(log_path)
    changed = [k for k, line in enumerate(log.lines) if line.drawn not in {-1, 0} or line.ended]
    if not found:
        assert found.difference.first.part in changed
        assert found.difference.first.phase == "end"
        assert "drawn" in found.difference.first.sentence


def test_verify_finds_a_changed_exploration(log_path, monkeypatch):
    monkeypatch.setattr(sarsa, "_power", lambda *_: 0.5)
    found = verify_training(log_path)
    assert not found
    assert found.difference.first.phase == "draw"
    assert found.difference.first.what == "epsilon"
    assert "learned again it differs: alone-1, episode 0: epsilon 0.5, was 1.0" in repr(found)


def test_the_rules_of_learning_are_those_of_the_kernels():
    assert sarsa.RULES == ("sarsa", "expected-sarsa", "q-learning")
    assert (learning.SARSA, learning.EXPECTED_SARSA, learning.Q_LEARNING) == (0, 1, 2)
