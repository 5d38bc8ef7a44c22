"""Free allocation in environments: what may be named, and every form goes where the recorded brigades went."""

from __future__ import annotations

import numpy as np
import pytest

import fireworld as fw
from tests.envs.extra import MISSING, needs_extra
from tests.envs.played import play
from tests.envs.towns import LATER, SMALL

pytestmark = needs_extra()

if not MISSING:
    from fireworld import envs
    from fireworld.envs.check.logs import follow

AT_ONCE = ("worlds", "team", "whole team", "vector")
IN_TURN = ("turns", "brigade")


def freely(scenario):
    """The scenario with free allocation."""
    return {**scenario, "brigades": {**scenario["brigades"], "allocation": "free"}}


@pytest.mark.parametrize("scenario", [SMALL, LATER], ids=["small", "later"])
def test_logs_of_brigades_that_change_sites_are_followed(scenario, tmp_path):
    n_moves = 0
    for choices, forms in (("simultaneous", AT_ONCE), ("in-turn", IN_TURN)):
        path = tmp_path / f"{choices}.mcap"
        fw.run(freely(scenario), policy="best", seed=4, set={"choices": choices}, record=path)
        run = fw.open_log(path)
        sites = np.array([record.observations.site for record in run if record.step])
        n_moves += int((np.diff(sites, axis=0) != 0).sum())
        for form in forms:
            assert follow(form, run) == len(run) - 1 > 3
    assert n_moves > 0


@pytest.mark.parametrize("allocation", ["free", "fixed"])
def test_masks_show_what_may_be_named(allocation):
    scenario = {**SMALL, "brigades": {"n": 3, "allocation": allocation}}
    worlds = envs.worlds(scenario, 1, observation="graph", own_targets=20, seeds=2)
    seen, random, n_elsewhere = worlds.reset(), np.random.default_rng(1), 0
    for _ in range(20):
        state = worlds.world(0).state
        sites, burning = state.sites, seen["burning"][0][seen["burning"][0] >= 0].tolist()
        for brigade in range(3):
            here = [b for b in burning if sites.number[sites.place[b]] == state.brigades.site[brigade]]
            named = seen["own"][0, brigade][seen["own"][0, brigade] >= 0].tolist()
            if state.brigades.refilling[brigade] == 0:
                assert named == (burning if allocation == "free" else here)
                n_elsewhere += len(set(named) - set(here))
            assert seen["action_mask"][0, brigade, 4:].sum() == len(named)
        mask = seen["action_mask"]
        seen = worlds.step((random.random(mask.shape) * mask).argmax(axis=-1)).observation
    assert (n_elsewhere > 0) == (allocation == "free")


def test_episodes_are_recorded_and_played_again(tmp_path):
    """Targets of other sites are gone for again, not replaced by `easiest`."""
    path = play(tmp_path / "a.mcap", scenarios=(freely(SMALL), freely(LATER)), own_targets=9)
    assert fw.verify(path)
    fw.replay_episode(fw.open_training(path), None, 0, tmp_path / "run.mcap")
    assert fw.verify(tmp_path / "run.mcap")
