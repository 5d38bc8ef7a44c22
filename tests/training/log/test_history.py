"""How the values of a state came about: worked out again from the episodes, one by one."""

import json

import numpy as np
import pytest

from fireworld.errors import LogError
from fireworld.policy.teams.team import load_team
from fireworld.training.log.history import state_histories, state_history
from fireworld.training.log.reader import open_training


def busiest(log):
    """Return the state that was learned in most."""
    visits = log.trainer_before(len(log)).progress.visits
    return int(visits.sum(axis=(0, 2)).argmax())


def test_the_moves_are_those_of_the_tables(log):
    state = busiest(log)
    found = state_history(log, state, n_moves=10_000)
    assert found.n_updates == len(found.moves) > 5
    sizes = [abs(move.value_after - move.value_before) for move in found.moves]
    assert sizes == sorted(sizes, reverse=True)
    by_episode = {}
    for move in found.moves:
        by_episode.setdefault((move.scenario, move.episode), []).append(move)
    for (scenario, episode), moves in by_episode.items():
        learned = log.episode(scenario, episode)
        width = 4320 // learned.tables.shape[1]
        row = state // width
        moved = (learned.tables[:, row] != learned.tables_after[:, row]).sum()
        assert moved <= len(moves)
        for move in moves:
            assert learned.state[move.brigade, move.step - 1] // width == row
    for brigade in {move.brigade for move in found.moves}:
        mine = [move for move in found.moves if move.brigade == brigade]
        earliest = min(mine, key=lambda move: (log.position(move.scenario, move.episode), move.step))
        assert [first for first in found.firsts if first.brigade == brigade] == [earliest]


def test_the_rewards_are_those_of_the_steps(log):
    for move in state_history(log, busiest(log)).moves:
        episode = log.episode(move.scenario, move.episode)
        assert move.reward == episode.reward[:, move.step - 1].sum()
        assert move.value_after != move.value_before


def test_several_states_in_one_pass(log):
    states = [busiest(log), 0, 4319]
    together = state_histories(log, states, n_moves=4)
    assert [one.to_dict() for one in together] == [state_history(log, one, n_moves=4).to_dict() for one in states]
    assert len(together[0].moves) == 4


def test_the_moments_are_the_ends_of_scenarios(log):
    state = busiest(log)
    found = state_history(log, state)
    assert [one.scenario for one in found.moments if one.table == 0] == [one.name for one in log.scenarios]
    for moment in found.moments:
        tables = log.episode_at(moment.part).tables_after
        values = tables[moment.table, state // (4320 // tables.shape[1])]
        np.testing.assert_array_equal(values, moment.q_values)


def test_what_is_shown(log_path, fireworld):
    log = open_training(log_path)
    state = busiest(log)
    team = log_path.with_suffix(".npz")
    shown = fireworld("policy", "show", team, state, "--log", log_path)
    assert shown.code == 0
    assert shown.out.startswith(f"state {state}: ")
    assert f"fireworld replay {log_path.name} --scenario " in shown.out
    assert "\nbrigade 0 was first in it in alone-" in shown.out
    (found,) = json.loads(fireworld("policy", "show", team, state, "--log", log_path, "--json").out)
    assert (found["state"], len(found["moves"])) == (state, 10)
    assert {"scenario", "episode", "step", "brigade", "td_error", "reward"} <= found["moves"][0].keys()
    assert {move["brigade"] for move in found["firsts"]} == {0, 1, 2}
    assert max(map(len, shown.out.splitlines()[3:-2])) <= 80
    unseen = next(s for s in range(4320) if not log.trainer_before(len(log)).progress.visits[:, s].any())
    assert "never visited in" in fireworld("policy", "show", team, unseen, "--log", log_path).out


def test_what_does_not_fit(log, make_log, log_path, fireworld):
    other = make_log(alpha=0.6).with_suffix(".npz")
    done = fireworld("policy", "show", other, 3, "--log", log_path)
    ours, theirs = log.team().digest, load_team(other).digest
    wanted = f"fireworld: {other}: expected the team of {log_path}, digest {ours}, got '{theirs}'\n"
    assert (done.code, done.out, done.err) == (2, "", wanted)
    with pytest.raises(LogError, match="state: expected a number from 0 to 4319, got 4320"):
        state_history(log, 4320)
    with pytest.raises(LogError, match="expected one that learns in episodes, got 'search'"):
        state_history(open_training(make_log("search")), 3)
    done = fireworld("policy", "show", log_path.with_suffix(".npz"), "--log", log_path)
    assert (done.code, "--log needs a STATE" in done.err) == (2, True)
