"""Methods: the paper's hyperparameters, other ones, and every mistake in one line."""

from __future__ import annotations

from dataclasses import fields

import pytest

from fireworld.errors import TrainingError
from fireworld.training.methods import find_method
from fireworld.training.methods.sarsa import PAPER, Sarsa


def test_the_paper():
    assert find_method("paper") == PAPER
    assert (PAPER.rule, PAPER.alpha, PAPER.gamma, PAPER.epsilon_decay) == ("sarsa", 0.7, 0.5, 0.9)
    assert (PAPER.n_episodes_max, PAPER.n_episodes_unchanged) == (130, 20)
    assert list(PAPER.as_dict()) == [item.name for item in fields(Sarsa)]


def test_other_hyperparameters():
    changed = PAPER.with_settings({"alpha": "1e-1", "commit": "4", "shared_table": "true", "reward": "change"})
    assert changed == Sarsa(alpha=0.1, commit=4, shared_table=True, reward="change")


@pytest.mark.parametrize(
    ("key", "text", "message"),
    [
        ("speed", "3", r"^--set: speed: expected one of rule, alpha, .*, got 'speed'$"),
        ("alpha", "fast", r"^--set: alpha: expected a number, got 'fast'$"),
        ("alpha", "1.5", r"^method: alpha: expected a number from 0 to 1, got 1.5$"),
        ("gamma", "nan", r"^method: gamma: expected a number from 0 to 1, got nan$"),
        ("epsilon_decay", "-0.1", "from 0 to 1"),
        ("alpha_decay", "inf", "a number >= 0, got inf"),
        ("commit", "0", "a whole number from 1 to 1000000, got 0"),
        ("commit", "2.5", "a whole number, got '2.5'"),
        ("commit", "1" + "0" * 30, "a whole number from 1 to 1000000"),
        ("n_episodes_max", "0", "a whole number from 1"),
        ("shared_table", "yes", "true or false, got 'yes'"),
        ("rule", "dqn", "one of sarsa, expected-sarsa, q-learning, got 'dqn'"),
        ("reward", "flow", "one of stock, change, own, got 'flow'"),
        ("choices", "", "one of in-turn, simultaneous, got ''"),
    ],
)
def test_a_hyperparameter_that_cannot_be(key, text, message):
    with pytest.raises(TrainingError, match=message):
        PAPER.with_settings({key: text})


def test_an_unknown_method():
    with pytest.raises(TrainingError, match=r"^--method: expected one of .*paper.*, got 'best-ever'$"):
        find_method("best-ever")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"alpha": "0.1"}, ""),
        ({"alpha": 0.1}, ""),
        ({"alpha": 1}, ""),
        ({"alpha": True}, r"^--set: alpha: expected a number, got True$"),
        ({"alpha": None}, r"^--set: alpha: expected a number, got None$"),
        ({"alpha": 10**400}, r"^--set: alpha: expected a number, got 1000"),
        ({"commit": 2.0}, r"^--set: commit: expected a whole number, got 2.0$"),
        ({"shared_table": 1}, r"^--set: shared_table: expected true or false, got 1$"),
        ({"shared_table": []}, r"^--set: shared_table: expected true or false, got \[\]$"),
        ({"rule": 3}, r"^method: rule: expected one of sarsa, expected-sarsa, q-learning, got 3$"),
        ({"rule": []}, r"^method: rule: expected one of sarsa, "),
    ],
)
def test_plain_values_and_text(settings, message):
    if not message:
        assert PAPER.with_settings(settings).as_dict()["alpha"] == float(settings["alpha"])
        return
    with pytest.raises(TrainingError, match=message):
        PAPER.with_settings(settings)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"alpha": "0.1"}, "alpha: expected a number from 0 to 1, got '0.1'"),
        ({"commit": 2.0}, "commit: expected a whole number from 1 to 1000000, got 2.0"),
        ({"shared_table": 1}, "shared_table: expected true or false, got 1"),
    ],
)
def test_values_of_another_type(values, message):
    with pytest.raises(TrainingError, match=f"^method: {message}$"):
        Sarsa(**values)
