"""The fuzz tests under atheris, one after another: `python -m tests.fuzz.with_atheris --seconds 60 [NAME...]`.

atheris guides the bytes from which hypothesis makes its examples by the lines that they reach. It is not installed with
the rest: there are wheels for few systems (`pip install 'fireworld[fuzz]'`).
"""

from __future__ import annotations

import argparse
import subprocess
import sys


def main() -> int:
    """Give every test the same share of the time, in a process of its own; the first failure ends it."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.with_atheris", description=main.__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--here", action="store_true", help="run the one test named in this process, which it ends")
    parser.add_argument("names", nargs="*", help="only these tests")
    arguments = parser.parse_args()
    import atheris  # not a requirement: see above

    with atheris.instrument_imports(include=["fireworld", "recorder"]):
        import tests.fuzz.test_files
        import tests.fuzz.test_logs
        import tests.fuzz.test_networks
        import tests.fuzz.test_tables  # noqa: F401  # importing them fills TARGETS
        from tests.fuzz.support import TARGETS

    names = arguments.names or list(TARGETS)
    if arguments.here:
        (name,) = names
        limits = [f"-max_total_time={max(1, round(arguments.seconds))}", "-print_final_stats=0", "-verbosity=0"]
        atheris.Placement([sys.argv[0], *limits], TARGETS[name].hypothesis.fuzz_one_input)
        atheris.Fuzz()
    share = f"{arguments.seconds / len(names):.0f}"
    for name in names:
        sys.stderr.write(f"atheris: {name}\n")
        command = [sys.executable, "-m", "tests.fuzz.with_atheris", "--here", "--seconds", share, name]
        if status := subprocess.run(command, check=False).returncode:
            return status
    return 0


if __name__ == "__main__":
    sys.exit(main())
