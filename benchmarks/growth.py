"""Cost against the number of designs: wall time, CPU time, and CPU time per design.

Run with ``python benchmarks/growth.py [folder] [largest]``: `explore.evaluate` on 10^3 to 10^6 designs at once, and
sweeps that keep the front of 10^3 designs up to the largest (10^7 unless given; 10^8 takes a minute and more), each a
command of its own. All designs turn, none is screened. CPU time counts all threads; per design it is less start-up.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import explore

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = {{ min = 60, max = 140 }}
coupler = {{ min = 900, max = 1000 }}
rocker = {{ min = 500, max = 600 }}
ground = {{ min = 700, max = 800 }}
[sampling]
method = "random"
count = {count}
[rank]
metrics = ["cv", "swing_angle:max"]
"""
LARGEST_EVALUATED, REPETITIONS = 10**6, 3


def sweep(folder, count):
    """Wall and CPU seconds of a sweep that keeps the front."""
    (folder / "study.toml").write_text(STUDY.format(count=count))
    command = [sys.executable, "-m", "explore", "sweep", "study.toml", "-o", "study.h5", "--keep", "front", "--quiet"]
    start = time.perf_counter()
    _, status, usage = os.wait4(subprocess.Popen(command, cwd=folder).pid, 0)
    seconds = time.perf_counter() - start
    if status:
        raise SystemExit(f"the sweep of {count:,} designs failed")
    (folder / "study.h5").unlink()
    return seconds, usage.ru_utime + usage.ru_stime


def evaluate(folder, count):
    """CPU seconds of `explore.evaluate`, the least of three."""
    (folder / "study.toml").write_text(STUDY.format(count=count))
    designs = explore.load_study(folder / "study.toml").space.designs(0, count)
    seconds = []
    for _ in range(REPETITIONS):
        start = time.process_time()
        explore.evaluate("crank-rocker", designs)
        seconds.append(time.process_time() - start)
    return min(seconds)


def measure(folder, largest):
    """By number of designs: CPU seconds of an evaluation (or None), wall and CPU seconds of a sweep."""
    explore.evaluate("crank-rocker", {"crank": [60], "coupler": 1000, "rocker": 600, "ground": 800})
    count = 1_000
    while count <= largest:
        yield count, evaluate(folder, count) if count <= LARGEST_EVALUATED else None, *sweep(folder, count)
        count *= 10


def main() -> None:
    largest = int(float(sys.argv[2])) if len(sys.argv) > 2 else 10**7
    print("    designs   evaluate: CPU   a design   sweep: wall       CPU   a design")
    start_up = None
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else ".") as folder:
        for count, seconds, wall, cpu in measure(Path(folder), largest):
            start_up = start_up or cpu
            evaluation = f"{seconds:11.4f} s {seconds / count * 1e9:7.0f} ns" if seconds else 23 * " "
            per_design = f"{(cpu - start_up) / count * 1e9:7.0f} ns" if cpu > 1.5 * start_up else ""
            print(f"{count:11,} {evaluation:>23} {wall:11.1f} s {cpu:7.1f} s {per_design}", flush=True)


if __name__ == "__main__":
    main()
