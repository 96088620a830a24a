"""The store that these tests write: small blocks whose every value follows from the design's number."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from explore.store.writer import Writer
from explore.vocabulary import Column, Status

#: 40 blocks of 256 rows, the last one shorter, in 6 columns.
N_BLOCKS, BLOCK = 40, 256
N_DESIGNS = N_BLOCKS * BLOCK - 100
COLUMNS = (
    Column("design", "", "design number", "index", "<i8"),
    Column("crank", "mm", "crank length", "parameter"),
    Column("cv", "1", "coefficient of variation", "metric"),
    Column("nodes", "", "signal evaluations", "bookkeeping", "<i4"),
    Column("status", "", "what became of the design", "bookkeeping", "|i1", {int(s): s.label for s in Status}),
    Column("feasible", "", "meets every constraint", "bookkeeping", "|i1"),
)
ATTRIBUTES = {
    "config": 'mechanism = "crank-rocker"\n',
    "request_sha256": "ab" * 32,
    "determines": json.dumps({"mechanism": "crank-rocker", "parameters": {"crank": [1, 2]}}),
    "kernel": "crank-rocker 1",
    "seed": 1,
    "sampler": "grid",
}


def rows(number: int) -> range:
    """Design numbers of a block."""
    return range(number * BLOCK, min((number + 1) * BLOCK, N_DESIGNS))


def values(number: int) -> dict[str, np.ndarray]:
    """The columns of a block. No value is 0, what an unwritten byte is, but in every fifth row of the metric (NaN)."""
    design = np.array(rows(number), dtype="<i8")
    failed = design % 5 == 2
    return {
        "design": design,
        "crank": np.sqrt(design + 2.0),
        "cv": np.where(failed, np.nan, 1.0 / (design + 3.0)),
        "nodes": (design % 97 + 1).astype("<i4"),
        "status": np.where(failed, Status.CRANK_BLOCKED, Status.OK).astype("|i1"),
        "feasible": (design % 3 + 1).astype("|i1"),
    }


def writer(path: Path, *, restart: bool = False, **attributes: Any) -> Writer:
    """The product's writer of this store."""
    return Writer(path, COLUMNS, N_DESIGNS, BLOCK, ATTRIBUTES | attributes, restart=restart)


def fill(path: Path, numbers: Any = None) -> Path:
    """Write the blocks named, else all that are pending, in this process."""
    with writer(path) as store:
        for number in store.pending if numbers is None else numbers:
            store.commit(number, values(number))
    return path
