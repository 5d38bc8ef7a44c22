"""Digests of a few short runs: the simulator's behaviour in some lines.

A change of physics, of rules or of random draws changes them. If that is meant, renew them and say why in the commit:

    python -m tests.simulation.golden
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

from fireworld_recorder.chain import Digest

from fireworld.policy.names import find_policy
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.prepared_run import prepare_run

PATH: Final = Path(__file__).with_name("golden.json")
RUNS: Final = {
    "quick, each-another, seed 1": ("quick", "each-another", 1, 60),
    "train-5, random, seed 7": ("train-5", "random", 7, 40),
    "paper-2, random, seed 7": ("paper-2", "random", 7, 40),
    "paper-3-brigades-8, chief, seed 1": ("paper-3-brigades-8", "chief", 1, 40),
    "paper-train-5, random, seed 7": ("paper-train-5", "random", 7, 40),
}
"""Scenario, policy, seed and steps of each run."""


def digest_of(scenario: str, policy: str, seed: int, n_steps: int) -> str:
    """Run and return the digest."""
    run = prepare_run(build_scenario(load_scenario(scenario)), find_policy(policy), seed=seed, n_steps_max=n_steps)
    digest = Digest(run.city)
    for record in run:
        digest.write(record)
    return digest.digest


def golden() -> dict[str, str]:
    """Read the digests that are pinned."""
    pinned: dict[str, str] = json.loads(PATH.read_text(encoding="utf-8"))
    return pinned


def renew() -> None:
    """Pin what the simulator does now."""
    PATH.write_text(json.dumps({name: digest_of(*run) for name, run in RUNS.items()}, indent=2) + "\n", "utf-8")


if __name__ == "__main__":
    renew()
