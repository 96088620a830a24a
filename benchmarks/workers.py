"""A second worker, writing aside: a sweep that keeps only the best design writes next to nothing.

Run with ``python benchmarks/workers.py [folder]``. Sweeps with one thread, two threads, one process and two processes
alternate; counted from the first block to the end. Printed: designs/s, and what the second worker gains.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

import explore
from explore.studies.config.study import Study

STUDY = """mechanism = "crank-rocker"
[parameters]
crank   = { start = 60, stop = 140, num = 80 }
coupler = { start = 900, stop = 1100, num = 50 }
rocker  = { start = 500, stop = 600, num = 40 }
ground  = { start = 650, stop = 800, num = 50 }
[rank]
metrics = ["cv"]
"""
REPETITIONS = 5


def rate(study: Study, path: Path, workers: int, *, processes: bool) -> float:
    """Designs/s from the first block to the end."""
    times: list[tuple[float, int]] = []

    def note(n_done: int, _: int) -> None:
        times.append((time.perf_counter(), n_done))

    explore.sweep(study, path, workers=workers, processes=processes, keep="front", report_progress=note)
    path.unlink()
    (begun, first), (ended, last) = times[0], times[-1]
    return (last - first) / (ended - begun)


def main() -> None:
    kinds = {"thread": False, "process": True}
    rates: dict[tuple[str, int], list[float]] = {(kind, workers): [] for kind in kinds for workers in (1, 2)}
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else ".") as name:
        (Path(name) / "study.toml").write_text(STUDY)
        study = explore.load_study(Path(name) / "study.toml")
        for _ in range(REPETITIONS):
            for (kind, workers), found in rates.items():
                found.append(rate(study, Path(name) / "study.h5", workers, processes=kinds[kind]))
    for kind in kinds:
        one, two = (statistics.median(rates[kind, workers]) for workers in (1, 2))
        gain = statistics.median(b / a for a, b in zip(rates[kind, 1], rates[kind, 2], strict=True))
        print(f"one {kind} {one / 1e6:.2f}, two {two / 1e6:.2f} million designs/s: x {gain:.2f}")


if __name__ == "__main__":
    main()
