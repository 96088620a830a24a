"""Honest times: the first run is discarded, and the median of several is what counts."""

from __future__ import annotations

import platform
import statistics
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

#: Enough runs when these have taken so long together, s.
_ENOUGH = 0.15
_RUNS = 7


def cpu_seconds(run: Callable[[], object]) -> float:
    """CPU time of one run: the median of up to seven after the first; of a slow one fewer, at least one."""
    run()
    times: list[float] = []
    while len(times) < _RUNS and sum(times) < _ENOUGH:
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return statistics.median(times)


def machine() -> dict[str, str]:
    """What the times were measured on."""
    names = ("numpy", "scipy", "numba", "pylinkage")
    return {
        "processor": _processor(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "explore": version("linkage-explore"),
        **{name: _version(name) for name in names},
    }


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.processor() or "unknown")
