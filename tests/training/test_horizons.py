"""The benchmark that says how far rollouts must look: two rollouts of every option, the same options each time."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.horizons import main, two_rollouts
from fireworld.policy.teams.team import load_team
from fireworld.simulation.built import CityCache
from tests.training.generations import CONDITIONS, read


@pytest.fixture(scope="module")
def fires(tmp_path_factory):
    curriculum, cities = read(CONDITIONS, tmp_path_factory.mktemp("horizons")), CityCache()
    return [[cities.build(one) for one in stage.scenarios] for stage in curriculum.stages]


def test_two_rollouts_of_every_option(fires):
    network = load_team("best").policy().network
    near, far = (two_rollouts(fires, network, horizon, 4, 1)[0] for horizon in (7, 20))
    assert near.shape == far.shape
    assert len(near) > 20
    assert near.shape[1] == 2
    for worth in (near, far):
        assert (worth[:, 0] != worth[:, 1]).any(), "other random draws"
    assert np.abs(far).sum() > np.abs(near).sum() > 0.0, "what is chosen matters more and more"
    assert two_rollouts(fires, network, 7, 4, 1)[0].tobytes() == near.tobytes()


def test_a_team_without_a_network(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["horizons", "--team", "chief"])
    with pytest.raises(SystemExit):
        main()
    assert "--team: expected a team with a network, got chief" in capsys.readouterr().err
