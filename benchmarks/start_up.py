"""Start-up: help, import, the first block of a sweep with a warm cache, and the first compile without a cache.

Run with ``python benchmarks/start_up.py``. CPU seconds are above those of a bare interpreter in the same run.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STUDY = (
    "mechanism = 'crank-rocker'\n[parameters]\ncrank = 100\ncoupler = 1083.4236\nrocker = 541.7118\nground = 691.7118\n"
)
MAIN = "from explore.cli import main; main()"


def run(folder: Path, *arguments: str, **environment: str) -> tuple[float, float]:
    """CPU and wall seconds of one process."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(
        [sys.executable, *arguments], cwd=folder, env={**os.environ, **environment}, check=True, capture_output=True
    )
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "one.toml").write_text(STUDY)
        cold_cpu, cold = run(folder, "-c", MAIN, "sweep", "one.toml", NUMBA_CACHE_DIR=str(folder / "cache"))
        (folder / "results/one.h5").unlink()
        jobs = {
            "bare interpreter": ("-c", "pass"),
            "explore --help": ("-c", MAIN, "--help"),
            "whole sweep of one design": ("-c", MAIN, "sweep", "one.toml", "--restart"),
        }
        cpu: dict[str, list[float]] = {job: [] for job in jobs}
        wall: dict[str, list[float]] = {job: [] for job in jobs}
        for repetition in range(8):
            for job, arguments in jobs.items():
                seconds = run(folder, *arguments)
                if repetition:
                    cpu[job].append(seconds[0])
                    wall[job].append(seconds[1])
    bare = statistics.median(cpu["bare interpreter"])
    for job in jobs:
        print(f"{job:28s}{statistics.median(cpu[job]) - bare:6.3f} s CPU, {statistics.median(wall[job]):6.3f} s wall")
    print(f"{'the same, first compile ever':28s}{cold_cpu - bare:6.3f} s CPU, {cold:6.3f} s wall")


if __name__ == "__main__":
    main()
