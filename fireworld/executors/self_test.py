"""The self-test of a worker: a run whose digest says whether it computes as others do."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from typing import Final

from fireworld.policy.chief import chief
from fireworld.policy.kernel import at_random
from fireworld.scenario import Scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.state import take_snapshot

SEED: Final = 1
STEPS: Final = 60
SCENARIO: Final = {
    "city": {"generated": {"columns": 6, "rows": 5}},
    "fires": [{"at": [0.4, 0.6], "n_buildings": 2}],
    "brigades": {"n": 3},
    "civilians": {"n": 6},
    "steps": STEPS,
}


@lru_cache(maxsize=1)
def self_test() -> str:
    """Run a small scenario and return a digest of its city and of all that its worlds come to, 64 digits."""
    built = build_scenario(Scenario.from_dict(SCENARIO))
    content = hashlib.sha256()
    for policy in (chief(), at_random()):
        world = built.world(seed=SEED)
        world.run(policy.for_brigades(world.n_brigades))
        for name, array in sorted(take_snapshot(world.state).items()):
            content.update(f"{name} {array.dtype.str} {array.shape}".encode() + array.tobytes())
    return content.hexdigest()
