"""The store that these tests write: small blocks whose values follow from the design numbers."""

import json
from pathlib import Path
from typing import Any, Self

import numpy as np

from explore.model.columns import Column
from explore.model.status import Status
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.results.store.front_writer import FrontWriter

#: 40 blocks of 512 rows, the last one shorter, in 6 columns. A block of the narrowest column fills a sector of the
#: disk, so blocks share no sector, as blocks of 65,536 rows share no page.
N_BLOCKS, BLOCK = 40, 512
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
    """The columns of a block. No value is 0, the value of unwritten bytes; every fifth value of the metric is NaN."""
    design = np.array(rows(number), dtype="<i8")
    failed = design % 5 == 2
    return {
        "design": design,
        "crank": np.sqrt(design + 2.0),
        "cv": np.where(failed, np.nan, 1.0 / (design + 3.0)),
        "nodes": (design % 97 + 1).astype("<i4"),
        "status": np.where(failed, Status.SCREENED, Status.OK).astype("|i1"),
        "feasible": (design % 3 + 1).astype("|i1"),
    }


def kept_values(number: int) -> dict[str, np.ndarray]:
    """The designs of a block that a writer of the front keeps: every third, a few sectors of the disk."""
    return {name: column[::3] for name, column in values(number).items()}


class Keeper(FrontWriter):
    """The writer of a front, with the interface of the other writer."""

    def __enter__(self) -> Self:
        super().__enter__()
        self.pending = [] if self.is_finished else sorted(set(range(N_BLOCKS)) - self._blocks().keys())
        return self

    def commit(self, number: int, columns: Any) -> None:
        """Add the kept designs of a block."""
        self.append({"block": number}, kept_values(number))

    def complete(self) -> None:
        """Write the results file from the journal."""
        if not self.is_finished:
            blocks = [columns for _, columns in sorted(self._blocks().items())]
            whole = {column.name: np.concatenate([block[column.name] for block in blocks]) for column in COLUMNS}
            self.finish(whole, {"studied_designs": N_DESIGNS, "studied_counts": "{}"})

    def _blocks(self) -> dict[int, Any]:
        return {meta["block"]: columns for meta, columns in self.records()}


def writer(path: Path, *, keep: str = "all", restart: bool = False, **attributes: Any) -> AllDesignsWriter | Keeper:
    """The writer of this store."""
    if keep == "front":
        return Keeper(path, COLUMNS, N_DESIGNS, BLOCK, ATTRIBUTES | attributes | {"keep": keep}, restart=restart)
    return AllDesignsWriter(path, COLUMNS, N_DESIGNS, BLOCK, ATTRIBUTES | attributes, restart=restart)


def fill(path: Path, numbers: Any = None, keep: str = "all") -> Path:
    """Write these blocks, or all pending ones, in this process."""
    with writer(path, keep=keep) as store:
        for number in store.pending if numbers is None else numbers:
            store.commit(number, values(number))
        if isinstance(store, Keeper):
            store.complete()
    return path
