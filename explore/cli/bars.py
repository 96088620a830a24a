"""A progress bar of blocks, on a terminal only."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def block_bar(activity: str) -> Iterator[Callable[[int, int], None] | None]:
    """Give what is to be called with the numbers done and to be done, or None where there is no terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich import progress
    from rich.console import Console

    columns = (
        progress.TextColumn(activity),
        progress.BarColumn(),
        progress.TaskProgressColumn(),
        progress.TimeRemainingColumn(),
    )
    with progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def counted(activity: str, total: int) -> Iterator[Callable[[str], None]]:
    """A bar that goes on by one with each call of what is given."""
    with block_bar(activity) as progress:
        done = 0

        def step(_: str) -> None:
            nonlocal done
            if progress is not None:
                progress(done, total)
            done += 1

        yield step
