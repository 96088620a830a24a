"""What follows from a request alone is computed once: for one design it takes longer than the design."""

from collections.abc import Callable, Hashable
from functools import wraps
from typing import TypeVar

from explore.model.request import Request

_Result = TypeVar("_Result")


def remembered(function: Callable[..., _Result]) -> Callable[..., _Result]:
    """Decorator: keep with a request what a function of it, and of other arguments with a hash, returns."""
    name = f"{function.__module__}.{function.__qualname__}"

    @wraps(function)
    def recall(request: Request, *others: Hashable) -> _Result:
        kept: dict[tuple[Hashable, ...], _Result] = request.__dict__.setdefault(name, {})
        result = kept.get(others)  # one look-up, because metrics take long to hash
        if result is None:
            result = kept[others] = function(request, *others)
        return result

    return recall
