"""The process of one job: ``python -m explore.service.sweep_process FILE RESULTS OPTIONS``.

It prints its progress on stdout, a JSON object a line, and ends like Ctrl-C when its stdin ends: the process that
started it was stopped or killed then. What is committed is safe, and the same call goes on from there.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from explore.base.errors import ConfigError, ExploreError, RequestError
from explore.results.store.locking import LockedError, LockFile

if TYPE_CHECKING:
    from explore.running.runs import Progress, Summary
    from explore.service.job_files import Refinement
    from explore.studies.config.study import Study
    from explore.synthesis.tasks.task_files import TaskFile

#: Least time between two lines of progress, s.
_INTERVAL = 0.1
#: Note until workers of another scheduler have computed something: they are quick, or compile for a while.
_FIRST_DESIGNS = "waiting for the first designs; workers compile the kernels before, once per machine, up to a minute"
#: Time to wait for the sweep of a service that was killed to let go of the folder, s.
_PATIENCE = 60.0


def main() -> int:
    """Run the job, and return the exit code of `explore sweep`."""
    signal.signal(signal.SIGTERM, _interrupt)
    threading.Thread(target=_end_with_stdin, daemon=True).start()
    file, results, options = sys.argv[1:]
    try:
        return _run(Path(file), Path(results), json.loads(options))
    except KeyboardInterrupt:
        return 130
    except ExploreError as error:
        _print("error", reason=str(error))
        return 2 if isinstance(error, ConfigError | RequestError) else 1
    except (OSError, MemoryError) as error:
        _print("error", reason="not enough memory" if isinstance(error, MemoryError) else str(error))
        return 1


def _run(file: Path, results: Path, options: Mapping[str, Any]) -> int:
    from explore.base.compiling import announce_compilation
    from explore.service.folder import read_regular
    from explore.service.job_files import Refinement, read_job_file
    from explore.synthesis.tasks.task_files import TaskFile

    job_file = read_job_file(file.stem, read_regular(file))
    with _only_sweep(results.parent.parent / "log" / "sweep"):
        announce_compilation(lambda: _print("note", reason="compiling the kernels, once per machine"))
        if isinstance(job_file, TaskFile):
            return _synthesize(job_file, results)
        if isinstance(job_file, Refinement):
            return _report(_refine(job_file, results, options))
        return _report(_sweep(job_file, results, options))


def _sweep(study: Study, results: Path, options: Mapping[str, Any]) -> Summary:
    from explore.running.runs import run_study
    from explore.running.workers import start_workers

    workers, printer = start_workers(study.request, **options["work"]), _Printer(options["work"])
    return run_study(study, results, workers, keep=options["keep"], progress=printer.progress, listener=printer.event)


def _refine(refinement: Refinement, results: Path, options: Mapping[str, Any]) -> Summary:
    from explore.analysis.refining.runs import run_refinement
    from explore.running.workers import start_workers

    plan, source = refinement.plan(results.parent), results.with_name(f"{refinement.refine}.h5")
    workers, printer = start_workers(plan.study.request, **options["work"]), _Printer(options["work"])
    return run_refinement(plan, source, results, workers, progress=printer.progress, listener=printer.event)


def _report(summary: Summary) -> int:
    """Print how a sweep or refinement ended, and return the exit code."""
    n_done = summary.progress.n_done
    _print("progress", done=n_done, feasible=summary.n_feasible, computed=summary.n_computed, seconds=summary.seconds)
    if summary.failures:
        number, reason = next(iter(summary.failures.items()))
        count = len(summary.failures)
        _print("error", reason=f"{count} block{'s' * (count > 1)} failed; block {number}: {reason}")
    return 3 if summary.failures else 0


def _synthesize(task: TaskFile, results: Path) -> int:
    """Find the linkages of a task, which are written at once: a search that was interrupted begins again."""
    from explore.synthesis.public import rows_of

    print_seconds = _PacedPrinter()

    def report(steps_done: int, steps: int) -> None:
        print_seconds(steps_done=steps_done, steps=steps)

    candidates = task.find(report)
    if candidates.is_interrupted:  # what a part of the search found is no result of the job
        raise KeyboardInterrupt
    rows = rows_of(task, candidates)
    rows.write(results)
    n_feasible = int(rows.arrays["feasible"].sum())
    _print("progress", designs=rows.count, done=rows.count, feasible=n_feasible)
    return 0


@contextmanager
def _only_sweep(path: Path) -> Iterator[None]:
    """Hold the lock of all sweeps of a folder: the sweep of a service that was killed may still be ending."""
    end = time.monotonic() + _PATIENCE
    with ExitStack() as stack:
        while True:
            try:
                stack.enter_context(LockFile(path))
                break
            except LockedError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.02)
        yield


class _PacedPrinter:
    """Prints progress with the seconds since the start, but not too often."""

    def __init__(self) -> None:
        self._start, self._last = time.monotonic(), -_INTERVAL

    def __call__(self, **facts: int) -> None:
        seconds = time.monotonic() - self._start
        if seconds - self._last >= _INTERVAL:
            self._last = seconds
            _print("progress", **facts, seconds=round(seconds, 3))


class _Printer:
    """Prints the progress of a sweep, and events of it that a user may have to act on or wait for."""

    def __init__(self, work: Mapping[str, Any]) -> None:
        self._print_progress, self._is_remote = _PacedPrinter(), work["scheduler"] is not None
        self._has_begun = False

    def progress(self, progress: Progress) -> None:
        """Print how far it is."""
        self._has_begun = True
        self._print_progress(done=progress.n_done, feasible=progress.n_feasible, computed=progress.n_computed)

    def event(self, event: str, facts: Mapping[str, Any]) -> None:
        """Print an event that matters."""
        if event == "failure":
            _print("note", reason=f"block {facts['block']} failed: {facts['problem']}")
        elif event in ("waiting", "silent", "answers"):
            _print("note", reason=str(facts["reason"]))
        elif event == "workers" and facts["joined"] and self._is_remote and not self._has_begun:
            _print("note", reason=_FIRST_DESIGNS)  # workers do not tell when they compile


def _print(event: str, **facts: Any) -> None:
    with suppress(OSError):  # the process that reads is gone; then stdin has ended, which ends this one
        os.write(1, json.dumps({"event": event, **facts}).encode() + b"\n")


def _interrupt(*_: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # a second signal would interrupt the orderly end
    raise KeyboardInterrupt


def _end_with_stdin() -> None:
    while os.read(0, 4096):  # not sys.stdin, whose lock this thread would hold when the process ends
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    sys.exit(main())
