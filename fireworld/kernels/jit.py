"""The decorators of all kernels: `kernel` for functions that Python calls, `inner` for those only kernels call."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final, NoReturn

from numba import config, njit
from numba.core.registry import CPUDispatcher

from fireworld.interrupt import postponed, was_interrupted
from fireworld.kernels.cache import OPEN, KernelCache
from fireworld.kernels.inner_code import InnerCache, InnerCompiler

ROOM: Final = __name__.rpartition(".")[0] + "."
"""Modules whose sources the name of the cache folder stands for; what is compiled elsewhere is not kept."""

# float64 as written, without the interpreter's lock. numpy's error model, because a test for zero before each division
# would keep loops from becoming vector instructions; no kernel divides by what can be zero.
_how: Final = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


class _Kernel(CPUDispatcher):  # type: ignore[misc]  # numba is untyped
    """A function that is compiled when it is first called; Ctrl-C waits until LLVM is done with what it is at."""

    def compile(self, sig: object) -> Any:
        """Compile the function, or read it from the cache."""
        with postponed(), _without_collection():
            return super().compile(sig)


@contextmanager
def _without_collection() -> Iterator[None]:
    """Let garbage lie: to look for it among all that the compiler holds takes a sixth of the time of compilation."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


class _Closed(_Kernel):
    """An inner function: code for kernels, without the entry that Python would need, where numba itself would crash."""

    def __call__(self, *args: object, **kwargs: object) -> NoReturn:
        del args, kwargs
        raise TypeError(f"{self.py_func.__name__} is for kernels only; FIREWORLD_OPEN_KERNELS=1 opens it to Python")

    def add_overload(self, result: Any) -> None:
        """Keep a compiled form, for those that call it to link in."""
        self.overloads[tuple(result.signature.args)] = result
        self.targetctx.insert_user_function(result.entry_point, result.fndesc, [result.library])


class _MakingArrays(_Kernel):
    """A kernel that makes arrays: Python code runs while they are handed out, and Ctrl-C may come just then."""

    def __call__(self, *args: object) -> Any:
        try:
            return super().__call__(*args)
        except SystemError as error:
            if was_interrupted(error):
                raise KeyboardInterrupt from None
            raise


def _compiler(kind: type[_Kernel], **more: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles, whatever NUMBA_DISABLE_JIT says: plain Python computes other numbers."""

    def decorate(function: Callable[..., Any]) -> Any:
        before, config.DISABLE_JIT = config.DISABLE_JIT, 0
        try:
            compiled = njit(**_how, **more)(function)
        finally:
            config.DISABLE_JIT = before
        compiled.__class__ = kind
        if function.__module__.startswith(ROOM):
            kept = InnerCache if kind is _Closed else KernelCache
            compiled._cache = kept(function)  # noqa: SLF001 - numba has no other way to give it a cache
        return compiled

    return decorate


# Without numba's runtime, `_nrt`, which counts the references to every array: that costs more than a small kernel does,
# and a kernel makes no arrays. One that did would not compile.
kernel = _compiler(_Kernel, _nrt=False)
making_arrays = _compiler(_MakingArrays)
"""For the few kernels that make arrays."""
inner = kernel if OPEN else _compiler(_Closed, _nrt=False, no_cpython_wrapper=True, pipeline_class=InnerCompiler)
"""For functions that other kernels alone call: that spares more than half of the compilation."""
