"""Call a function for each number of a range, on threads of this process or on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from explore.running.in_flight import BlocksInFlight
from explore.running.threads import BlocksOnThreads, LocalThreads

if TYPE_CHECKING:
    from distributed import Client, Future


def run_tasks(
    workers: Client | LocalThreads,
    function: Callable[..., Any],
    arguments: Callable[[int], tuple[Any, ...]],
    numbers: Iterable[int],
    accept: Callable[[int, Any], None],
    reject: Callable[[int, str], None],
    note: Callable[..., None] | None = None,
    *,
    wait: Callable[[], None] | None = None,
    stop: Callable[[], None] | None = None,
) -> None:
    """Call a function with the arguments of each number, made when its turn comes; return when all are settled.

    `accept`, `reject` and `note` are as of `Attempts`, `wait` and `stop`, which a cluster does not need, as of
    `BlocksOnThreads`. Without `note` events are lost: they are logged beside results files.
    """
    note = note or _ignore
    if isinstance(workers, LocalThreads):

        def compute(number: int) -> Any:
            return function(*arguments(number))

        BlocksOnThreads(workers, compute, accept, reject, note, wait=wait, stop=stop).run(numbers)
        return

    def submit(number: int, preferred: list[str] | None) -> Future:
        # Workers may leave; without allow_other_workers the task would wait for them.
        where = {"workers": preferred, "allow_other_workers": True} if preferred else {}
        future: Future = workers.submit(function, *arguments(number), pure=False, retries=0, **where)
        return future

    BlocksInFlight(workers, submit, accept, reject, note).run(numbers)


def _ignore(event: str, **facts: object) -> None:
    """Do nothing with an event."""
