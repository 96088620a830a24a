"""Progress on stderr: a bar on a terminal; elsewhere a line of a sweep now and then."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from explore.cli.output import printable, say
from explore.model.progress import ReportProgress

if TYPE_CHECKING:
    from explore.running.runs import Progress
    from explore.service.client import JobProgress

#: Time between progress lines where there is no terminal, s.
LINE_INTERVAL = 5.0


@contextmanager
def block_bar(activity: str, *, lines: bool = False) -> Iterator[ReportProgress | None]:
    """Yield a function to call with the numbers done and to be done.

    Where there is no terminal it prints a line now and then with `lines`, else it is None.
    """
    if not sys.stderr.isatty():
        tell = _lines()
        yield (lambda done, total: tell(f"{activity}: {done:,} of {total:,}", done, total - done)) if lines else None
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


def _lines() -> Callable[[str, int, int], None]:
    """A function that prints a text with the rate and the time left now and then, from what is done and left."""
    start = last = time.monotonic()

    def tell(text: str, done: int, left: int) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= LINE_INTERVAL and done:
            last = now
            rate = done / (now - start)
            say(f"{text}, {rate:,.0f}/s, {left / rate:.0f} s left")

    return tell


@contextmanager
def progress_bar(activity: str, total: int) -> Iterator[Callable[[str], None]]:
    """Yield a function to call before each of `total` steps."""
    with block_bar(activity) as progress:
        done = 0

        def step(_: str) -> None:
            nonlocal done
            if progress is not None:
                progress(done, total)
            done += 1

        yield step


@contextmanager
def sweep_progress(total: int, *, quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """Yield a function to call with the progress of a sweep of `total` designs, or None where nothing is printed."""
    if quiet:
        yield None
    elif sys.stderr.isatty():
        with _sweep_bar(total) as update:
            yield update
    else:
        tell = _lines()
        yield lambda state: tell(
            f"{state.n_done:,} of {state.n_designs:,} designs, {state.n_feasible / state.n_computed:.0%} feasible",
            state.n_computed, state.n_designs - state.n_done,
        )  # fmt: skip


@contextmanager
def _sweep_bar(total: int) -> Iterator[Callable[[Progress], None]]:
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
    start = time.monotonic()
    with progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=total, rate="", share="")

        def update(state: Progress) -> None:
            rate = state.n_computed / (time.monotonic() - start)
            share = f"{state.n_feasible / state.n_computed:.0%} feasible"
            bar.update(task, completed=state.n_done, rate=f"{rate:,.0f}/s", share=share)

        yield update


@contextmanager
def job_progress(name: str) -> Iterator[Callable[[JobProgress], None]]:
    """Yield a function to call with the progress of a job of a service, which it tells in one line or now and then."""
    if not sys.stderr.isatty():
        last, told = time.monotonic(), ""

        def tell(job: JobProgress) -> None:
            nonlocal last, told
            text = _job_text(job)
            if time.monotonic() - last >= LINE_INTERVAL and text != told:
                last, told = time.monotonic(), text
                say(f"{name}: {text}")

        yield tell
        return
    from rich.console import Console
    from rich.text import Text

    with Console(stderr=True).status(Text(f"{name}: …")) as status:
        yield lambda job: status.update(Text(printable(f"{name}: {_job_text(job)}")))


def _job_text(job: JobProgress) -> str:
    """How far a job is, or what it waits for."""
    if job.state != "running" or job.reason:
        return f"{job.state}: {job.reason}" if job.reason else job.state
    parts = []
    if job.done and job.designs:
        parts.append(f"{job.done:,} of {job.designs:,} designs")
    elif job.steps:
        parts.append(f"step {job.steps_done} of {job.steps}")
    if job.rate:
        parts.append(f"{job.rate:,.0f}/s")
    if job.seconds_left is not None:
        parts.append(f"{job.seconds_left:.0f} s left")
    return ", ".join(parts) or "running"
