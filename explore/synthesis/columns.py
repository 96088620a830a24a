"""Arrays of one length, whose rows are linkages or what is known of them."""

from collections.abc import Iterable
from typing import Any, Self

import numpy as np


class Columns:
    """A dataclass whose fields are arrays of one length."""

    def rows(self, chosen: Any) -> Self:
        """Some of the rows, by an index of NumPy."""
        return type(self)(*(column[chosen] for column in vars(self).values()))

    @classmethod
    def joined(cls, parts: Iterable[Self]) -> Self:
        """All rows of the parts."""
        columns = zip(*(vars(part).values() for part in parts), strict=True)
        return cls(*(np.concatenate(column) for column in columns))
