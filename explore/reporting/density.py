"""How many designs lie where, counted over all of a file, for each pair of columns that the page can draw."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from explore.reporting.packing import Packed
from explore.reporting.rows import INFEASIBLE, Rows
from explore.store.results import Results
from explore.vocabulary import FloatArray

if TYPE_CHECKING:
    import pandas as pd

#: Cells of each axis.
CELLS = 96
#: Columns that have a density with each other: the objectives, then what comes first in the file.
_MOST_COLUMNS = 16
#: Share of the designs that the cells may leave out on each side of a column.
_TAIL = 0.002


def densities(
    results: Results, objectives: Sequence[str], frame: pd.DataFrame, rows: Rows, packed: Packed
) -> dict[str, Any]:
    """Count the feasible designs of a file in the cells of pairs of columns.

    Parameters
    ----------
    objectives
        Columns that must be among them.
    frame
        The designs of the page, of which the cells are laid out.
    rows
        The same, with their kinds.

    Returns
    -------
    dict
        ``columns``: edges of the cells by column, as (low, high); ``pairs``: of (x, y) the packed counts of shape
        (CELLS * CELLS,), x running first.
    """
    edges = _edges(results, objectives, frame[rows.kinds != INFEASIBLE])
    pairs = list(combinations(edges, 2))
    counts = np.zeros((len(pairs), CELLS * CELLS), dtype=np.int64)
    for columns in results.blocks(["feasible", *edges]):
        feasible = columns["feasible"]
        places = {name: _places(columns[name][feasible], *edges[name]) for name in edges}
        for k, (x, y) in enumerate(pairs):
            both = (places[x] >= 0) & (places[y] >= 0)
            cells = places[y][both] * CELLS + places[x][both]
            counts[k] += np.bincount(cells, minlength=CELLS * CELLS)
    return {
        "cells": CELLS,
        "columns": {name: list(limits) for name, limits in edges.items()},
        "pairs": [[x, y, packed.add(counts[k])] for k, (x, y) in enumerate(pairs)],
    }


def _edges(results: Results, objectives: Sequence[str], frame: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """Where the cells of each column begin and end."""
    found: dict[str, tuple[float, float]] = {}
    for column in sorted(results.columns, key=lambda column: column.name not in objectives):
        if column.role not in ("parameter", "metric") or column.labels or len(found) == _MOST_COLUMNS:
            continue
        values = frame[column.name].to_numpy(dtype=np.float64)
        values = values[np.isfinite(values)]
        if len(values) and values.min() < values.max():
            low, high = (float(value) for value in np.quantile(values, [_TAIL, 1.0 - _TAIL]))
            found[column.name] = (low, high) if low < high else (float(values.min()), float(values.max()))
    return found


def _places(values: FloatArray, low: float, high: float) -> npt.NDArray[np.int64]:
    """Cell of each value, -1 outside and where undefined."""
    with np.errstate(invalid="ignore"):
        scaled = (values - low) * (CELLS / (high - low))
        inside = (values >= low) & (values <= high)
    return np.where(inside, np.minimum(np.where(inside, scaled, 0.0).astype(np.int64), CELLS - 1), -1)
