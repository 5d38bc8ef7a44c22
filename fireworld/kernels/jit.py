"""The decorators of all kernels: `kernel` for functions that Python calls, `inner` for those only kernels call."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, Final, NoReturn

from numba import config, njit
from numba.core.registry import CPUDispatcher

OPEN: Final = os.environ.get("FIREWORLD_OPEN_KERNELS") == "1"
"""Let Python call inner functions too. The tests do; it makes the first compilation half as long again."""

# float64 as written, kept in the cache folder, without the interpreter's lock. numpy's error model, because a test for
# zero before each division would keep loops from becoming vector instructions; no kernel divides by what can be zero.
_how: Final = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def _compiler(**more: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles, whatever NUMBA_DISABLE_JIT says: plain Python computes other numbers."""

    def decorate(function: Callable[..., Any]) -> Any:
        before, config.DISABLE_JIT = config.DISABLE_JIT, 0
        try:
            return njit(**_how, **more)(function)
        finally:
            config.DISABLE_JIT = before

    return decorate


# Without numba's runtime, `_nrt`, which counts the references to every array: that costs more than a small kernel does,
# and a kernel makes no arrays. One that did would not compile.
kernel = _compiler(_nrt=False)
_closed = _compiler(_nrt=False, no_cpython_wrapper=True)
_open_inlined = _compiler(_nrt=False, forceinline=True)
_closed_inlined = _compiler(_nrt=False, no_cpython_wrapper=True, forceinline=True)
making_arrays = _compiler()
"""For the few kernels that make arrays."""


class _Closed(CPUDispatcher):  # type: ignore[misc]  # numba is untyped
    """An inner function: compiled code without the entry that Python would need, where numba itself would crash."""

    def __call__(self, *args: object, **kwargs: object) -> NoReturn:
        del args, kwargs
        raise TypeError(f"{self.py_func.__name__} is for kernels only; FIREWORLD_OPEN_KERNELS=1 opens it to Python")


def inner(function: Callable[..., Any]) -> Any:
    """Compile a function for other kernels alone: that spares a third of the compilation."""
    return kernel(function) if OPEN else _close(_closed(function))


def inlined(function: Callable[..., Any]) -> Any:
    """Compile as `inner` does, into the code of those that call it, however long it is.

    For what is called often and hands groups of arrays on to what is called seldom. The compiler would leave it a
    function by itself, because of the many arrays, and to hand them over can take longer than the work.
    """
    return _open_inlined(function) if OPEN else _close(_closed_inlined(function))


def _close(function: Any) -> Any:
    function.__class__ = _Closed
    return function
