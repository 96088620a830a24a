"""Speed of committing blocks, against writing the same bytes to a plain file, synchronised after each block.

Run with ``python benchmarks/store.py [folder]``; the folder must be on the disk to measure. Repetitions of the two ways
alternate, because a disk's speed varies by a factor of two within seconds; only the ratio of the medians counts.
"""

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from explore.model.columns import Column
from explore.results.store.all_designs_writer import AllDesignsWriter

BLOCK_SIZE, N_BLOCKS, REPETITIONS = 65_536, 16, 9
COLUMNS = (
    Column("design", "", "design number", "index", "<i8"),
    *(Column(f"metric_{number}", "mm", "a metric", "metric") for number in range(29)),
    Column("status", "", "status code", "bookkeeping", "|i1"),
)
ATTRIBUTES = {"config": "", "request_sha256": "", "determines": "{}", "kernel": "none"}


def make_block(number: int) -> dict[str, np.ndarray]:
    columns = {c.name: np.random.default_rng(number).random(BLOCK_SIZE) for c in COLUMNS[1:-1]}
    start = number * BLOCK_SIZE
    return {"design": np.arange(start, start + BLOCK_SIZE), **columns, "status": np.ones(BLOCK_SIZE, "|i1")}


def write_plain(path: Path, blocks: list[dict[str, np.ndarray]]) -> tuple[float, float]:
    start = time.perf_counter()
    with path.open("wb") as file:
        for columns in blocks:
            for values in columns.values():
                values.tofile(file)
            file.flush()
            os.fsync(file.fileno())
        return 0.0, time.perf_counter() - start


def write_results(path: Path, blocks: list[dict[str, np.ndarray]]) -> tuple[float, float]:
    start = time.perf_counter()
    with AllDesignsWriter(path, COLUMNS, N_BLOCKS * BLOCK_SIZE, BLOCK_SIZE, ATTRIBUTES) as writer:
        created = time.perf_counter() - start
        for number, columns in enumerate(blocks):
            writer.commit(number, columns)
    return created, time.perf_counter() - start


def main() -> None:
    blocks = [make_block(number) for number in range(N_BLOCKS)]
    megabytes = sum(values.nbytes for columns in blocks for values in columns.values()) / 1e6
    seconds: dict[str, list[float]] = {"plain file": [], "commits": [], "create and commits": []}
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else ".") as name:
        path = Path(name) / "file.h5"
        for repetition in range(REPETITIONS):
            for write in (write_plain, write_results) if repetition % 2 else (write_results, write_plain):
                created, total = write(path, blocks)
                path.unlink()
                if write is write_plain:
                    seconds["plain file"].append(total)
                else:
                    seconds["commits"].append(total - created)
                    seconds["create and commits"].append(total)
    medians = {name: megabytes / statistics.median(times) for name, times in seconds.items()}
    for name, speed in medians.items():
        slowest, fastest = megabytes / max(seconds[name]), megabytes / min(seconds[name])
        share = speed / medians["plain file"]
        print(f"{name:20s}{speed:6.0f} MB/s ({slowest:.0f} to {fastest:.0f}), {share:.2f} of the plain file")


if __name__ == "__main__":
    main()
