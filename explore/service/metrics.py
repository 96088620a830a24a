"""Counts of a service for Prometheus, beside those of its process that the client library gives: /metrics."""

import shutil
from collections.abc import Iterator

from prometheus_client import CollectorRegistry, ProcessCollector, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from explore._version import __version__
from explore.service.folder import State
from explore.service.station import Station


class StationCollector(Collector):
    """The counts of a service, read when they are asked for."""

    def __init__(self, station: Station) -> None:
        self._station = station

    def collect(self) -> Iterator[Metric]:
        """Each count with its meaning and type."""
        jobs = self._station.jobs.in_order()
        states = GaugeMetricFamily("explore_jobs", "Jobs by state.", labels=["state"])
        for state in State:
            states.add_metric([state], sum(job.state == state for job in jobs))
        yield states
        running = next((job.to_json() for job in jobs if job.state == State.running), {})
        for name, meaning, value in (
            ("explore_running_designs", "Designs of the job that is swept.", running.get("designs", 0)),
            ("explore_running_designs_done", "Designs of it that are committed.", running.get("done", 0)),
            ("explore_running_designs_per_second", "Designs that it computes per second.", running.get("rate") or 0),
            (
                "explore_runner_up",
                "1 if jobs are taken from the queue, as /healthz says.",
                self._station.runner.is_alive(),
            ),
            ("explore_watchers", "Clients that watch the events.", self._station.events.n_watchers),
            ("explore_free_bytes", "Free space for results.", shutil.disk_usage(self._station.folder.results).free),
        ):
            yield GaugeMetricFamily(name, meaning, value=value)
        version = GaugeMetricFamily("explore_build_info", "The version that runs.", labels=["version"])
        version.add_metric([__version__], 1)
        yield version
        yield CounterMetricFamily("explore_events", "Events since the start.", value=self._station.events.last)


def metrics_text(station: Station) -> bytes:
    """All counts in the text format of Prometheus, version 0.0.4."""
    registry = CollectorRegistry()
    registry.register(StationCollector(station))
    ProcessCollector(registry=registry)  # memory, processor time and open files, without those of sweeps
    return generate_latest(registry)
