"""How fast blocks become durable, against a plain file of the same bytes, synchronised after each block.

Run with ``python benchmarks/store.py [folder]``; the folder must be on the disk that is meant. Repetitions of all ways
alternate, because a disk's speed wanders by a factor of two within seconds; only the ratio of the medians counts.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from explore.store.writer import Writer
from explore.vocabulary import Column

BLOCK_SIZE, N_BLOCKS, REPETITIONS = 65_536, 16, 9
COLUMNS = (
    Column("design", "", "design number", "index", "<i8"),
    *(Column(f"metric_{number}", "mm", "a metric", "metric") for number in range(29)),
    Column("status", "", "what became of the design", "bookkeeping", "|i1"),
)
ATTRIBUTES = {"config": "", "request_sha256": "", "determines": "{}", "kernel": "none"}


def block(number: int) -> dict[str, np.ndarray]:
    columns = {c.name: np.random.default_rng(number).random(BLOCK_SIZE) for c in COLUMNS[1:-1]}
    start = number * BLOCK_SIZE
    return {"design": np.arange(start, start + BLOCK_SIZE), **columns, "status": np.ones(BLOCK_SIZE, "|i1")}


def raw(path: Path, blocks: list[dict[str, np.ndarray]]) -> tuple[float, float]:
    start = time.perf_counter()
    with path.open("wb") as file:
        for columns in blocks:
            for values in columns.values():
                values.tofile(file)
            file.flush()
            os.fsync(file.fileno())
        return 0.0, time.perf_counter() - start


def store(path: Path, blocks: list[dict[str, np.ndarray]]) -> tuple[float, float]:
    start = time.perf_counter()
    with Writer(path, COLUMNS, N_BLOCKS * BLOCK_SIZE, BLOCK_SIZE, ATTRIBUTES) as writer:
        created = time.perf_counter() - start
        for number, columns in enumerate(blocks):
            writer.commit(number, columns)
    return created, time.perf_counter() - start


def main() -> None:
    blocks = [block(number) for number in range(N_BLOCKS)]
    megabytes = sum(values.nbytes for columns in blocks for values in columns.values()) / 1e6
    seconds: dict[str, list[float]] = {"raw": [], "commits": [], "create and commits": []}
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else ".") as name:
        path = Path(name) / "file.h5"
        for repetition in range(REPETITIONS):
            for way in (raw, store) if repetition % 2 else (store, raw):
                created, total = way(path, blocks)
                path.unlink()
                if way is raw:
                    seconds["raw"].append(total)
                else:
                    seconds["commits"].append(total - created)
                    seconds["create and commits"].append(total)
    median = {what: megabytes / statistics.median(times) for what, times in seconds.items()}
    for what, speed in median.items():
        slowest, fastest = megabytes / max(seconds[what]), megabytes / min(seconds[what])
        print(f"{what:20s}{speed:6.0f} MB/s ({slowest:.0f} to {fastest:.0f}), {speed / median['raw']:.2f} of raw")


if __name__ == "__main__":
    main()
