"""Columns as text in a page: bytes of the same weight together, deflated, in base64; nothing is rounded."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

#: Types that the page reads; every column fits one of them exactly.
_WHOLE = ("u1", "i1", "i4")


class Packed:
    """The texts of a page; equal ones are there once."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._known: dict[bytes, int] = {}

    def add(self, values: npt.NDArray[Any]) -> dict[str, int | str]:
        """Pack a column and say where it is: its text, type and length, and the text that says which are defined.

        Undefined values (NaN) are left out. Columns that are undefined in the same designs share that text, and a
        column without them packs much smaller.
        """
        kind = _type_of(values)
        place: dict[str, int | str] = {"type": kind, "length": len(values)}
        if kind == "f8":
            defined = ~np.isnan(values)
            if not defined.all():
                place["defined"] = self._text(defined.astype(np.uint8))
                values = values[defined]
        place["text"] = self._text(np.ascontiguousarray(values, dtype=f"<{kind}"))
        return place

    def _text(self, column: npt.NDArray[Any]) -> int:
        """Number of the text of a column without undefined values."""
        planes = column.view(np.uint8).reshape(len(column), column.itemsize).T.tobytes()
        packed = zlib.compress(planes, 6)
        if packed not in self._known:
            self._known[packed] = len(self.texts)
            self.texts.append(base64.b64encode(packed).decode("ascii"))
        return self._known[packed]


def _type_of(values: npt.NDArray[Any]) -> str:
    """The smallest of the page's types that holds the values exactly."""
    if values.dtype.kind == "f":
        return "f8"
    if values.dtype.kind == "b":
        return "u1"
    low, high = (int(values.min()), int(values.max())) if len(values) else (0, 0)
    for kind in _WHOLE:
        limits = np.iinfo(kind)
        if limits.min <= low and high <= limits.max:
            return kind
    return "f8"  # numbers of designs beyond 2^31; exact up to 2^53
