"""CPU times of jobs in turns, so that a busy moment harms all alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping


def cpu_times(jobs: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, list[float]]:
    """CPU seconds of every repetition by job; a first run of each warms up."""
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for repetition in range(repetitions + 1):
        for name, job in jobs.items():
            start = time.process_time()
            job()
            if repetition:
                seconds[name].append(time.process_time() - start)
    return seconds
