"""A service without its network: the folder is held, jobs are accepted, and sweeps run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from explore.serving.events import Events
from explore.serving.folder import Folder
from explore.serving.indexes import Indexes
from explore.serving.plans import Limits
from explore.serving.queue import Jobs
from explore.serving.runner import Runner, Work


@dataclass(frozen=True)
class Station:
    """The parts of a service."""

    folder: Folder
    limits: Limits
    jobs: Jobs
    events: Events
    runner: Runner
    indexes: Indexes
    workers: int | None


@contextmanager
def open_station(path: Path, limits: Limits, work: Work) -> Iterator[Station]:
    """Hold a folder and sweep its jobs, until the block ends.

    Raises
    ------
    ResultsError
        Another process serves the folder.
    """
    folder = Folder(path)
    with folder.locked():
        events = Events()
        jobs = Jobs(folder, limits, events.note_job)
        runner = Runner(jobs, folder, work, limits.seconds)
        indexes = Indexes(jobs, folder)
        runner.start()
        indexes.start()
        try:
            yield Station(folder, limits, jobs, events, runner, indexes, work.workers)
        finally:
            indexes.stop()
            runner.stop()
