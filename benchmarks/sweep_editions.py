"""Sweeps by this source tree and by another edition's on one core, in turns, one process each.

Run with ``python benchmarks/sweep_editions.py FOLDER [folder on a disk] [folder in memory]``, FOLDER a checkout of the
other edition, for the first one ``git worktree add FOLDER 0ccb847``. Counted from the first block to the end: CPU time
per design and designs/s until the results are durable. CPU times are less sensitive to other programs.
"""

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

from timing import ROOT, edition_times, serve

REPETITIONS = 5
DEFAULT = """mechanism = "crank-rocker"
[parameters]
crank   = { start = 60, stop = 140, num = 40 }
coupler = { start = 900, stop = 1100, num = 50 }
rocker  = { start = 500, stop = 600, num = 20 }
ground  = { start = 650, stop = 800, num = 25 }
[rank]
metrics = ["cv", "transmission_angle_min:max"]
"""
#: `configs/grid.toml` with finer axes.
GRID = (ROOT / "configs/grid.toml").read_text().replace("num = 21", "num = 50").replace("num = 15", "num = 25")
STUDIES = {"default columns": DEFAULT, "columns of grid.toml": GRID}


def measure(job: tuple[str, str, str]) -> list[float]:
    """Nanoseconds per design, of CPU and of a clock, of a sweep of a study that keeps all designs or the front."""
    import explore

    text, place, keep = job
    with tempfile.TemporaryDirectory(dir=place) as folder:
        (Path(folder) / "study.toml").write_text(text)
        study = explore.load_study(Path(folder) / "study.toml")
        times: list[tuple[int, float, float]] = []

        def note(n_done: int, _: int) -> None:
            times.append((n_done, time.process_time(), time.perf_counter()))

        explore.sweep(study, Path(folder) / "results.h5", workers=1, keep=keep, report_progress=note)
    (first, *begun), (last, *ended) = times[0], times[-1]
    return [(b - a) / (last - first) * 1e9 for a, b in zip(begun, ended, strict=True)]


def main() -> None:
    other, disk, memory = [*sys.argv[1:], *(".", "/dev/shm")[len(sys.argv) - 2 :]]
    jobs = {
        f"{name}, {where}": (text, place, keep)
        for name, text in STUDIES.items()
        for where, place, keep in (
            ("a file on disk", disk, "all"), ("a file in memory", memory, "all"), ("the front", memory, "front"),
        )
    }  # fmt: skip
    times = edition_times(__file__, other, jobs, REPETITIONS)
    print(f"{'':40s}{'CPU: other':>12s}{'here':>9s}{'ratio':>7s}{'million/s: other':>18s}{'here':>7s}{'ratio':>7s}")
    for job in jobs:
        (cpu, wall), (our_cpu, our_wall) = (
            [statistics.median(column) for column in zip(*measured, strict=True)] for measured in times[job]
        )
        print(
            f"{job:40s}{cpu:9.0f} ns{our_cpu:6.0f} ns{cpu / our_cpu:7.1f}"
            f"{1e3 / wall:18.2f}{1e3 / our_wall:7.2f}{wall / our_wall:7.1f}"
        )


if __name__ == "__main__":
    if "--serve" in sys.argv:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        serve(measure)
    else:
        main()
