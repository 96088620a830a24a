"""`explore sweep`: run, report, plan."""

from __future__ import annotations

import shlex
import signal
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from explore.cli.output import compiled_kernels, complain, counted, number, refuse_same, say
from explore.cli.progress import sweep_progress
from explore.errors import RequestError, ResultsError

if TYPE_CHECKING:
    from distributed import Client

    from explore.study import Study
    from explore.sweeping.runs import Summary


@dataclass(frozen=True)
class SweepOptions:
    """What the command line asks of a sweep."""

    config: Path
    output: Path | None
    workers: int | None
    processes: bool
    scheduler: str | None
    keep: Literal["all", "front"]
    restart: bool
    max_failures: int | None
    verbose: bool
    quiet: bool

    @property
    def path(self) -> Path:
        """The results file."""
        return self.output or Path("results") / f"{self.config.stem}.h5"

    @property
    def command(self) -> str:
        """The line that goes on with this sweep: as it was typed, but for --restart."""
        words = ["explore", "sweep", str(self.config)]
        words += ["-o", str(self.output)] if self.output else []
        words += ["--workers", str(self.workers)] if self.workers else []
        words += ["--processes"] if self.processes else []
        words += ["--scheduler", self.scheduler] if self.scheduler else []
        words += ["--keep", self.keep] if self.keep != "all" else []
        words += ["--max-failures", str(self.max_failures)] if self.max_failures is not None else []
        words += ["--verbose"] if self.verbose else []
        words += ["--quiet"] if self.quiet else []
        return shlex.join(words)

    def cluster(self) -> AbstractContextManager[Client]:
        """The workers."""
        from explore.sweeping.clusters import local_cluster, remote_cluster

        if self.scheduler is None:
            return local_cluster(self.workers, processes=self.processes)
        if self.workers is not None or self.processes:
            raise RequestError("--scheduler brings its own workers; leave out --workers and --processes")
        return remote_cluster(self.scheduler)


def run_sweep(options: SweepOptions, *, dry_run: bool) -> int:
    """Sweep a study and return the exit code."""
    with compiled_kernels():
        cluster = options.cluster()
        from explore.config.study_file import load_study
        from explore.sweeping.runs import run_study
    study = load_study(options.config)
    path = options.path
    if dry_run:
        from explore.cli.plans import print_plan

        print_plan(study, options)
        return 0
    refuse_same(path, options.config, "the study")
    if path.is_dir():
        raise ResultsError(f"{path} is a folder; name another file with -o")
    try:
        with (
            _terminable(),
            _reached(cluster, early=options.scheduler is not None) as reached,
            sweep_progress(study.space.count, quiet=options.quiet) as progress,
        ):
            summary = run_study(
                study,
                path,
                reached,
                keep=options.keep,
                max_failures=options.max_failures,
                restart=options.restart,
                progress=progress,
                listener=_Listener(verbose=options.verbose),
            )
    except KeyboardInterrupt:
        say(f"interrupted; finished blocks are safe. To go on: {options.command}")
        return 130
    _report(summary, options.keep, quiet=options.quiet)
    if options.keep == "all":
        _compare_objectives(study, path)
    return 3 if summary.failed else 0


@contextmanager
def _reached(cluster: AbstractContextManager[Client], *, early: bool) -> Iterator[AbstractContextManager[Client]]:
    """The cluster, connected before anything is written where that may fail."""
    if not early:
        yield cluster
        return
    with cluster as client:
        yield nullcontext(client)


@contextmanager
def _terminable() -> Iterator[None]:
    """Take a polite kill, as batch systems send before the rude one, as an interrupt; only the first counts."""
    interrupted = False

    def interrupt(*_: object) -> None:
        nonlocal interrupted
        interrupted = True
        for which in before:  # a second one would break the end that the first began
            signal.signal(which, signal.SIG_IGN)
        raise KeyboardInterrupt

    before = {which: signal.getsignal(which) for which in (signal.SIGINT, signal.SIGTERM)}
    # Who starts a sweep in the background may have made it deaf to the Ctrl-C of what runs in front.
    before = {which: handler for which, handler in before.items() if handler is not signal.SIG_IGN}
    for which in before:
        signal.signal(which, interrupt)
    try:
        yield
    finally:
        if not interrupted:  # else the process is about to end, and nothing is to disturb that
            for which, handler in before.items():
                signal.signal(which, handler)


class _Listener:
    """Tells the user of events: with -v of all, else of those that may need a hand."""

    def __init__(self, *, verbose: bool) -> None:
        self._verbose = verbose

    def __call__(self, event: str, facts: Mapping[str, Any]) -> None:
        if event == "failure":
            complain(_failure(facts))
        elif event == "waiting":
            say(str(facts["reason"]), "yellow")
        elif self._verbose:
            words = " ".join(f"{name}={value}" for name, value in facts.items())
            say(f"{event}: {words}", "dim")
        if facts.get("damaged_blocks"):
            say(f"damaged blocks are computed again: {facts['damaged_blocks']:,}; check the disk", "yellow")


def _failure(facts: Mapping[str, Any]) -> str:
    first, last = facts["designs"]
    ranges = ", ".join(f"{name} {number(low)} to {number(high)}" for name, (low, high) in facts["parameters"].items())
    return (
        f"block {facts['block']} (designs {first:,} to {last:,}: {ranges}) failed and was left out: {facts['problem']}"
    )


def _compare_objectives(study: Study, path: Path) -> None:
    """[rank] may change without a new sweep, but the file keeps the aims it was made with: say how to use the new."""
    import json

    from explore.store.opening import open_results

    aims = [f"{objective.metric}:{objective.sense}" for objective in study.objectives]
    if json.loads(str(open_results(path).attributes.get("objectives", "[]"))) != aims:
        command = shlex.join(["explore", "rank", str(path), *(word for aim in aims for word in ("--metric", aim))])
        say(f"[rank] differs from the one that {path} was made with; to rank by it: {command}")


def _report(summary: Summary, keep: str, *, quiet: bool) -> None:
    if summary.failed:
        written = "; the front is written when none is missing" if keep == "front" else ""
        blocks = counted(len(summary.failed), "block")
        complain(f"{blocks} failed; what is missing is computed when the same command is run again{written}")
    if quiet or (summary.failed and keep == "front"):
        return
    if summary.computed == 0 and not summary.failed:
        say(f"{summary.path} is complete already: {summary.designs:,} designs")
        return
    rate = summary.computed / summary.seconds
    resumed = f", {summary.resumed:,} were there" if summary.resumed else ""
    evaluations = counted(summary.kinematic_evaluations, "kinematic evaluation")
    say(
        f"{counted(summary.computed, 'design')} in {summary.seconds:.1f} s ({rate:,.0f}/s){resumed}; "
        f"{summary.feasible:,} feasible; {evaluations} -> {summary.path}"
    )
