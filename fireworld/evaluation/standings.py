"""Standings: how policies stand in suites, from the runs that are known of each, of one version of the simulator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fireworld.evaluation.inputs import Rows
from fireworld.evaluation.results import Results, RunKey
from fireworld.evaluation.runs import Outcomes
from fireworld.evaluation.statistics import Estimate, estimate_over
from fireworld.kernels.arrays import Array


@dataclass(frozen=True)
class Standing:
    """How a policy stands: shares of the greatest score, with 95 % intervals."""

    name: str
    digest: str
    cells: Mapping[str, Estimate]
    """By suite; those are left out in which no seed has all of its runs."""
    overall: Estimate | None = None
    """The mean over all suites, each of which counts the same; None if one is left out."""
    rank: int | None = None
    """1: the best overall; equals share a rank. None without `overall`."""

    @property
    def n_seeds(self) -> int:
        """Seeds that count in every suite; 0 if there are no runs."""
        return min((cell.n_seeds for cell in self.cells.values()), default=0)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values (docs/leaderboard.md)."""
        return {
            "rank": self.rank,
            "name": self.name,
            "digest": self.digest,
            "overall": None if self.overall is None else self.overall.ends(),
            "suites": {name: {**cell.ends(), "n_seeds": cell.n_seeds} for name, cell in self.cells.items()},
        }


def standings_of(
    policies: Mapping[str, str], rows: Rows, seeds: Sequence[int], known: Results, version: str
) -> list[Standing]:
    """Rank policies by the runs that are known of them, the best first; at the end those that miss a suite.

    A seed counts in a suite if all scenarios of the suite were run with it. Fires that were drawn are drawn anew in the
    intervals, and seeds in any case.

    Args:
        policies: names by digest.
        rows: suites, or scenarios.
        seeds: those that count, if there are runs.
        known: the runs.
        version: of the simulator that made them.
    """
    found = [_standing(name, digest, rows, seeds, known, version) for digest, name in policies.items()]
    overall = [one.overall.mean for one in found if one.overall is not None]
    ranked = [
        one if one.overall is None else replace(one, rank=1 + sum(other > one.overall.mean for other in overall))
        for one in found
    ]
    return sorted(ranked, key=lambda one: (one.rank or len(ranked) + 1, one.name, one.digest))


def known_policies(known: Results, rows: Rows) -> dict[str, dict[str, str]]:
    """Return the policies of which there are runs in the scenarios of rows: names by digest, by version."""
    wanted = {scenario.digest for scenario in rows.scenarios.values()}
    found = dict[str, dict[str, str]]()
    for key, result in sorted(known.by_run.items(), key=lambda item: item[0]):
        if key.scenario_digest in wanted and known.has(key):
            found.setdefault(key.version, {}).setdefault(key.policy_digest, result.policy)
    return found


def _standing(name: str, digest: str, rows: Rows, seeds: Sequence[int], known: Results, version: str) -> Standing:
    tables = {row: _shares(digest, row, rows, seeds, known, version) for row in rows.within}
    tables = {row: table for row, table in tables.items() if table.size}
    cells = {row: estimate_over([table]) for row, table in tables.items()}
    whole = len(tables) == len(rows.within)
    return Standing(name, digest, cells, estimate_over([*tables.values()]) if whole else None)


def _shares(digest: str, row: str, rows: Rows, seeds: Sequence[int], known: Results, version: str) -> Array:
    """Return scores as shares: (fires, seeds that have all runs), or (1, seeds) where the fires are no sample."""
    scenarios = [rows.scenarios[name].digest for name in rows.within[row]]
    keys = [[RunKey(scenario, digest, seed, version) for scenario in scenarios] for seed in seeds]
    whole = [of_seed for of_seed in keys if all(map(known.has, of_seed))]
    counted = [of_seed[0].seed for of_seed in whole]
    each = [
        Outcomes(counted, [known.by_run[of_seed[place]].row for of_seed in whole]).score_share
        for place in range(len(scenarios))
    ]
    table = np.array(each, dtype=np.float64).reshape(len(scenarios), len(counted))
    is_sample = row in rows.suites and rows.suites[row].sampled
    return table if is_sample else table.mean(axis=0, keepdims=True)
