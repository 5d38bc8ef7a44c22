"""The two decorators of all kernels: `kernel` for functions that Python calls, `inner` for those only kernels call."""

from __future__ import annotations

import os
from typing import Final

from numba import njit

OPEN: Final = os.environ.get("FIREWORLD_OPEN_KERNELS") == "1"
"""Let Python call inner functions too. The tests do; it makes the first compilation half as long again."""

# float64 as written, kept in the cache folder, without the interpreter's lock. numpy's error model, because a test for
# zero before each division would keep loops from becoming vector instructions; no kernel divides by what can be zero.
kernel = njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
inner = njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True, no_cpython_wrapper=not OPEN)
