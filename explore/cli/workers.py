"""The workers of a command that computes results: its options, their connection, and what is printed meanwhile."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.base.errors import RequestError
from explore.cli.output import complain, number, say
from explore.cli.progress import sweep_progress
from explore.cli.termination import terminable

if TYPE_CHECKING:
    from distributed import Client

    from explore.running.runs import Progress
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
    processes: bool
    scheduler: str | None
    verbose: bool
    quiet: bool

    @property
    def places(self) -> list[str]:
        """The words of a command line with the options of the workers."""
        words = ["--workers", str(self.workers)] if self.workers else []
        words += ["--processes"] if self.processes else []
        return words + (["--scheduler", self.scheduler] if self.scheduler else [])

    @property
    def prints(self) -> list[str]:
        """The words of a command line with the options of what is printed."""
        return ["--verbose"] * self.verbose + ["--quiet"] * self.quiet

    def cluster(self, mechanism: str) -> Workers:
        """The workers, for a mechanism of this name."""
        from explore.running.clusters import local_cluster, remote_cluster

        if self.scheduler is None:
            return local_cluster(self.workers, processes=self.processes)
        if self.workers is not None or self.processes:
            raise RequestError("--scheduler brings its own workers; leave out --workers and --processes")
        return remote_cluster(self.scheduler, mechanism)

    @contextmanager
    def connected(
        self, cluster: Workers, n_designs: int
    ) -> Iterator[tuple[Workers, Callable[[Progress], None] | None]]:
        """The cluster, and a function for the progress, for as long as the command computes so many designs.

        A cluster that may fail to connect is connected at once: before anything is written.
        """
        # dask's event loops may stop with an unfinished future, which asyncio logs on stderr.
        logging.getLogger("asyncio").setLevel(logging.CRITICAL + 1)
        with terminable(), self._ready(cluster) as ready, sweep_progress(n_designs, quiet=self.quiet) as progress:
            yield ready, progress

    @contextmanager
    def _ready(self, cluster: Workers) -> Iterator[Workers]:
        if self.scheduler is None:
            yield cluster
            return
        with cluster as client:
            yield nullcontext(client)


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
