"""Columns as text in a page: bytes of the same weight together, deflated, in base64; nothing is rounded."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

#: Types that the page reads; every column fits one of them exactly.
_TYPES = ("u1", "i1", "i4", "f8")


class Packed:
    """The texts of a page; equal columns share one."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._known: dict[bytes, int] = {}

    def add(self, values: npt.NDArray[Any]) -> dict[str, int | str]:
        """Pack a column and say where it is: its text, type and length."""
        kind = _type_of(values)
        column = np.ascontiguousarray(values, dtype=f"<{kind}")
        planes = column.view(np.uint8).reshape(len(column), -1).T.tobytes()
        text = zlib.compress(planes, 6)
        key = kind.encode() + text
        if key not in self._known:
            self._known[key] = len(self.texts)
            self.texts.append(base64.b64encode(text).decode("ascii"))
        return {"text": self._known[key], "type": kind, "length": len(column)}


def _type_of(values: npt.NDArray[Any]) -> str:
    """The smallest of the page's types that holds the values exactly."""
    if values.dtype.kind == "f":
        return "f8"
    if values.dtype.kind == "b":
        return "u1"
    low, high = (int(values.min()), int(values.max())) if len(values) else (0, 0)
    for kind in _TYPES[:-1]:
        limits = np.iinfo(kind)
        if limits.min <= low and high <= limits.max:
            return kind
    return "f8"  # numbers of designs beyond 2^31; exact up to 2^53
