"""A service without its network: the folder is held, jobs are accepted, sweeps run and are estimated."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from explore.base.compiling import announce_compilation
from explore.base.errors import ExploreError
from explore.mechanisms.registry import MECHANISMS
from explore.running.clusters import processors
from explore.running.timing import seconds_per_design
from explore.service.bounded_calls import BoundedCalls
from explore.service.events import Events
from explore.service.folder import Folder
from explore.service.indexes import Indexes
from explore.service.job_files import JobFile, Refinement, read_job_file
from explore.service.plans import Limits, Plan, make_plan
from explore.service.queue import Jobs
from explore.service.runner import Runner, Work
from explore.studies.config.study import Study

#: Longest time of a ranking, for itself or for the plan of a refinement, s.
_CALL_SECONDS = 60.0
#: Time after which a measurement is given up, s; what compiles is not waited for.
_PATIENCE = 120.0
#: Note in place of a time while kernels are compiled.
COMPILING = "the kernels are being compiled, once per machine, up to a minute; ask again then for the time"


@dataclass(frozen=True)
class Station:
    """The parts of a service."""

    folder: Folder
    limits: Limits
    jobs: Jobs
    events: Events
    runner: Runner
    indexes: Indexes
    calls: BoundedCalls
    estimates: Estimates


@contextmanager
def open_station(path: Path, limits: Limits, work: Work) -> Iterator[Station]:
    """Hold a folder and sweep its jobs, until the block ends; `ResultsError` if another process serves the folder."""
    folder = Folder(path)
    with folder.locked():
        events = Events()
        calls = BoundedCalls(_CALL_SECONDS)

        def plan_refinement(job_file: JobFile, keep: str, results: Path) -> Plan:
            plan: Plan = calls.call("the plan of the refinement", make_plan, job_file, keep, results)
            return plan

        jobs = Jobs(folder, limits, events.note_job, plan_refinement)
        runner = Runner(jobs, folder, work, limits.seconds)
        indexes = Indexes(jobs, folder)
        estimates = Estimates(folder.results, work.workers)
        runner.start()
        indexes.start()
        try:
            yield Station(folder, limits, jobs, events, runner, indexes, calls, estimates)
        finally:
            calls.close()
            estimates.close()
            indexes.stop()
            runner.stop()


class Estimates:
    """Measures designs for dry runs; safe to use from several threads.

    Refinements start from results in the folder; workers are the threads of a sweep, None for one for each processor.
    """

    def __init__(self, results: Path, workers: int | None) -> None:
        self._results, self._workers = results, workers or processors()
        self._calls = BoundedCalls(_PATIENCE)
        self._one_at_a_time = threading.Lock()
        self._is_warm = False

    def seconds(self, content: bytes, plan: Plan) -> tuple[float | None, str]:
        """Seconds of computing, or None and why they are not known.

        A task's search ends when it has found enough, which nobody knows before.
        """
        if plan.designs is None:
            return None, ""
        try:
            with self._one_at_a_time:
                measured: float | str = self._calls.call("the measurement", _measure, content, self._results)
        except ExploreError as error:
            return None, str(error)
        if isinstance(measured, str):
            return None, measured
        return measured * plan.designs / self._workers, ""

    def warm(self) -> None:
        """Start the process, once, before somebody waits for it."""
        with self._one_at_a_time:
            if not self._is_warm:
                self._is_warm = True
                with suppress(ExploreError):
                    self._calls.call("the start", _load)

    def close(self) -> None:
        """End the process."""
        self._calls.close()


def _load() -> None:
    """Import what a measurement needs."""
    MECHANISMS.load_all()


class _Measurement(threading.Thread):
    """Measures a study in the background; what it says last, or first of all that it compiles, is its answer."""

    def __init__(self, study: Study) -> None:
        super().__init__(daemon=True)
        self._study = study
        self._answered = threading.Event()
        self._answer: float | str | Exception = COMPILING

    def run(self) -> None:
        end_announcing = announce_compilation(self._answered.set)
        try:
            self._answer = seconds_per_design(self._study)
        except Exception as error:  # for who waits
            self._answer = error
        end_announcing()
        self._answered.set()

    def answer(self) -> float | str:
        self._answered.wait()
        if isinstance(self._answer, Exception):
            raise self._answer
        return self._answer


#: Measurement under way in this process, at most one, which compiles.
_running: list[_Measurement] = []


def _measure(content: bytes, results: Path) -> float | str:
    """Seconds per design of a study, or of the study that a refinement belongs to; or that its kernels compile."""
    if _running and _running[0].is_alive():
        return COMPILING
    job_file = read_job_file("job", content)
    study = job_file.plan(results).study if isinstance(job_file, Refinement) else job_file
    assert isinstance(study, Study)  # noqa: S101 -- tasks are not measured
    _running[:] = [_Measurement(study)]
    _running[0].start()
    return _running[0].answer()
