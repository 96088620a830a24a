"""Numba's compiler without the passes, and without the work, that functions of numbers and arrays do not need.

A first compilation is mostly Numba's own Python code. So passes for closures, array expressions and unrolled loops over
tuples are left out, what an operator gives for some types is remembered, functions that only compiled functions call
are not assembled by themselves, and nothing is searched for garbage. All of this rests on Numba's internals: the first
compilation of a process tries it on a small function, and where that fails, Numba compiles in its own way.
"""

import gc
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partialmethod
from typing import Any

import numba.np.linalg
import numpy as np
from llvmlite.binding import Linkage
from numba import njit, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass

#: Names of Numba's passes that are left out: for closures, inlined functions, unrolled tuples and array expressions.
_LEFT_OUT = {
    "WithLifting", "InlineClosureLikes", "RewriteDynamicRaises", "MakeFunctionToJitFunction", "InlineInlinables",
    "FindLiterallyCalls", "LiteralUnroll", "LiteralPropagationSubPipelinePass", "InlineOverloads", "NopythonRewrites",
    "NoPythonSupportedFeatureValidation", "DumpParforDiagnostics",
}  # fmt: skip
#: The pass of Numba that fills the library of a function.
_LOWERING = "NativeLowering"
#: Number of lines of LLVM code of a function from which on it is not put into its callers.
_LARGE = 1200
#: Function of Numba's runtime that counts a reference to an array.
_INCREMENT = "NRT_incref"
#: Remembered signatures of operators, by function and types of the arguments.
_signatures: dict[tuple[Any, tuple[Any, ...]], Any] = {}
#: Verdict on all this with this version of Numba; None before the first compilation.
_works: bool | None = None


class PlainCompiler(Compiler):  # type: ignore[misc]  # Numba has no types
    """Numba's compiler with few passes; with `no_alias` the arrays that a function is called with share no memory."""

    no_alias = False
    only_translates = False

    def define_pipelines(self) -> list[PassManager]:
        """Numba's pipeline, each pass once, without those that are left out."""
        self.state.flags.noalias = self.no_alias
        pipelines: list[PassManager] = super().define_pipelines()
        if not _shortcuts_work():
            return pipelines
        manager, known = PassManager("plain"), set(_LEFT_OUT)
        for each, description in pipelines[0].passes:
            if each.__name__ == _LOWERING:
                chosen = _TranslateOnly if self.only_translates else _Assemble
                manager.add_pass(chosen, "choose the kind of library")
            if each.__name__ not in known:
                manager.add_pass(each, description)
                known.add(each.__name__)
        manager.finalize()
        return [manager]


class NoAliasCompiler(PlainCompiler):
    """The compiler of functions whose arrays share no memory."""

    no_alias = True


class TranslatingCompiler(PlainCompiler):
    """The compiler of functions that only compiled functions call."""

    only_translates = True


class NoAliasTranslatingCompiler(TranslatingCompiler):
    """The same for functions whose arrays share no memory."""

    no_alias = True


def translated(function: Callable[..., Any], settings: dict[str, Any], *, no_alias: bool = False) -> Any:
    """A dispatcher that gives compiled functions the translation of a function, without an entry for Python."""
    compiler = NoAliasTranslatingCompiler if no_alias else TranslatingCompiler
    dispatcher = njit(pipeline_class=compiler, no_cpython_wrapper=True, no_cfunc_wrapper=True, **settings)(function)
    dispatcher._insert = _skip
    return dispatcher


def _skip(*_: object) -> None:
    """Do nothing."""


# Numba tries at its first compilation whether SciPy has BLAS, which loads scipy.linalg, 0.1 s. SciPy is a dependency.
numba.np.linalg.ensure_blas = _skip


class _Translation(JITCodeLibrary):  # type: ignore[misc]  # likewise
    """The translation of a function, neither linked with what it calls nor optimised nor assembled."""

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """Leave the rest to the callers."""
        self._finalize_dynamic_globals()
        self._finalized = True

    def own_module(self) -> Any:
        """The function alone."""
        return super()._get_module_for_linking()

    def _get_module_for_linking(self) -> Any:
        """All that is called is linked for callers that Numba compiles in its own way: they link this module alone."""
        module = self.own_module().clone()
        for library in _with_callees(self._linking_libraries):
            module.link_in(_module_of(library), preserve=True)
        return module

    def get_pointer_to_function(self, name: str) -> int:  # noqa: ARG002  (the signature is Numba's)
        """Return 0, which means that there is no such function."""
        return 0

    @property
    def codegen(self) -> Any:
        return _CodeGeneratorWithoutEnvironments(self._codegen)


def _with_callees(libraries: list[Any]) -> list[Any]:
    """Libraries, and those that the translations among them call, directly or not."""
    found = list(dict.fromkeys(libraries))
    for library in found:  # which grows meanwhile
        if isinstance(library, _Translation):
            found += [each for each in dict.fromkeys(library._linking_libraries) if each not in found]
    return found


def _module_of(library: Any) -> Any:
    return library.own_module() if isinstance(library, _Translation) else library._get_module_for_linking()


class _Assembly(JITCodeLibrary):  # type: ignore[misc]  # likewise
    """A function with all that it calls, which is its own: calls lose the arguments that nothing reads.

    An array is seven arguments, a tuple of arrays hundreds. Large functions stay functions, or the one that calls them
    all would take long to compile.

    Their names are in no table of symbols: there the linker would take one for a function of that name which takes all
    arguments, as libraries have that Numba compiles in its own way.
    """

    def finalize(self) -> None:
        """Link all translations that are called, directly or not, each once."""
        libraries = _with_callees(self._linking_libraries)
        for library in libraries:
            if isinstance(library, _Translation):
                self._final_module.link_in(library.own_module(), preserve=True)
        self._linking_libraries: list[Any] = [each for each in libraries if not isinstance(each, _Translation)]
        super().finalize()

    def _optimize_final_module(self) -> None:
        counts_references = False
        for function in self._final_module.functions:
            counts_references |= function.name == _INCREMENT
            if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                function.linkage = "private"
                is_inlined = any(b"alwaysinline" in attributes for attributes in function.attributes)
                if not is_inlined and str(function).count("\n") > _LARGE:
                    function.add_function_attribute("noinline")
        if counts_references:
            super()._optimize_final_module()  # which removes most counts before loops are vectorised
        else:
            passes, builder = self._codegen._module_pass_manager()
            passes.run(self._final_module, builder)


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


@register_pass(mutates_CFG=False, analysis_only=True)
class _Assemble(LoweringPass):  # type: ignore[misc]  # likewise
    """Choose the kind of library that the function is assembled in."""

    _name = "assemble"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        state.library = _Assembly(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return True


@contextmanager
def quick_compilation() -> Iterator[None]:
    """Remember what operators give, and leave garbage until later, for the holder of Numba's compiler lock.

    Numba tries all versions of an operator each time it is used. Searching the millions of objects of a compilation for
    garbage takes a tenth of its time.
    """
    function_type: Any = types.Function
    if "get_call_type" in vars(function_type):  # by an outer call
        yield
        return
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
    if keywords or not _shortcuts_work():
        return original(function, context, arguments, keywords)
    known = _signatures.get((function, arguments))
    if known is not None:
        function._impl_keys[known.args] = function.typing_key
        return known
    signature = original(function, context, arguments, keywords)
    if function._impl_keys[signature.args] is function.typing_key:
        _signatures[function, arguments] = signature
    return signature


def _shortcuts_work() -> bool:
    """Whether a small function is compiled rightly; tried once, by the holder of Numba's compiler lock."""
    global _works
    if _works is None:
        _works = True  # for the small function itself
        _works = _compiles_rightly()
    return _works


def _compiles_rightly() -> bool:
    """Compile a loop over an array that calls another function, and compare what it gives."""
    half_and_root = translated(lambda x: (0.5 * x, math.sqrt(x)), {"_nrt": False})

    def sum_of_parts(values: Any) -> Any:
        total = 0.0
        for k in range(len(values)):
            half, root = half_and_root(values[k])
            total += root if half > 1.0 else -half
        return total

    try:
        with quick_compilation():
            dispatcher = njit("float64(float64[::1])", pipeline_class=PlainCompiler, _nrt=False)(sum_of_parts)
        return bool(dispatcher(np.array([1.0, 9.0])) == -0.5 + 3.0)
    except Exception:  # whatever of Numba has changed
        return False
