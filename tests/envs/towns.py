"""Small scenarios for environments, decisions by a table, and the same worlds step by step."""

from __future__ import annotations

import json
import pickle
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fireworld.city.generator import generate_plan
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy, from_tables
from fireworld.policy.words import RADIX
from fireworld.scenario import Scenario, find_scenario
from fireworld.simulation.built import BuiltScenario, build_scenario
from fireworld.simulation.world import World
from tests.city.plans import dump_plan

SMALL: dict[str, Any] = {
    "name": "small",
    "city": {"generated": {"columns": 8, "rows": 6, "seed": 2, "hydrant_share": 0.5}},
    "fires": [{"at": [0.2, 0.3], "n_buildings": 3}, {"at": [0.8, 0.8], "n_buildings": 2}],
    "civilians": {"n": 4, "seed": 3},
    "brigades": {"n": 3},
    "parameters": {"brigades": {"tank_litres": 4000}},
    "steps": 25,
}
"""Some of its runs put the fire out, others are truncated."""
LATER: dict[str, Any] = {
    **SMALL,
    "name": "later",
    "city": {"generated": {"columns": 7, "rows": 4, "seed": 4}},
    "fires": [{"at": [0.5, 0.5]}, {"at": [0.1, 0.9], "step": 12}, {"at": [0.9, 0.1], "step": 31}],
    "brigades": {"n": 5},
    "steps": 30,
}
"""A fire is lit when the first one may be out, another one after the last step."""
HOT: dict[str, Any] = {**SMALL, "name": "hot", "fires": [{"at": [0.5, 0.5], "n_buildings": 8}], "brigades": {"n": 2}}
"""It burns to the last step."""
TABLES = np.random.default_rng(1).normal(size=(5, 4320, 4))
"""What brigades follow, one each: it differs from state to state."""


def deadly(folder: Path) -> dict[str, Any]:
    """Return a scenario in which brigades die: the refuges burn, and tanks are empty after two steps."""
    plan = generate_plan(columns=6, rows=5, seed=2)
    city = dump_plan(plan)
    for building in city["buildings"]:
        building["inflammable"] = True
    (folder / "deadly.json").write_text(json.dumps(city), encoding="utf-8")
    refuge = next(building["id"] for building in city["buildings"] if building["type"] == "refuge")
    return {
        **SMALL,
        "name": "deadly",
        "city": {"file": str(folder / "deadly.json")},
        "fires": [{"buildings": [refuge]}, {"at": [0.5, 0.5], "n_buildings": 6}],
        "parameters": {
            "brigades": {"tank_litres": 1000},
            "health": {"brigade_share": 1.0, "slight_damage": 700.0, "slight_probability": 0.3},
        },
    }


@cache
def _built(text: str) -> BuiltScenario:
    return build_scenario(Scenario.from_dict(json.loads(text)))


def built(scenario: dict[str, Any], choices: str = "simultaneous") -> BuiltScenario:
    """Build a scenario, once in all tests."""
    return _built(json.dumps({**scenario, "choices": choices}))


def table_policy(n_brigades: int) -> KernelPolicy:
    return from_tables(TABLES[:n_brigades])


def by_table(features: Array, alive: Array) -> Array:
    """Return what the tables say of features, (..., b, 8): actions (..., b)."""
    del alive
    state = np.ravel_multi_index(tuple(np.moveaxis(features.astype(np.int64), -1, 0)), RADIX)
    found: Array = TABLES[np.arange(features.shape[-2]), state].argmax(axis=-1)
    return found


def looked(world: World) -> World:
    """Return a copy of a world, in the moment when its brigades look."""
    copied = world.copy()
    copied.look()
    return copied


def reference(scenario: dict[str, Any], seed: int, choices: str = "simultaneous", steps: int | None = None) -> World:
    """Return a world of a scenario that the tables have run to its end."""
    world = built(scenario, choices).world(seed=seed, n_steps_max=steps)
    world.run(table_policy(world.n_brigades).for_brigades(world.n_brigades))
    return world


def shipped(name: str, **values: Any) -> Scenario:
    return find_scenario(name).with_values(values)


def pickled(value: Any) -> Any:
    """Return what comes out of a pickle."""
    return pickle.loads(pickle.dumps(value))  # noqa: S301 - our own
