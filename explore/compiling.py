"""How the numerical core is compiled: one set of Numba options, and the types of a mechanism's functions.

Functions that a sweep calls have explicit signatures, and the compiled loop takes the mechanism's functions as
first-class function types: so one loop serves all mechanisms and a second process finds everything in Numba's cache.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit, types
from numba.core import sigutils

#: Signatures of a mechanism's compiled functions `fill` and `pieces`.
FILL_SIGNATURE = "void(float64[::1], float64[::1], float64[::1], int64, int64, float64[:, ::1])"
PIECES_SIGNATURE = "int64(float64[::1], int64, int64, float64, float64, float64[:, ::1])"

# Never nnan or ninf: NaN and infinities must stay visible.
_FASTMATH = {"contract", "reassoc", "nsz", "arcp"}


def compiled(signature: Any = None, *, fast: bool = False, allocates: bool = False) -> Callable[..., Any]:
    """Decorator: compile by Numba, cached on disk, without the GIL, with IEEE division.

    Parameters
    ----------
    signature
        Numba's signature; the function is compiled for the types it is called with unless given.
    fast
        Allow reordering of sums and products, so that loops over nodes vectorise. Not for compensated sums.
    allocates
        Whether the function makes arrays. The others do without Numba's runtime: its atomic reference counts of array
        arguments cost a quarter of the time of a sweep.
    """
    decorator: Callable[..., Any] = njit(
        signature,
        cache=True,
        error_model="numpy",
        nogil=True,
        fastmath=_FASTMATH if fast else False,
        _nrt=allocates,
    )
    return decorator


def function_type(signature: str) -> Any:
    """The first-class function type of a signature."""
    arguments, result = sigutils.normalize_signature(signature)
    return types.FunctionType(result(*arguments))
