"""The trainer: exploration, convergence, what is handed on between scenarios, and the same tables everywhere."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from fireworld.draws import TABLE, below
from fireworld.training.methods.sarsa import Progress


def test_the_whole_curriculum(make_trainer, curriculum):
    trainer = make_trainer()
    reports = list(trainer)
    assert trainer.done
    assert list(trainer) == []
    names = [scenario.name for stage in curriculum.stages for scenario in stage.scenarios]
    assert list(dict.fromkeys(report.scenario for report in reports)) == names
    team = trainer.team()
    assert team.tables.shape == team.visits.shape == (3, 4320, 4)
    assert team.provenance["scenarios_done"] == 4
    assert team.provenance["curriculum"]["digest"] == curriculum.digest


def test_epsilon_decays_within_each_scenario(make_trainer):
    for report in make_trainer(epsilon_decay="0.8"):
        assert report.epsilon == pytest.approx(0.8**report.episode, rel=1e-12)
        assert report.episode > 0 or report.epsilon == 1.0


def test_it_settles_when_no_greedy_action_has_changed_for_some_episodes(make_trainer):
    trainer = make_trainer(n_episodes_max="12")
    n_unchanged = number = n_settled = 0
    before = trainer.progress.tables.copy()
    for report in trainer:
        if report.scenario_number != number:
            number, n_unchanged = report.scenario_number, 0
        n_unchanged = 0 if report.n_changed else n_unchanged + 1
        assert report.n_unchanged == n_unchanged
        assert report.converged == (n_unchanged == 3)
        after = trainer.progress.tables
        if trainer.progress.episode:
            assert report.n_changed == (before.argmax(axis=2) != after.argmax(axis=2)).sum()
        else:
            n_settled += report.converged
            assert report.converged or report.episode == 11
        before = after.copy()
    assert n_settled > 0


def test_who_learns_nothing_settles_at_once(make_trainer):
    reports = list(make_trainer(alpha="0"))
    assert [report.episode for report in reports] == [0, 1, 2] * 4
    assert [report.converged for report in reports] == [False, False, True] * 4


def with_tables(trainer, number, n_tables, n_states):
    """Put a trainer at the end of a scenario, with tables in which every entry is another number."""
    tables = np.arange(n_tables * n_states * 4, dtype=np.float64).reshape(n_tables, n_states, 4)
    trainer.progress = Progress(number, 5, 2, tables, np.ones(tables.shape, dtype=np.int64))
    return tables


def test_between_scenarios_one_table_is_drawn_for_all(make_trainer):
    drawn = set()
    for seed in range(40):
        trainer = make_trainer(seed)
        tables = with_tables(trainer, 2, 3, 4320)
        trainer._next_scenario(trainer._draw_table())
        progress = trainer.progress
        assert (progress.scenario_number, progress.episode, progress.n_unchanged) == (3, 0, 0)
        number = below(seed, TABLE, 2, 0, bound=3)
        drawn.add(number)
        for table in progress.tables:
            np.testing.assert_array_equal(table, tables[number])
        assert progress.visits.shape == (3, 4320, 4)
        assert progress.visits.all()
    assert drawn == {0, 1, 2}
    assert not np.shares_memory(progress.tables[0], progress.tables[1]), "each goes on learning its own"


def test_what_was_learned_alone_holds_whatever_the_others_do(make_trainer):
    trainer = make_trainer()
    tables = with_tables(trainer, 1, 1, 270)
    trainer._next_scenario(trainer._draw_table())
    progress = trainer.progress
    assert progress.tables.shape == (3, 4320, 4)
    for state in (0, 15, 16, 1193, 4319):
        for brigade in range(3):
            assert progress.tables[brigade, state].tolist() == tables[0, state // 16].tolist()
    assert not progress.visits.any(), "nothing is visited yet with the others in sight"


def test_a_shared_table(make_trainer):
    trainer = make_trainer(shared_table="true")
    list(trainer)
    assert trainer.team().tables.shape == (1, 4320, 4)


def test_random_draws(make_trainer):
    def scores(**changes):
        trainer = make_trainer(alpha="0", epsilon_decay="0", n_episodes_unchanged="6", **changes)
        return [(report.n_steps, report.total_reward) for report in trainer]

    assert len(set(scores()[-3:])) > 1, "every episode has its own"
    assert len(set(scores(fixed_noise="true")[-2:])) == 1, "or every scenario"


def test_other_seeds_and_methods_other_tables(make_trainer):
    def digest(*words, **changes):
        trainer = make_trainer(*words, **changes)
        list(trainer)
        return trainer.team().digest

    variants = ({"rule": "q-learning"}, {"rule": "expected-sarsa"}, {"gamma": "0.9"}, {"reward": "change"})
    more = ({"choices": "simultaneous"}, {"commit": "3"}, {"alpha_decay": "1"})
    digests = [digest(1), digest(2), *(digest(1, **changes) for changes in (*variants, *more))]
    assert len(set(digests)) == len(digests)
    assert digest(1) == digests[0]


PRINT_DIGEST = """
from fireworld.training.curriculum import load_curriculum
from tests.training.conftest import SHORT
trainer = SHORT.trainer(load_curriculum("tiny.yaml"), seed=5)
list(trainer)
print(trainer.team().digest)
"""


@pytest.mark.slow
def test_the_same_tables_in_every_process(make_trainer, here):
    trainer = make_trainer(5)
    list(trainer)
    done = subprocess.run(
        [sys.executable, "-c", PRINT_DIGEST],
        env=os.environ | {"PYTHONHASHSEED": "77", "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == [trainer.team().digest]
