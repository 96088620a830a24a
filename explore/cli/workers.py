"""The workers of a command that computes results: its options, their connection, and what is printed meanwhile."""

from __future__ import annotations

import logging
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.base.errors import RequestError
from explore.cli.output import announce_compiling, complain, count_of, number, say
from explore.cli.progress import sweep_progress
from explore.cli.termination import terminable

if TYPE_CHECKING:
    from distributed import Client

    from explore.model.request import Request
    from explore.running.runs import Progress, Summary
    from explore.running.threads import LocalThreads

    Workers = AbstractContextManager[Client | LocalThreads]

WorkersOption = Annotated[
    int | None,
    typer.Option(min=1, help="Number of threads (processes with --processes); default: one per processor."),
]
ProcessesOption = Annotated[bool, typer.Option("--processes", help="Work in processes, not in threads.")]
SchedulerOption = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Work on a dask cluster, such as tcp://host:8786.")
]
VerboseOption = Annotated[bool, typer.Option("--verbose", "-v", help="Show the log as it is written.")]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print only warnings and errors.")]


@dataclass(frozen=True)
class WorkerOptions:
    """The options of the workers and of what is printed while they work."""

    workers: int | None
    processes: bool = False
    scheduler: str | None = None
    quiet: bool = False

    def __post_init__(self) -> None:
        if self.scheduler is not None and (self.workers is not None or self.processes):
            raise RequestError("--scheduler brings its own workers; leave out --workers and --processes")

    def prepare(self, request: Request) -> Workers:
        """The workers for a request, whose kernels are compiled first if this process needs them."""
        from explore.running.workers import start_workers

        if not self.quiet:
            announce_compiling()
        return start_workers(request, self.workers, processes=self.processes, scheduler=self.scheduler)

    @contextmanager
    def computing(
        self, request: Request, n_designs: int, safe: str
    ) -> Iterator[tuple[Workers, Callable[[Progress], None] | None]]:
        """The workers, and a function for the progress, for as long as the command computes so many designs.

        A cluster that may fail to connect is connected at once: before anything is written. After an interrupt the
        command ends, and `safe` says what was kept.
        """
        # dask's event loops may stop with an unfinished future, which asyncio logs on stderr.
        logging.getLogger("asyncio").setLevel(logging.CRITICAL + 1)
        workers = self.prepare(request)
        try:
            with terminable(), self._ready(workers) as ready, sweep_progress(n_designs, quiet=self.quiet) as progress:
                yield ready, progress
        except KeyboardInterrupt:
            say(f"interrupted; {safe}")
            raise typer.Exit(130) from None

    @contextmanager
    def _ready(self, workers: Workers) -> Iterator[Workers]:
        if self.scheduler is None:
            yield workers
            return
        with workers as client:
            yield nullcontext(client)


def same_command() -> str:
    """The command line that continues this one: the same without --restart."""
    return shlex.join(["explore", *(word for word in sys.argv[1:] if word != "--restart")])


def say_computed(summary: Summary, more: str = "") -> None:
    """Say how many designs were computed and how fast, and where they are."""
    if summary.n_computed == 0 and not summary.failures:
        say(f"{summary.path} is complete already: {count_of(summary.n_designs, 'design')}")
        return
    rate = summary.n_computed / summary.seconds
    resumed = f", {summary.n_resumed:,} were there" if summary.n_resumed else ""
    say(
        f"{count_of(summary.n_computed, 'design')} in {summary.seconds:.1f} s ({rate:,.0f}/s){resumed}; "
        f"{summary.n_feasible:,} feasible{more} -> {summary.path}"
    )


class EventPrinter:
    """Print events of a run: all with -v, else only what the user may have to act on."""

    def __init__(self, *, verbose: bool) -> None:
        self._verbose = verbose

    def __call__(self, event: str, facts: Mapping[str, Any]) -> None:
        """Print one event with its details."""
        if event == "failure":
            complain(_failure(facts))
        elif event in ("waiting", "silent", "answers"):
            say(str(facts["reason"]), "yellow")
        elif self._verbose:
            words = " ".join(f"{name}={value}" for name, value in facts.items())
            say(f"{event}: {words}", "dim")
        if facts.get("damaged_blocks"):
            say(f"damaged blocks are computed again: {facts['damaged_blocks']:,}; check the disk", "yellow")


def _failure(facts: Mapping[str, Any]) -> str:
    """The message on a failed block."""
    first, last = facts["designs"]
    ranges = ", ".join(f"{name} {number(low)} to {number(high)}" for name, (low, high) in facts["parameters"].items())
    return (
        f"block {facts['block']} (designs {first:,} to {last:,}: {ranges}) failed and was left out: {facts['problem']}"
    )
