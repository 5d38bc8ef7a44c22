"""One scenario, seed and policy: one digest, in every process, for every hash seed and every processor."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests.simulation.golden import RUNS, digest_of, golden

pytestmark = pytest.mark.slow

PRINT_DIGESTS = (
    "from tests.simulation.golden import RUNS, digest_of\nfor run in RUNS.values():\n    print(digest_of(*run))\n"
)


@pytest.mark.parametrize("name", RUNS)
def test_the_simulator_does_what_it_did(name):
    """Physics, rules or random draws have changed if this fails: see tests/simulation/golden.py."""
    assert digest_of(*RUNS[name]) == golden()[name]


def test_all_golden_runs_are_pinned():
    assert list(golden()) == list(RUNS)


@pytest.mark.parametrize(
    "settings",
    [
        {"PYTHONHASHSEED": "0"},
        {"PYTHONHASHSEED": "12345", "TZ": "Asia/Tokyo", "LC_ALL": "C"},
        # The inner kernels as users have them, for a processor without vector extensions; compiled once, then cached.
        {"NUMBA_CPU_NAME": "generic", "FIREWORLD_OPEN_KERNELS": "0"},
    ],
    ids=["hash-seed-0", "hash-seed-12345", "generic-processor"],
)
def test_other_processes_compute_the_same(settings):
    done = subprocess.run(
        [sys.executable, "-c", PRINT_DIGESTS], env=os.environ | settings, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert done.stdout.split() == list(golden().values())
