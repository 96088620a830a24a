"""A whole sweep of four million designs to durable HDF5, against a raw synchronised write of the same bytes.

Run with ``python benchmarks/sweep.py [folder]``; the folder must be on the disk that is meant. Sweep and raw write
alternate. Printed: designs/s after start-up, the share of the raw rate, and one thread against two.
"""

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import explore
from explore.running.collectors import row_bytes
from explore.studies.config.study import Study

STUDY = """mechanism = "crank-rocker"
[parameters]
crank   = { start = 60, stop = 140, num = 80 }
coupler = { start = 900, stop = 1100, num = 50 }
rocker  = { start = 500, stop = 600, num = 40 }
ground  = { start = 650, stop = 800, num = 25 }
"""
REPETITIONS = 5


def raw(path: Path, size: int) -> float:
    """Seconds to write so many bytes in blocks of 16 MB, each made durable."""
    block = np.random.default_rng(0).bytes(16_000_000)
    start = time.perf_counter()
    with path.open("wb") as file:
        for _ in range(size // len(block)):
            file.write(block)
            file.flush()
            os.fdatasync(file.fileno())
    seconds = time.perf_counter() - start
    path.unlink()
    return seconds


def sweep(study: Study, path: Path, workers: int) -> tuple[float, float]:
    """Seconds to the first block, and from there to the end."""
    start, first = time.perf_counter(), 0.0

    def note(*_: int) -> None:
        nonlocal first
        first = first or time.perf_counter()

    explore.sweep(study, path, workers=workers, report_progress=note)
    end = time.perf_counter()
    path.unlink()
    return first - start, end - first


def main() -> None:
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else ".") as name:
        folder = Path(name)
        (folder / "big.toml").write_text(STUDY)
        study = explore.load_study(folder / "big.toml")
        size = row_bytes(study) * study.space.n_designs
        seconds: dict[str, list[float]] = {"raw": [], "two": [], "one": []}
        first = []
        for _ in range(REPETITIONS):
            seconds["raw"].append(raw(folder / "raw", size))
            for label, workers in (("two", 2), ("one", 1)):
                begun, ran = sweep(study, folder / "big.h5", workers)
                first.append(begun)
                seconds[label].append(ran)
    medians = {label: statistics.median(times) for label, times in seconds.items()}
    n = study.space.n_designs
    print(f"{n:,} designs, {size / 1e9:.2f} GB; raw synced write {size / medians['raw'] / 1e6:.0f} MB/s")
    for label in ("two", "one"):
        print(
            f"{label} threads: {n / medians[label] / 1e6:.2f} million designs/s, {medians['raw'] / medians[label]:.2f} "
            f"of the raw rate"
        )
    print(f"second thread: x {medians['one'] / medians['two']:.2f}; first block after {statistics.median(first):.2f} s")


if __name__ == "__main__":
    main()
