"""Results files that several tests write, in this process or in a separate one."""

import hashlib
import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import h5py
import numpy as np

from explore.base.errors import ResultsError
from explore.mechanisms.registry import MECHANISMS
from explore.model.columns import Column
from explore.model.status import Status
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.results.store.open_results import open_results
from explore.results.store.sealing import COMMIT_OFFSET, SEAL

CRANK_BLOCKED = 3
LABELS = MECHANISMS["crank-rocker"].status_labels
COLUMNS = (
    Column("design", "", "design number", "index", "<i8"),
    Column("crank", "mm", "crank length", "parameter"),
    Column("rocker_velocity_max", "rad/s", "greatest velocity ω", "metric"),
    Column("nodes", "", "signal evaluations", "bookkeeping", "<i4"),
    Column("status", "", "what became of the design", "bookkeeping", "|i1", LABELS),
    Column("feasible", "", "meets every constraint", "bookkeeping", "|i1"),
)
ATTRIBUTES = {
    "config": 'mechanism = "crank-rocker"  # ω\n',
    "request_sha256": "ab" * 32,
    "determines": json.dumps({"mechanism": "crank-rocker", "parameters": {"crank": [1, 2], "ground": 3}}),
    "kernel": "four-bar 1",
    "versions": json.dumps({"numpy": "2"}),
    "seed": 1,
    "sampler": "grid",
}
#: Blocks of 1000 rows take several pages of each column; the last block is shorter, as in most studies.
BLOCK, N_DESIGNS = 1000, 9500
N_BLOCKS = 10


def values(number: int, block: int = BLOCK, n_designs: int = N_DESIGNS) -> dict[str, np.ndarray]:
    """Columns of a block that differ in every row, with NaN where a design failed."""
    design = np.arange(number * block, min((number + 1) * block, n_designs))
    status = np.where(design % 7 == 3, CRANK_BLOCKED, Status.OK).astype("|i1")
    return {
        "crank": design + 0.25,
        "rocker_velocity_max": np.where(status == Status.OK, np.sqrt(design), np.nan),
        "nodes": (design % 97).astype("<i4"),
        "status": status,
        "feasible": (design % 2).astype("|i1"),
    }


def writer(path: Path, **changes) -> AllDesignsWriter:
    attributes = ATTRIBUTES | changes.pop("attributes", {})
    return AllDesignsWriter(path, COLUMNS, N_DESIGNS, BLOCK, attributes, **changes)


def fill(path: Path, numbers=range(N_BLOCKS)) -> Path:
    with writer(path) as store:
        for number in numbers:
            store.commit(number, values(number))
    return path


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def assert_block_has_its_values(path: Path, number: int) -> None:
    frame = open_results(path).to_pandas()
    start = number * BLOCK
    for name, expected in values(number).items():
        np.testing.assert_array_equal(frame.loc[start : start + BLOCK - 1, name], expected, err_msg=name)


def flip(path: Path, offset: int) -> None:
    with path.open("r+b") as file:
        file.seek(offset)
        byte = file.read(1)[0]
        file.seek(offset)
        file.write(bytes([byte ^ 0x10]))


def assert_random_damage_is_told(path: Path, places: Sequence[int], read: Callable[[], object]) -> None:
    """300 files with 1 to 20 random bytes at these places: each is read or raises `ResultsError`."""
    whole, chance, refused = path.read_bytes(), random.Random(7), 0
    for _ in range(300):
        damaged = bytearray(whole)
        for _ in range(chance.randrange(1, 20)):
            damaged[chance.choice(places)] = chance.randrange(256)
        path.write_bytes(damaged)
        try:
            read()
        except ResultsError:
            refused += 1
    assert refused > 0


def unseal(file: h5py.File) -> None:
    """Make a file one of format version 2, whose attributes have no checksum and may say anything."""
    file.attrs.modify("format_version", 2)
    for name in (SEAL, COMMIT_OFFSET):
        del file.attrs[name]


def still_pending(path: Path) -> list[int]:
    with writer(path) as store:
        return list(store.pending)


# --- the writer as a separate process --------------------------------------------------------------------------------


def child(path: Path, blocks: str) -> subprocess.Popen:
    """Start a writer process, which prints "ready" before it opens the file and each block's number once durable."""
    command = [sys.executable, __file__, str(path), blocks]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)


def kill(process: subprocess.Popen) -> list[str]:
    """Send SIGKILL; returns the words that the process had printed."""
    process.send_signal(signal.SIGKILL)
    words = process.stdout.read().split()
    process.stdout.close()
    process.wait()
    return words


def say(word: str) -> None:
    sys.stdout.write(word + "\n")
    sys.stdout.flush()


def write_as_child(path: Path, blocks: str) -> None:
    say("ready")
    with writer(path) as store:
        if blocks == "none":
            say("holding")
            time.sleep(600)
        for number in store.pending:
            store.commit(number, values(number))
            say(str(number))


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        write_as_child(Path(sys.argv[1]), sys.argv[2])
    except ResultsError as error:
        if "being written" not in str(error):
            say(Path(sys.argv[1]).name + str(error).removeprefix(sys.argv[1]).partition(";")[0])
            sys.exit(1)
