"""How the numerical core is compiled: one set of Numba options, and the types of a mechanism's functions.

Functions that a sweep calls have explicit signatures, and the compiled loop takes the mechanism's functions as
first-class function types: so one loop serves all mechanisms and a second process finds everything in Numba's cache.
"""

import re
from collections.abc import Callable
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba import njit, types
from numba.core import sigutils
from numba.core.caching import IndexDataCacheFile
from numba.core.compiler_lock import global_compiler_lock
from numba.core.event import Event, Listener, register, unregister
from numba.extending import typeof_impl

from explore.base.compiler_passes import NoAliasCompiler, PlainCompiler, quick_compilation

#: Length of a row of a tile: the designs, or nodes, that compiled functions work on at once.
LANES = 16

# Signatures of a mechanism's compiled functions `close`, `fill` and `integrals`; see `explore.model.mechanism`.
CLOSE_SIGNATURE = "void(float64[::1])"
FILL_SIGNATURE = "void(float64[::1], float64[::1], int64, int64, int64, int64, int64, float64[::1])"
INTEGRALS_SIGNATURE = "void(float64[::1], float64[::1], float64[::1], float64[::1])"

#: Number of rows that `integrals` fills for each signal: mean, variance, and bounds of their errors.
INTEGRALS = 4

_PACKAGE = Path(__file__).parents[1]

#: An import in the text of a module: leading dots, module and names of `from`, or the module of `import`.
_IMPORT = re.compile(r"^[ \t]*(?:from (\.*)([\w.]*) import (\([^)]*\)|[^\n]*)|import ([\w.]+))", re.MULTILINE)

# Never nnan or ninf: NaN and infinities must stay visible.
_FASTMATH = {"contract", "reassoc", "nsz", "arcp"}


def compiled(
    signature: Any = None,
    *,
    fast: bool = False,
    contract: bool = False,
    allocates: bool = False,
    no_alias: bool = False,
) -> Callable[..., Any]:
    """Decorator: compile by Numba, cached on disk, without the GIL, with IEEE division.

    The function is compiled for `signature` at its first call, or for the types of each call. `fast` allows reordering
    of sums and products, not for compensated sums; `contract` that a product and a sum are rounded once, nothing else.
    Functions that do not make arrays (`allocates`) do without Numba's runtime, because its atomic reference counts of
    array arguments cost a quarter of the time of a sweep. With `no_alias` its arrays share no memory, unless it only
    reads them, or writes the same numbers to both: short loops then need not test for that, which would take longer
    than the loops.
    """
    settings = options(fast=fast, contract=contract, inlined=False, allocates=allocates)

    def decorate(function: Callable[..., Any]) -> Any:
        compiler = NoAliasCompiler if no_alias else PlainCompiler
        dispatcher = without_literals(cached(njit(cache=True, pipeline_class=compiler, **settings)(function)))
        if signature is not None:
            dispatcher._compile_for_args = partial(_compile_and_call, dispatcher, signature)
        return dispatcher

    return decorate


def _compile_and_call(dispatcher: Any, signature: Any, *_arguments: object) -> Any:
    """Compile for the signature, at the first call, and return what is to be called: the dispatcher, as if it was.

    Other threads wait: a second compilation, for the types of their arguments, would be refused. A function that was
    compiled for a caller in compiled code has an overload already, but takes no function of another type until it may
    not be compiled any more.
    """
    with global_compiler_lock, quick_compilation():
        if dispatcher._can_compile:
            dispatcher.compile(signature)
            dispatcher.disable_compile()
    return dispatcher


def address_of(dispatcher: Any, signature: Any) -> int:
    """The address of a compiled function, for callers with the calling convention of C."""
    with global_compiler_lock, quick_compilation():
        result = dispatcher.get_compile_result(signature)
        address: int = result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name)
    return address


class FunctionArgument(types.WrapperAddressProtocol):  # type: ignore[misc]  # Numba has no types
    """A function as an argument of compiled ones, with its type, which Numba would make at every call."""

    def __init__(self, signature: str) -> None:
        self.type = function_type(signature)

    def signature(self) -> Any:
        """Numba's signature."""
        return self.type.signature


@typeof_impl.register(FunctionArgument)  # type: ignore[untyped-decorator]  # likewise
def _type_of(argument: FunctionArgument, _: object) -> Any:
    return argument.type


class _CompiledArgument(FunctionArgument):
    """A compiled function as an argument of others, with its address, which Numba would look up at every call."""

    def __init__(self, dispatcher: Any, signature: str) -> None:
        super().__init__(signature)
        self._dispatcher, self._address = dispatcher, 0

    def __wrapper_address__(self) -> int:
        """The address of the machine code."""
        self._address = self._address or address_of(self._dispatcher, self.type.signature)
        return self._address


def as_argument(function: Any, signature: str) -> Any:
    """A function of a mechanism as what compiled functions take."""
    return function if isinstance(function, types.WrapperAddressProtocol) else _argument_of(function, signature)


@cache
def _argument_of(function: Any, signature: str) -> _CompiledArgument:
    """A compiled function as an argument; those of tables are not kept, because there is no end of them."""
    return _CompiledArgument(function, signature)


def options(*, fast: bool, contract: bool, inlined: bool, allocates: bool) -> dict[str, Any]:
    """Numba's options; see `compiled`."""
    return {
        "error_model": "numpy",
        "nogil": True,
        "forceinline": inlined,
        "fastmath": _FASTMATH if fast else {"contract"} if contract else False,
        "_nrt": allocates,
    }


def without_literals(dispatcher: Any) -> Any:
    """Let a number that a compiled caller writes out make no version of its own."""
    resolve = dispatcher.get_call_template
    dispatcher.get_call_template = lambda args, kws: resolve(tuple(map(types.unliteral, args)), kws)
    return dispatcher


def cached(dispatcher: Any) -> Any:
    """Let Numba's cache of a function notice changes of the modules whose code or constants it may hold."""
    dispatcher._cache._cache_file.__class__ = _IndexFile
    dispatcher._cache._cache_file.source = Path(dispatcher.py_func.__code__.co_filename)
    return dispatcher


class _IndexFile(IndexDataCacheFile):  # type: ignore[misc]  # Numba has no types
    """An index of Numba's cache that is valid for a content of the source, not for a time of its last change."""

    source: Path

    @property
    def _source_stamp(self) -> str:
        return _source_digest(self.source)

    @_source_stamp.setter
    def _source_stamp(self, stamp: object) -> None:
        """Ignore Numba's own stamp, which knows one file only."""

    def _load_index(self) -> Any:
        """Read the index; it is empty where a class among the types of arguments has been moved or removed."""
        try:
            return super()._load_index()
        except (AttributeError, ImportError):
            return {}


@cache
def _source_digest(path: Path) -> str:
    """A digest of a module and of all that it imports, directly or not, from this package or its own."""
    sources, waiting = {path: _source(path)}, [path]
    while waiting:
        found = _imported(waiting.pop()) - sources.keys()
        sources.update((module, _source(module)) for module in found)
        waiting += found
    return sha256(b"".join(sources[module] + module.name.encode() for module in sorted(sources))).hexdigest()


@cache
def _source(path: Path) -> bytes:
    """The text of a module; nothing where it has no file, as in an interactive session."""
    return path.read_bytes() if path.is_file() else b""


@cache
def _imported(path: Path) -> set[Path]:
    """Modules of this package, or of the package of the module at `path`, that it imports anywhere in its text."""
    packages = [folder for folder in path.parents if (folder / "__init__.py").is_file()]
    roots = {folder.name: folder.parent for folder in [_PACKAGE, *packages[-1:]]}
    found = set()
    for dots, module, names, plain in _IMPORT.findall(_source(path).decode()):
        base = path.parents[len(dots) - 1] if dots else roots.get((plain or module).partition(".")[0])
        if base is not None:
            modules = [plain] if plain else [module, *(f"{module}.{name}" for name in re.findall(r"\w+", names))]
            files = [base.joinpath(*name.split(".")) for name in modules]
            found |= {file.with_suffix(".py") for file in files} | {file / "__init__.py" for file in files}
    return {file for file in found if file.is_file()} - {_PACKAGE / "__init__.py"}


def function_type(signature: str) -> Any:
    """The first-class function type of a signature."""
    arguments, result = sigutils.normalize_signature(signature)
    return types.FunctionType(result(*arguments))


def announce_compilation(announce: Callable[[], None]) -> Callable[[], None]:
    """Call `announce` before Numba compiles the first function that is not in its cache; returns what ends that."""
    announcer = _Announcer(announce)
    register("numba:compile", announcer)
    return lambda: unregister("numba:compile", announcer)


class _Announcer(Listener):  # type: ignore[misc]  # Numba has no types
    """Calls a function at the first compilation."""

    def __init__(self, announce: Callable[[], None]) -> None:
        self._announce, self._announced = announce, False

    def on_start(self, event: Event) -> None:  # noqa: ARG002  (the signature is Numba's)
        if not self._announced:
            self._announced = True
            self._announce()

    def on_end(self, event: Event) -> None:
        """Do nothing at the end of a compilation."""
