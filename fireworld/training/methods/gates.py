"""Gates: evolve several rankings of targets, and a gate that says by which of them a brigade goes. MODEL 12."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from typing import Annotated, ClassVar, Final

import numpy as np

from fireworld.kernels.arrays import Array
from fireworld.policy.teams.network_layers import FEATURES, NUMBER_MAX, Layer
from fireworld.policy.teams.team import Team
from fireworld.training.method import Limits
from fireworld.training.methods.evolution import EvolutionStrategy
from fireworld.training.networks import weights_of

N_MAX: Final = 4
SITUATION: Final = ("sprays_left", "site_burning", "site_steps", "site_kindling", "sites", "site_others")
"""What gates weigh: what a brigade sees around a target that is the same for all targets of its site."""
N_TARGET, N_GATE = len(FEATURES), 1 + len(SITUATION)
"""Numbers of a ranking, the weights of the features of a target; and of a gate, a bias and the weights of the above."""
LARGEST: Final = 1000.0
"""Numbers count no further than that. So weights fit a network, and a gate that is behind shuts its ranking out."""
SHUT: Final = NUMBER_MAX
"""How much less a ranking counts, in its own values, for each 1 that its gate is behind."""


@dataclass(frozen=True, kw_only=True)
class Gates(EvolutionStrategy):
    """Evolution of rankings of targets, of which the one with the greatest gate values the targets.

    The numbers are the weights of the rankings, one after another, then the gates, each a bias and its weights.
    """

    name: ClassVar[str] = "gates"

    n_rankings: Annotated[int, Limits(f"a whole number from 2 to {N_MAX}", 2, N_MAX)] = 2
    """Rankings, each with a gate."""

    @property
    def features(self) -> tuple[str, ...]:
        """What rankings read of a target, and what gates read."""
        return (*FEATURES, *SITUATION)

    @property
    def widths(self) -> tuple[int, ...]:
        """What is read; the features of the target, and how far each gate is ahead of each other; two for a ranking."""
        n = self.n_rankings
        return (len(self.features), N_TARGET + n * (n - 1), 2 * n, 1)

    def first_numbers(self, start: Team | None, seed: int) -> Array:
        """Return the numbers before the first generation: every ranking is the start, or 0, and the gates are equal."""
        del seed
        rankings = np.zeros((self.n_rankings, N_TARGET))
        if start is not None:
            rankings[:] = weights_of(start)
        return np.concatenate([rankings.ravel(), np.zeros(self.n_rankings * N_GATE)])

    def rankings_and_gates(self, numbers: Array) -> tuple[Array, Array]:
        """Return the weights of the rankings, (n, 13), and of the gates, (n, 7), biases first: views of the numbers."""
        rankings, gates = np.split(numbers, [self.n_rankings * N_TARGET])
        return rankings.reshape(-1, N_TARGET), gates.reshape(-1, N_GATE)

    def layers_of(self, numbers: Array) -> tuple[Layer, ...]:
        """Return the layers of the network that chooses a ranking and values targets by it. MODEL 12.

        The features of targets are at least 0, so relu leaves them as they are. With v the value of a ranking and b how
        far its gate is behind, in all, its two units are max(v - SHUT b, 0) and max(-v - SHUT b, 0), and count plus and
        minus: v, to the last bit, where b is 0; 0 where b is |v| / SHUT or more.
        """
        rankings, gates = self.rankings_and_gates(np.clip(numbers, -LARGEST, LARGEST))
        n_read, n_leads, n_values, _ = self.widths
        leads = np.zeros((n_read, n_leads))
        biases = np.zeros(n_leads)
        values = np.zeros((n_leads, n_values))
        leads[:N_TARGET, :N_TARGET] = np.eye(N_TARGET)
        values[:N_TARGET, 0::2], values[:N_TARGET, 1::2] = rankings.T, -rankings.T
        for unit, (ahead, behind) in enumerate(permutations(range(self.n_rankings), 2), N_TARGET):
            lead = gates[ahead] - gates[behind]
            biases[unit], leads[N_TARGET:, unit] = lead[0], lead[1:]
            values[unit, 2 * behind : 2 * behind + 2] = -SHUT
        signs = np.tile([1.0, -1.0], self.n_rankings)[:, np.newaxis]
        return Layer(leads, biases), Layer(values, np.zeros(n_values)), Layer(signs, np.zeros(1))

    def drop_idle(self, noise: Array) -> None:
        """Take out what is the same of all gates: only by how much they differ do they choose."""
        for row in noise:
            _, gates = self.rankings_and_gates(row)
            gates -= sum(gates) / self.n_rankings


METHOD: Final = Gates()
