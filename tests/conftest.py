"""What all tests need before anything of fireworld is imported."""

import os

# Tests call the inner kernels one by one; see fireworld.kernels.jit.
os.environ["FIREWORLD_OPEN_KERNELS"] = "1"

pytest_plugins = ["pytester"]
