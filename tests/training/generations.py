"""What tests of methods that go generation by generation have in common."""

from __future__ import annotations

from fireworld.simulation.built import CityCache, build_scenario
from fireworld.training.curriculum import load_curriculum

CONDITIONS = """
stages:
  - name: usual
    cooperation: true
    base: quick
    each: [{fires.0.n_buildings: 4}, {fires.0.n_buildings: 6}, {fires.0.n_buildings: 7}]
  - name: many
    cooperation: true
    base: quick
    set: {brigades.n: 4}
    each: [{fires.0.n_buildings: 8}, {fires.0.n_buildings: 9}]
"""
"""Five fires under two conditions."""
SHORT_EVOLUTION = {"n_generations": 2, "n_pairs": 2, "n_fires": 3, "n_steps_max": 25, "hidden": 3, "check_every": 1}
SHORT_GATES = {"n_generations": 2, "n_pairs": 2, "n_fires": 3, "n_steps_max": 25, "check_every": 1}
SHORT_ROLLOUTS = {
    "n_generations": 2,
    "n_fights": 6,
    "n_steps_max": 25,
    "hidden": 3,
    "horizon": 8,
    "commit": 3,
    "n_options": 4,
    "n_epochs": 3,
    "n_batch": 5,
    "n_checks": 1,
}
SHORT_IMITATION = {
    "n_generations": 2,
    "n_fights": 6,
    "n_steps_max": 25,
    "hidden": 3,
    "start": "best-2026",
    "horizon": 8,
    "n_epochs": 3,
    "n_batch": 5,
    "n_checks": 1,
}


def read(text, folder):
    """Return a curriculum of its text."""
    path = folder / "fires.yaml"
    path.write_text(text)
    return load_curriculum(path)


def maker(curriculum, method):
    """Return what makes trainers of a method, with other hyperparameters; cities are built once."""
    cities = CityCache()

    def make(*, seed=1, **changes):
        return method.with_settings(changes).trainer(curriculum, seed=seed, cities=cities)

    return make


def decisions(policy, scenario, *, seed=3):
    """Return what the brigades go for in a scenario, and the digest of all that comes of it, step by step."""
    world, found = build_scenario(scenario).world(seed=seed), []
    while not (world.terminated or world.truncated):
        world.step(policy)
        found.append((world.state.brigades.target.tolist(), world.digest()))
    return found
