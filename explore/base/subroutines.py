"""Compiled functions that other compiled functions call: Numba translates them and leaves the rest to their callers.

Numba links what a function calls into it and optimises all of it together. By default it also optimises and assembles
each called function by itself, for calls from Python that never come; that was most of the time of a first
compilation.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

from numba import njit

from explore.base.compiler_passes import NoAliasCompiler, PlainCompiler, translated
from explore.base.compiling import cached, options, without_literals


def subroutine(
    *,
    fast: bool = False,
    contract: bool = False,
    inlined: bool = False,
    allocates: bool = False,
    no_alias: bool = False,
) -> Any:
    """Decorator: compile as part of the compiled functions that call this one; see `compiled` for the arguments.

    `inlined` puts the function into every caller, so that a loop over lanes that calls it vectorises whatever its size.
    It must not raise exceptions. Called from Python, it is compiled once more by itself.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        settings = options(fast=fast, contract=contract, inlined=inlined, allocates=allocates)

        @cache
        def standalone() -> Any:
            compiler = NoAliasCompiler if no_alias else PlainCompiler
            return cached(njit(cache=True, pipeline_class=compiler, **settings)(function))

        dispatcher = without_literals(translated(function, settings, no_alias=no_alias))
        dispatcher.standalone = standalone
        dispatcher._compile_for_args = lambda *_, **__: standalone()
        return dispatcher

    return decorate
