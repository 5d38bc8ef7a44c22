"""What a training log holds: every step that a team learned from, and nothing else."""

import numpy as np
import pytest

from fireworld.errors import LogError
from fireworld.policy.teams.table_team import tables_digest
from fireworld.policy.teams.team import load_team
from fireworld.records import CHOICES
from fireworld.simulation.state import fresh_learner
from fireworld.training.log.reader import open_training
from fireworld.training.log.records import Episode, Tables, Tried
from fireworld.training.method import Method
from fireworld.training.methods.sarsa import Sarsa
from fireworld.training.train import train
from tests.training.log.conftest import SHORT, SHORT_SEARCH

VARIANTS = [
    {},
    {"rule": "expected-sarsa"},
    {"rule": "q-learning", "alpha_decay": 0.5},
    {"shared_table": True, "reward": "change"},
    {"choices": "simultaneous", "fixed_noise": True},
    {"commit": 3},
]


def test_recording_changes_nothing(curriculum, log_path):
    plain = train(curriculum, set=SHORT)
    assert plain.digest == load_team(log_path.with_suffix(".npz")).digest == open_training(log_path).team().digest
    assert plain.to_bytes() == log_path.with_suffix(".npz").read_bytes()


def test_a_search_too(curriculum, make_log):
    path = make_log("search")
    plain = train(curriculum, method="search", set=SHORT_SEARCH)
    assert plain.digest == load_team(path.with_suffix(".npz")).digest == open_training(path).team().digest
    tried = [part[Tried] for part in open_training(path)]
    assert [one.generation for one in tried] == [0, 1, 2]
    for one in tried:
        scores = one.scores.reshape(4, 2)
        assert one.score_mean == pytest.approx(scores.mean())
        assert one.best.tolist() == sorted(range(4), key=lambda k: -scores[k].mean())[:2]
        assert len(one.weights) == 4 * len(one.mean)


def test_reports_are_those_of_the_training(curriculum, log):
    told = []
    train(curriculum, set=SHORT, callbacks=[lambda _, report: told.append(report)])
    assert [report for _, report in log.reports()] == told
    assert len(log) == len(told)


@pytest.mark.parametrize("settings", VARIANTS, ids=str)
def test_what_is_recorded_is_all_that_was_learned_from(make_log, settings):
    """Learned again from the log alone, the tables come out bit for bit, episode by episode."""
    log = open_training(make_log(**settings))
    n_learned = 0
    for number in range(len(log)):
        found = log.episode_at(number)
        assert tables_digest(found.tables_after) == found.record.tables_digest
        updated = ~np.isnan(found.td_error)
        n_learned += int(updated.sum())
        assert (np.isnan(found.value_before) == ~updated).all()
        changed = (found.tables != found.tables_after).any(axis=2).sum()
        assert changed <= updated.sum()
        explored = found.choice == CHOICES.index("explored")
        assert (found.state[explored] >= 0).all()
        if found.record.epsilon == 0.0:
            assert not explored.any()
    assert n_learned > 30
    assert log.done


@pytest.mark.parametrize("settings", VARIANTS, ids=str)
def test_errors_and_values_are_those_of_the_definition(make_log, settings):
    """Q(s, a) += rate * (R + D * worth - Q(s, a)), worked out by hand from the recorded columns."""
    log = open_training(make_log(**settings))
    method: Method = log.method
    assert isinstance(method, Sarsa)
    for number in (0, len(log) // 2, len(log) - 1):
        found = log.episode_at(number)
        by_hand = textbook(found, method)
        np.testing.assert_array_equal(by_hand, found.tables_after)


def textbook(found, method):
    """Return the tables after an episode by the definition, in plain Python."""
    tables, visits, record = found.tables.copy(), found.visits.copy(), found.record
    n_brigades, n_rows = found.state.shape
    last = {}
    for row in range(record.n_steps + 1):
        for brigade in range(n_brigades):
            table = 0 if len(tables) == 1 else brigade
            over = row == record.n_steps
            how = "none" if row >= n_rows else CHOICES[found.choice[brigade, row]]
            if over and record.terminated:
                worth = 0.0
            elif how in ("greedy", "explored") or (how == "kept" and over):
                state = found.state[brigade, row] // (4320 // tables.shape[1])
                action = found.action[brigade, row]
                values = tables[table, state]
                mean = (1 - record.epsilon) * values.max() + record.epsilon * values.sum() / 4
                worth = {"sarsa": values[action], "q-learning": values.max(), "expected-sarsa": mean}[method.rule]
                worth = values[action] if how == "kept" else worth
            else:
                continue
            if brigade in last:
                s, a, total, discount = last[brigade]
                error = total + discount * worth - tables[table, s, a]
                assert error == found.td_error[brigade, row]
                assert tables[table, s, a] == found.value_before[brigade, row]
                tables[table, s, a] += method.alpha / (1 + method.alpha_decay * visits[table, s, a]) * error
                visits[table, s, a] += 1
                assert tables[table, s, a] == found.value_after[brigade, row]
            if not over:
                last[brigade] = (state, action, 0.0, 1.0)
        if row < record.n_steps:
            reward = 0.0
            for term in found.reward[:, row]:
                reward += term
            last = {b: (s, a, total + d * reward, d * method.gamma) for b, (s, a, total, d) in last.items()}
    return tables


def test_totals_are_those_of_the_columns(log):
    for part in log:
        record = part[Episode]
        assert record.total_reward == pytest.approx(record.reward.sum())
        assert record.terminated or record.n_steps == log.plan.n_steps_max[record.scenario]


def test_tables_are_whole_at_the_end_of_every_scenario_and_each_50th_episode(curriculum, tmp_path):
    path = tmp_path / "long.mcap"
    train(curriculum.only(["alone"]), set={"n_episodes_max": 103, "n_episodes_unchanged": 103}, record=path)
    log = open_training(path)
    whole = [(part[Episode].scenario, part[Episode].episode) for part in log if Tables in part]
    assert whole == [(0, 49), (0, 99), (0, 102), (1, 49), (1, 99), (1, 102)]
    for place in (0, 1, 49, 50, 51, 75, 102, 103, 204, 205, 206):
        straight = log.trainer()
        for number, part in zip(range(place), log.parts(), strict=False):
            log.follow(straight, part, number)
        jumped = log.trainer_before(place)
        for name in ("tables", "visits"):
            ours, theirs = (getattr(one.progress, name) for one in (jumped, straight))
            np.testing.assert_array_equal(ours, theirs)
        progress = [(one.progress.scenario_number, one.progress.episode) for one in (jumped, straight)]
        assert progress[0] == progress[1]


def test_nothing_is_traced_where_nobody_records(make_log, curriculum):
    learner = fresh_learner(np.zeros((1, 4320, 4)), 2)
    assert learner.trace.state.size == learner.trace.reward.size == 0
    trainer = Sarsa(**SHORT).trainer(curriculum, seed=1)
    next(iter(trainer))
    assert trainer.records()[0].state.size == 0


def test_names_that_are_not_there_are_answered_with_those_that_are(log):
    with pytest.raises(LogError, match="scenario: expected one of alone-1, alone-2, together-1, together-2, got 'x'"):
        log.episode("x", 0)
    with pytest.raises(LogError, match=r"episode: expected one from 0 to [0-9]+ of alone-2, got 99"):
        log.episode("alone-2", 99)
    with pytest.raises(LogError, match="part: expected one from 0 to"):
        log.trainer_before(len(log) + 1)
    last = log.episode("together-2", -1)
    assert last.record.ended
    assert last.record.drawn == -1


def test_a_search_has_no_episodes(make_log):
    with pytest.raises(LogError, match="expected one that learns in episodes, got 'search'"):
        open_training(make_log("search")).episode("alone-1", 0)
