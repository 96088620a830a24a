"""Counts of a service in the text format of Prometheus, version 0.0.4."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

from explore._version import __version__
from explore.service.folder import State
from explore.service.station import Station


def metrics_text(station: Station) -> str:
    """All counts, each with its meaning and type.

    Those of the process itself have the names that clients of Prometheus give them, and are left out where the system
    does not tell them.
    """
    return "".join(line + "\n" for line in [*_jobs(station), *_service(station), *_process()])


def _jobs(station: Station) -> Iterator[str]:
    jobs = station.jobs.in_order()
    running = next((job for job in jobs if job.state == State.running), None)
    facts = running.to_json() if running is not None else {}
    states = {f'{{state="{state}"}}': sum(job.state == state for job in jobs) for state in State}
    yield from _family("explore_jobs", "gauge", "Jobs by state.", states)
    yield from _one("explore_running_designs", "gauge", "Designs of the job that is swept.", facts.get("designs", 0))
    yield from _one("explore_running_designs_done", "gauge", "Designs of it that are committed.", facts.get("done", 0))
    rate = facts.get("rate") or 0
    yield from _one("explore_running_designs_per_second", "gauge", "Designs that it computes per second.", rate)


def _service(station: Station) -> Iterator[str]:
    version = {f'{{version="{__version__}"}}': 1}
    yield from _family("explore_build_info", "gauge", "The version that runs.", version)
    is_sweeping = int(station.runner.is_alive())
    yield from _one("explore_runner_up", "gauge", "1 if jobs are taken from the queue, as /healthz says.", is_sweeping)
    yield from _one("explore_watchers", "gauge", "Clients that watch the events.", station.events.n_watchers)
    yield from _one("explore_events_total", "counter", "Events since the start.", station.events.last)
    free = shutil.disk_usage(station.folder.results).free
    yield from _one("explore_free_bytes", "gauge", "Free space for results.", free)


def _process() -> Iterator[str]:
    """Memory, processor time and open files of this process, from /proc."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        files = len(os.listdir("/proc/self/fd"))  # noqa: PTH208 -- faster than Path.iterdir
    except OSError:
        return
    size = pages * os.sysconf("SC_PAGE_SIZE")
    yield from _one("process_resident_memory_bytes", "gauge", "Resident memory.", size)
    yield from _one("process_open_fds", "gauge", "Open files and connections.", files)
    cpu = "Processor time, user and system, without that of sweeps."
    yield from _one("process_cpu_seconds_total", "counter", cpu, time.process_time())


def _one(name: str, kind: str, meaning: str, value: float) -> Iterator[str]:
    return _family(name, kind, meaning, {"": value})


def _family(name: str, kind: str, meaning: str, values: Mapping[str, float]) -> Iterator[str]:
    """The lines of a metric: what it means, its type, and its value for each set of labels."""
    yield f"# HELP {name} {meaning}"
    yield f"# TYPE {name} {kind}"
    for labels, value in values.items():
        yield f"{name}{labels} {value}"
