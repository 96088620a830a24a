"""Attempts: a block that fails is tried again before it is left out."""

from collections import Counter
from collections.abc import Callable
from typing import Any

#: Number of attempts before a block is rejected. dask itself retries blocks whose worker died.
MAX_ATTEMPTS = 2


class Attempts:
    """Passes on the results of blocks, and the failures of those that failed in every attempt.

    `accept` receives a block's number and result, `reject` its number and the reason, `note` the event ``retry`` and
    its details.
    """

    def __init__(
        self, accept: Callable[[int, Any], None], reject: Callable[[int, str], None], note: Callable[..., None]
    ) -> None:
        self._accept, self._reject, self._note = accept, reject, note
        self._failures: Counter[int] = Counter()

    def settle(self, number: int, result: Any, problem: BaseException | None) -> bool:
        """Pass on a block's result or last failure; return whether the block must be tried again."""
        if problem is None:
            self._accept(number, result)
            return False
        self._failures[number] += 1
        reason = f"{type(problem).__name__}: {problem}"
        if self._failures[number] < MAX_ATTEMPTS:
            self._note("retry", block=number, problem=reason)
            return True
        self._reject(number, reason)
        return False
