"""Run the fuzz tests for some time, each turn with other examples: `python -m tests.fuzz --seconds 60 [NAME...]`."""

from __future__ import annotations

import argparse
import itertools
import os
import sys
import time

from hypothesis import seed

os.environ.setdefault("FIREWORLD_FUZZ_EXAMPLES", "150")  # before it is read, by the next import
from tests.fuzz.support import TARGETS


def main() -> None:
    """Go round the tests until the time is over; the first failure ends it, with the example that shows it."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=main.__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--first-seed", type=int, default=0, help="of the first turn")
    parser.add_argument("names", nargs="*", help="only these tests")
    arguments = parser.parse_args()
    import tests.fuzz.test_files
    import tests.fuzz.test_logs
    import tests.fuzz.test_maps
    import tests.fuzz.test_networks
    import tests.fuzz.test_onnx
    import tests.fuzz.test_osm
    import tests.fuzz.test_tables  # noqa: F401  # importing them fills TARGETS

    end = time.monotonic() + arguments.seconds
    for turn in itertools.count(arguments.first_seed):
        for name in arguments.names or TARGETS:
            if time.monotonic() > end:
                return
            sys.stderr.write(f"seed {turn}: {name}\n")
            seed(turn)(TARGETS[name])()


if __name__ == "__main__":
    main()
