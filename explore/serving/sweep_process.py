"""The process of one sweep: ``python -m explore.serving.sweep_process STUDY RESULTS OPTIONS``.

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
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from explore.errors import ConfigError, ExploreError, RequestError
from explore.store.locking import LockedError, LockFile

if TYPE_CHECKING:
    from distributed import Client

    from explore.sweeping.runs import Progress
    from explore.sweeping.threads import LocalThreads

#: Seconds between two lines of progress.
_INTERVAL = 0.1
#: Seconds to wait for the process of a service that was killed to let go of the folder.
_PATIENCE = 60.0


def main() -> int:
    """Sweep, and return the exit code of `explore sweep`."""
    signal.signal(signal.SIGTERM, _interrupt)
    threading.Thread(target=_end_with_stdin, daemon=True).start()
    study, results, options = sys.argv[1:]
    try:
        return _sweep(Path(study), Path(results), json.loads(options))
    except KeyboardInterrupt:
        return 130
    except ExploreError as error:
        _print("error", reason=str(error))
        return 2 if isinstance(error, ConfigError | RequestError) else 1
    except (OSError, MemoryError) as error:
        _print("error", reason="not enough memory" if isinstance(error, MemoryError) else str(error))
        return 1


def _sweep(path: Path, results: Path, options: Mapping[str, Any]) -> int:
    from explore.compiling import announce_compilation
    from explore.config.study_file import load_study
    from explore.evaluation.evaluate import compile_kernels
    from explore.sweeping.runs import run_study

    study = load_study(path)
    with _alone(results.parent.parent / "log" / "sweep"):
        announce_compilation(lambda: _print("note", reason="compiling the kernels, once per machine"))
        if options["scheduler"] is None:
            compile_kernels(study.request)
        summary = run_study(
            study,
            results,
            _workers(options, study.request.mechanism.name),
            keep=options["keep"],
            progress=_progress_printer(),
            listener=_print_event,
        )
    n_done = summary.progress.n_done
    _print("progress", done=n_done, feasible=summary.n_feasible, computed=summary.n_computed, seconds=summary.seconds)
    if summary.failures:
        number, reason = next(iter(summary.failures.items()))
        count = len(summary.failures)
        _print("error", reason=f"{count} block{'s' * (count > 1)} failed; block {number}: {reason}")
    return 3 if summary.failures else 0


def _workers(options: Mapping[str, Any], mechanism: str) -> AbstractContextManager[Client | LocalThreads]:
    from explore.sweeping.clusters import local_cluster, remote_cluster

    if options["scheduler"] is not None:
        return remote_cluster(options["scheduler"], mechanism)
    return local_cluster(options["workers"], processes=False)


@contextmanager
def _alone(path: Path) -> Iterator[None]:
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


def _progress_printer() -> Callable[[Progress], None]:
    start = time.monotonic()
    last = -_INTERVAL

    def report(progress: Progress) -> None:
        nonlocal last
        seconds = time.monotonic() - start
        if seconds - last >= _INTERVAL:
            last = seconds
            _print(
                "progress",
                done=progress.n_done,
                feasible=progress.n_feasible,
                computed=progress.n_computed,
                seconds=round(seconds, 3),
            )

    return report


def _print_event(event: str, facts: Mapping[str, Any]) -> None:
    """Print the events of a sweep that a user may have to act on."""
    if event == "failure":
        _print("note", reason=f"block {facts['block']} failed: {facts['problem']}")
    elif event in ("waiting", "silent", "answers"):
        _print("note", reason=str(facts["reason"]))


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
