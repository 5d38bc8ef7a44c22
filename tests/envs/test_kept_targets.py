"""Kept targets in environments: who stays has nothing to choose, and every form goes where the brigades went."""

from __future__ import annotations

import numpy as np
import pytest

import fireworld as fw
from tests.envs.extra import MISSING, needs_extra
from tests.envs.towns import LATER, SMALL

pytestmark = needs_extra()

if not MISSING:
    from fireworld import envs
    from fireworld.envs.check.logs import follow
    from fireworld.envs.datasets.recorded import recorded
    from fireworld.envs.datasets.trajectory import Shape, trajectory_of


def kept(scenario):
    """The scenario with kept targets."""
    return {**scenario, "brigades": {**scenario["brigades"], "targets": "kept"}}


@pytest.mark.parametrize("scenario", [SMALL, LATER], ids=["small", "later"])
@pytest.mark.parametrize("policy", ["best", "random"])
def test_logs_of_brigades_that_keep_their_targets_are_followed(policy, scenario, tmp_path):
    forms_of = {"simultaneous": ("worlds", "team", "whole team", "vector"), "in-turn": ("turns", "brigade")}
    for choices, forms in forms_of.items():
        path = tmp_path / f"{choices}.mcap"
        done = fw.run(kept(scenario), policy=policy, seed=4, set={"choices": choices}, record=path)
        run = fw.open_log(path)
        for form in forms:
            assert follow(form, run) == len(run) - 1 > 3
        (episode,) = recorded(path)
        seen = trajectory_of(episode, Shape("features", "scenario", 20))
        assert (len(seen.action), seen.score[-1]) == (len(run) - 1, done.outcome.score)


def test_who_stays_with_a_target_can_only_do_that():
    worlds = envs.worlds(kept(SMALL), 1, own_targets=20, seeds=2)
    seen, random, n_kept = worlds.reset(), np.random.default_rng(1), 0
    for _ in range(20):
        state, mask = worlds.world(0).state, seen["action_mask"]
        brigades, place = state.brigades, state.sites.place
        before = brigades.action.copy(), brigades.target.copy()
        of_its_site = (place[before[1]] >= 0) & (state.sites.number[place[before[1]]] == brigades.site)
        stays = (before[1] >= 0) & of_its_site & (brigades.refilling == 0) & (brigades.hp > 0)
        assert (mask[0, stays, 1:] == 0).all()
        assert (mask[0, stays, 0] == 1).all()
        seen = worlds.step((random.random(mask.shape) * mask).argmax(axis=-1)).observation
        brigades = worlds.world(0).state.brigades
        assert (brigades.action[stays] == before[0][stays]).all()
        assert (brigades.target[stays] == before[1][stays]).all()
        n_kept += int(stays.sum())
    assert n_kept > 5
