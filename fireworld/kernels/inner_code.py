"""Inner functions, which kernels link into themselves: LLVM optimizes their code there, once, and nowhere else.

Numba by itself optimizes a function with all that it calls, makes machine code of it, and does so again for whoever
calls it: along a chain of calls most work is done many times over, for machine code that nobody runs.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite.binding import ModuleRef, parse_bitcode
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, compile_result

from fireworld.kernels.cache import KernelCache


class InnerCode(JITCodeLibrary):  # type: ignore[misc]  # numba is untyped
    """The code of an inner function and of those that it calls, as it was written down."""

    @classmethod
    def of(cls, codegen: Any, name: str, module: ModuleRef) -> InnerCode:
        """Return code that is complete."""
        code = cls(codegen, name)
        code._final_module, code._finalized = module, True
        return code

    def bitcode(self) -> bytes:
        """Return the code in LLVM's format."""
        self._ensure_finalized()
        data: bytes = self._final_module.as_bitcode()
        return data

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True


class InnerCompiler(Compiler):  # type: ignore[misc]
    """Compiles an inner function."""

    def define_pipelines(self) -> Any:
        """Return the passes, the last of which makes no machine code."""
        self.state.flags.no_compile = True
        self.state.library = InnerCode(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return super().define_pipelines()

    def compile_extra(self, function: Callable[..., Any]) -> Any:
        """Compile a function; where others have the address of machine code, it has a thing that stands for it."""
        return super().compile_extra(function)._replace(entry_point=object())


class InnerCache(KernelCache):
    """The compiled forms of one inner function."""

    def reduced(self, result: Any) -> tuple[Any, ...]:
        """Return what is kept of a compiled function."""
        result.fndesc.typemap = result.fndesc.calltypes = None  # as numba does: they may hold what has no bytes
        return result.library.bitcode(), result.fndesc, result.signature

    def rebuilt(self, target_context: Any, parts: tuple[Any, ...]) -> Any:
        """Return the compiled function again, of what was kept of it."""
        bitcode, fndesc, signature = parts
        return compile_result(
            typing_context=target_context.typing_context,
            target_context=target_context,
            entry_point=object(),
            signature=signature,
            objectmode=False,
            fndesc=fndesc,
            library=InnerCode.of(target_context.codegen(), fndesc.qualname, parse_bitcode(bitcode)),
        )
