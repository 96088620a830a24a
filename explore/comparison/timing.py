"""CPU times as medians of repeated runs, and the machine that they were measured on."""

import platform
import statistics
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from explore._version import __version__

#: Number of runs after which a measurement ends.
_MAX_RUNS = 7
#: CPU time after which a measurement ends, s.
_MAX_SECONDS = 0.15


def measure_cpu_seconds(run: Callable[[], object]) -> float:
    """Median CPU time (s) of up to seven runs, fewer if they are slow; a first run, which may compile, is discarded."""
    run()
    times: list[float] = []
    while len(times) < _MAX_RUNS and sum(times) < _MAX_SECONDS:
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return statistics.median(times)


def describe_machine() -> dict[str, str]:
    """Processor, system, and versions of Python and of the packages that matter for speed."""
    names = ("numpy", "scipy", "numba", "pylinkage")
    return {
        "processor": _processor(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "explore": __version__,
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
    models = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(models, platform.processor() or "unknown")
