"""How far a sweep is: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from explore.cli.output import say

if TYPE_CHECKING:
    from explore.sweeping.runs import Progress

#: Seconds between progress lines where there is no terminal.
LINE_INTERVAL = 5.0


@contextmanager
def sweep_progress(total: int, *, quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """A bar on a terminal, a line now and then elsewhere."""
    if quiet:
        yield None
    elif sys.stderr.isatty():
        with _bar(total) as update:
            yield update
    else:
        yield _lines()


@contextmanager
def _bar(total: int) -> Iterator[Callable[[Progress], None]]:
    from rich import progress
    from rich.console import Console

    columns = (
        progress.TextColumn("{task.completed:,.0f} of {task.total:,.0f} designs"),
        progress.BarColumn(),
        progress.TaskProgressColumn(),
        progress.TextColumn("{task.fields[rate]}"),
        progress.TextColumn("{task.fields[share]}"),
        progress.TimeRemainingColumn(),
    )
    begun = time.monotonic()
    with progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=total, rate="", share="")

        def update(state: Progress) -> None:
            rate = state.computed / (time.monotonic() - begun)
            share = f"{state.feasible / state.computed:.0%} feasible"
            bar.update(task, completed=state.done, rate=f"{rate:,.0f}/s", share=share)

        yield update


def _lines() -> Callable[[Progress], None]:
    begun = last = time.monotonic()

    def update(state: Progress) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last < LINE_INTERVAL:
            return
        last = now
        rate = state.computed / (now - begun)
        left = (state.total - state.done) / rate
        say(
            f"{state.done:,} of {state.total:,} designs, {rate:,.0f}/s, "
            f"{state.feasible / state.computed:.0%} feasible, {left:.0f} s left"
        )

    return update
