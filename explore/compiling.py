"""How the numerical core is compiled: one set of Numba options, and the types of a mechanism's functions.

Functions that a sweep calls have explicit signatures, and the compiled loop takes the mechanism's functions as
first-class function types: so one loop serves all mechanisms and a second process finds everything in Numba's cache.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba import njit, types
from numba.core import sigutils
from numba.core.event import Event, Listener, install_listener

#: Designs, or nodes, that compiled functions work on at once: rows of tiles have this length, a constant, so that loops
#: over it vectorise.
LANES = 16
#: Signatures of a mechanism's compiled functions `close` and `fill`; see `explore.model.mechanism`.
CLOSE_SIGNATURE = "void(float64[::1])"
FILL_SIGNATURE = "void(float64[::1], float64[::1], int64, int64, int64, int64, int64, float64[::1])"

# Never nnan or ninf: NaN and infinities must stay visible.
_FASTMATH = {"contract", "reassoc", "nsz", "arcp"}


def compiled(
    signature: Any = None, *, fast: bool = False, contract: bool = False, inlined: bool = False, allocates: bool = False
) -> Callable[..., Any]:
    """Decorator: compile by Numba, cached on disk, without the GIL, with IEEE division.

    Parameters
    ----------
    signature
        Numba's signature; without one, the function is compiled for the types of each call.
    fast
        Allow reordering of sums and products. Not for compensated sums.
    contract
        Allow a product and a sum to be rounded once, nothing else.
    inlined
        Inline the function into every caller, so that a loop over lanes that calls it vectorises whatever its size.
    allocates
        Whether the function makes arrays. Other functions do without Numba's runtime, because its atomic reference
        counts of array arguments cost a quarter of the time of a sweep.
    """
    decorator: Callable[..., Any] = njit(
        signature,
        cache=True,
        error_model="numpy",
        nogil=True,
        forceinline=inlined,
        fastmath=_FASTMATH if fast else {"contract"} if contract else False,
        _nrt=allocates,
    )
    return decorator


def function_type(signature: str) -> Any:
    """The first-class function type of a signature."""
    arguments, result = sigutils.normalize_signature(signature)
    return types.FunctionType(result(*arguments))


@contextmanager
def announce_compilation(announce: Callable[[], None]) -> Iterator[None]:
    """Call `announce` once in the block, before Numba compiles the first function that is not in its cache."""
    with install_listener("numba:compile", _Announcer(announce)):
        yield


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
