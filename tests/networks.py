"""Networks for tests, of any widths, with weights by draw."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fireworld.policy.teams.network_team import NetworkTeam

N_FEATURES = 13


def random_layers(*widths, seed=8):
    """Weights and biases of a network that reads so many features, and has layers with so many outputs."""
    random = np.random.default_rng(seed)
    return [(random.normal(size=(n_in, n_out)), random.normal(size=n_out)) for n_in, n_out in pairwise(widths)]


def make_network(*widths, seed=8, activation="tanh", **others):
    """A team with such a network; without widths it reads the 13 features and has 7, 5 and 1 outputs."""
    return NetworkTeam.from_layers(
        random_layers(*(widths or (N_FEATURES, 7, 5, 1)), seed=seed), activation=activation, **others
    )
