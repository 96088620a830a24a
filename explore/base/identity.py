"""Objects without a hash as keys of caches."""

from typing import Generic, TypeVar

_Object = TypeVar("_Object")


class Identity(Generic[_Object]):
    """An object, equal to itself alone: it has fields without a hash."""

    def __init__(self, of: _Object) -> None:
        self.of = of

    def __hash__(self) -> int:
        return id(self.of)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Identity) and other.of is self.of
