"""Columns as text in a page: bytes of equal significance together, deflated, in base64; without loss."""

import base64
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

#: Integer types that the page reads, by size.
_INTEGER_TYPES = ("u1", "i1", "i4")


class ColumnPacker:
    """Packs columns into the texts of a page, base64; equal columns share one text."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._numbers: dict[bytes, int] = {}

    def add(self, values: npt.NDArray[Any]) -> dict[str, int | str]:
        """Pack a column; returns its type, length, number of its text, and that of the text of its defined values.

        NaN is left out: the remaining values deflate much better, and columns that are undefined in the same designs
        share the text that marks the defined values.
        """
        kind = _smallest_type(values)
        packed: dict[str, int | str] = {"type": kind, "length": len(values)}
        if kind == "f8":
            defined = ~np.isnan(values)
            if not defined.all():
                packed["defined"] = self._text(defined.astype(np.uint8))
                values = values[defined]
        packed["text"] = self._text(np.ascontiguousarray(values, dtype=f"<{kind}"))
        return packed

    def _text(self, column: npt.NDArray[Any]) -> int:
        """Number of the text of a column without NaN."""
        planes = column.view(np.uint8).reshape(len(column), column.itemsize).T.tobytes()
        deflated = zlib.compress(planes, 6)
        if deflated not in self._numbers:
            self._numbers[deflated] = len(self.texts)
            self.texts.append(base64.b64encode(deflated).decode("ascii"))
        return self._numbers[deflated]


def _smallest_type(values: npt.NDArray[Any]) -> str:
    """The smallest type of the page that holds the values exactly."""
    if values.dtype.kind == "f":
        return "f8"
    if values.dtype.kind == "b":
        return "u1"
    low, high = (int(values.min()), int(values.max())) if len(values) else (0, 0)
    for kind in _INTEGER_TYPES:
        limits = np.iinfo(kind)
        if limits.min <= low and high <= limits.max:
            return kind
    return "f8"  # design numbers from 2^31 on; exact up to 2^53
