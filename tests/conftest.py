"""What all tests need before anything of fireworld is imported."""

import os

# Tests call the inner kernels one by one; see fireworld.kernels.jit.
os.environ["FIREWORLD_OPEN_KERNELS"] = "1"

# What CI systems and people set to change how pytest and rich print: the tests read what is printed without them.
for name in (
    "CI",
    "BUILD_NUMBER",
    "PYTEST_ADDOPTS",
    "PY_COLORS",
    "FORCE_COLOR",
    "NO_COLOR",
    "TTY_COMPATIBLE",
    "TTY_INTERACTIVE",
    "COLUMNS",
    "LINES",
):
    os.environ.pop(name, None)

pytest_plugins = ["pytester"]
