"""Compiled functions that other compiled functions call: Numba translates them and leaves the rest to their callers.

Numba links what a function calls into it and optimises all of it together. By default it also optimises and assembles
each called function by itself, for calls from Python that never come; that was most of the time of a first
compilation.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import NativeLowering

from explore.base.compiler_passes import NoAliasCompiler, PlainCompiler
from explore.base.compiling import cached, options


def subroutine(
    *,
    fast: bool = False,
    contract: bool = False,
    inlined: bool = False,
    allocates: bool = False,
    no_alias: bool = False,
) -> Any:
    """Decorator: compile as part of the compiled functions that call this one; see `compiled` for the arguments.

    The function must not raise exceptions. Called from Python, it is compiled once more by itself.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        settings = options(fast=fast, contract=contract, inlined=inlined, allocates=allocates)
        translating = _NoAliasTranslatingCompiler if no_alias else _TranslatingCompiler
        standalone = NoAliasCompiler if no_alias else PlainCompiler
        dispatcher = njit(pipeline_class=translating, no_cpython_wrapper=True, no_cfunc_wrapper=True, **settings)(
            function
        )
        dispatcher.standalone = cached(njit(cache=True, pipeline_class=standalone, **settings)(function))
        dispatcher._insert = _skip
        dispatcher._compile_for_args = lambda *_, **__: dispatcher.standalone
        resolve = dispatcher.get_call_template
        # A number that a caller writes out must not make a version of its own.
        dispatcher.get_call_template = lambda args, kws: resolve(tuple(types.unliteral(a) for a in args), kws)
        return dispatcher

    return decorate


def _skip(*_: object) -> None:
    """Do nothing."""


class _Translation(JITCodeLibrary):  # type: ignore[misc]  # Numba has no types
    """The translation of a function and of what it calls, neither optimised nor assembled."""

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        """Leave the optimisation to the callers."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:  # noqa: ARG002  (the signature is Numba's)
        """Return 0, which means that there is no such function."""
        return 0

    @property
    def codegen(self) -> Any:
        return _CodeGeneratorWithoutEnvironments(self._codegen)


class _CodeGeneratorWithoutEnvironments:
    """A code generator that sets no environment, the Python objects of a function, because there is no function."""

    def __init__(self, generator: Any) -> None:
        self._generator = generator

    def __getattr__(self, name: str) -> Any:
        return getattr(self._generator, name)

    def set_env(self, *_: object) -> None:
        """Do nothing."""


@register_pass(mutates_CFG=False, analysis_only=True)
class _TranslateOnly(LoweringPass):  # type: ignore[misc]  # likewise
    """Choose the kind of library that the function is translated into."""

    _name = "translate_only"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        state.library = _Translation(state.targetctx.codegen(), state.func_id.func_qualname)
        return True


class _TranslatingCompiler(PlainCompiler):
    """The compiler with the choice of the library before the passes that fill it."""

    _lowering = PlainCompiler.passes.index(NativeLowering)
    passes = (*PlainCompiler.passes[:_lowering], _TranslateOnly, *PlainCompiler.passes[_lowering:])


class _NoAliasTranslatingCompiler(_TranslatingCompiler):
    no_alias = True
