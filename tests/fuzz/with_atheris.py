"""One fuzz test under atheris, where that is installed: `python -m tests.fuzz.with_atheris log_bytes [FLAGS]`.

atheris guides the bytes from which hypothesis makes its examples by the lines that they reach.
"""

from __future__ import annotations

import sys


def main() -> None:
    """Run until a failure, or as the flags of libFuzzer say (-max_total_time=60)."""
    import atheris  # type: ignore[import-not-found]  # not a requirement: it needs clang where there is no wheel

    with atheris.instrument_imports(include=["fireworld", "recorder"]):
        import tests.fuzz.test_files
        import tests.fuzz.test_logs  # noqa: F401  # importing them fills TARGETS
        from tests.fuzz.support import TARGETS

    name, *flags = sys.argv[1:]
    atheris.Setup([sys.argv[0], *flags], TARGETS[name].hypothesis.fuzz_one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
