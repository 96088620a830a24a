"""Peak memory of a sweep against its number of designs, which must not increase it.

Run with ``python benchmarks/memory.py [folder] [largest]``: sweeps of 10^5 designs up to the largest (10^7 unless
given; 10^8 takes minutes) that keep only the front, and of 10^5 to 10^7 designs that keep all. Each runs as a command
of its own. Printed: peak resident memory, time, size of the results file.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = 50
coupler = {{ min = 50, max = 1000 }}
rocker = {{ min = 50, max = 500 }}
ground = {{ min = 50, max = 1000 }}
[sampling]
method = "sobol"
count = {count}
[constraints]
transmission_angle_min = {{ min = 30 }}
[rank]
metrics = ["cv", "mean_output_ratio:max", "transmission_angle_min:max"]
"""
LARGEST_KEPT = 10**7


def sweep(folder: Path, count: int, keep: str) -> None:
    """Run one sweep and print what it took."""
    (folder / "study.toml").write_text(STUDY.format(count=count))
    results = folder / "study.h5"
    start = time.perf_counter()
    command = [sys.executable, "-m", "explore", "sweep", "study.toml", "-o", results.name, "--keep", keep, "--quiet"]
    process = subprocess.Popen(command, cwd=folder)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"the sweep of {count:,} designs failed")
    seconds = time.perf_counter() - start
    megabytes = results.stat().st_size / 1e6
    print(
        f"{count:>13,} {keep:>6} {usage.ru_maxrss / 1024:>8.0f} MB {seconds:>8.1f} s "
        f"{count / seconds / 1e6:>6.2f} M/s {megabytes:>10,.1f} MB"
    )
    results.unlink()


def main() -> None:
    largest = int(float(sys.argv[2])) if len(sys.argv) > 2 else 10**7
    print(f"{'designs':>13} {'keep':>6} {'memory':>11} {'time':>10} {'rate':>10} {'file':>13}")
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else ".") as name:
        for exponent in range(5, 19):
            count = 10**exponent
            if count <= largest:
                sweep(Path(name), count, "front")
            if count <= min(largest, LARGEST_KEPT):
                sweep(Path(name), count, "all")


if __name__ == "__main__":
    main()
