"""The passes of Numba's compiler that functions of numbers and arrays need, and types that it would find out again.

A first compilation is mostly Numba's own Python code. So passes for closures, array expressions and unrolled loops over
tuples are left out, what an operator gives for some types is remembered, and nothing is searched for garbage.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partialmethod
from typing import Any

from numba.core import types
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager
from numba.core.typed_passes import (
    AnnotateTypes,
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.untyped_passes import (
    DeadBranchPrune,
    FixupArgs,
    GenericRewrites,
    IRProcessing,
    ReconstructSSA,
    RewriteSemanticConstants,
    TranslateByteCode,
)

#: Remembered signatures of operators, by function and types of the arguments.
_signatures: dict[tuple[Any, tuple[Any, ...]], Any] = {}

_PASSES = (
    TranslateByteCode, FixupArgs, IRProcessing, RewriteSemanticConstants, DeadBranchPrune, GenericRewrites,
    ReconstructSSA, NopythonTypeInference, PreLowerStripPhis, IRLegalization, AnnotateTypes, NativeLowering,
    NoPythonBackend,
)  # fmt: skip


class PlainCompiler(CompilerBase):  # type: ignore[misc]  # Numba has no types
    """Numba's compiler with few passes.

    Attributes
    ----------
    no_alias
        Whether the arrays that the function is called with share no memory, so that loops need not test for that.
    """

    passes: tuple[Any, ...] = _PASSES
    no_alias = False

    def define_pipelines(self) -> list[PassManager]:
        """One pipeline, of `passes`."""
        manager = PassManager("plain")
        for each in self.passes:
            manager.add_pass(each)
        manager.finalize()
        self.state.flags.noalias = self.no_alias
        return [manager]


class NoAliasCompiler(PlainCompiler):
    """The compiler of functions whose arrays share no memory."""

    no_alias = True


@contextmanager
def quick_compilation() -> Iterator[None]:
    """Remember what operators give, and leave garbage until later, for the holder of Numba's compiler lock.

    Numba tries all versions of an operator each time it is used. Searching the millions of objects of a compilation for
    garbage takes a tenth of its time.
    """
    function_type: Any = types.Function
    was_enabled, original = gc.isenabled(), function_type.get_call_type
    gc.disable()
    function_type.get_call_type = partialmethod(_remembered_signature, original)
    try:
        yield
    finally:
        del function_type.get_call_type  # that of its base is what there was
        if was_enabled:
            gc.enable()


def _remembered_signature(function: Any, original: Any, context: Any, arguments: Any, keywords: Any) -> Any:
    """The signature of an operator or a built-in function for these types of arguments.

    Those of functions that Numba has in Python are not: which version serves depends on the options of the caller.
    """
    known = None if keywords else _signatures.get((function, arguments))
    if known is not None:
        function._impl_keys[known.args] = function.typing_key
        return known
    signature = original(function, context, arguments, keywords)
    if not keywords and function._impl_keys[signature.args] is function.typing_key:
        _signatures[function, arguments] = signature
    return signature
