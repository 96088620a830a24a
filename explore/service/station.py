"""A service without its network: the folder is held, jobs are accepted, and sweeps run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from explore.service.bounded_calls import BoundedCalls
from explore.service.estimates import Estimates
from explore.service.events import Events
from explore.service.folder import Folder
from explore.service.indexes import Indexes
from explore.service.job_files import JobFile
from explore.service.plans import Limits, Plan, make_plan
from explore.service.queue import Jobs
from explore.service.runner import Runner, Work

#: Longest time of a ranking, for itself or for the plan of a refinement, s.
_CALL_SECONDS = 60.0


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
