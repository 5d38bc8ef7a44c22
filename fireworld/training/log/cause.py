"""Why two trainings can differ: another curriculum, method, seed or simulator."""

from __future__ import annotations

from itertools import zip_longest

from fireworld.cause import SIMULATOR, Cause, cause_of, scenario_changes, simulator_changes, value_changes, with_digest
from fireworld.training.log.first_difference import Trained


def training_cause(a: Trained, b: Trained) -> Cause:
    """Compare what training B was made of with what training A was made of."""
    one, other = a.header, b.header
    seeds = [] if one.seed == other.seed else [f"{other.seed}, was {one.seed}"]
    simulators = (one.fireworld_version, one.simulator_digest), (other.fireworld_version, other.simulator_digest)
    return cause_of(
        {
            "curriculum": _curriculum_changes(a, b),
            "method": value_changes(a.method.as_dict(), b.method.as_dict()),
            "seed": seeds,
            SIMULATOR: simulator_changes(*simulators),
        }
    )


def _curriculum_changes(a: Trained, b: Trained) -> list[str]:
    """Compare curricula scenario by scenario and key by key."""
    one, other = a.header, b.header
    if one.curriculum_digest == other.curriculum_digest:
        return []
    names = [scenario.name for scenario in a.scenarios], [scenario.name for scenario in b.scenarios]
    changes = [f"scenario {y}, was {x}" for x, y in zip_longest(*names, fillvalue="none") if x != y]
    for x, y in zip(a.scenarios, b.scenarios, strict=False):
        changes += scenario_changes(x, y, prefix=y.name) if x.name == y.name else []
    digests = (with_digest(header.curriculum, header.curriculum_digest) for header in (other, one))
    return changes or [", was ".join(digests)]
