"""Density of all feasible designs of a file over pairs of columns, drawn behind the scatter."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from explore.figures.reporting.packing import ColumnPacker
from explore.figures.reporting.rows import INFEASIBLE, ReportRows
from explore.model.quantities import FloatArray
from explore.results.store.results import Results

if TYPE_CHECKING:
    import pandas as pd

#: Number of cells along each axis.
CELLS = 96
#: Largest number of columns: the objectives, then the first ones of the file.
_MAX_COLUMNS = 16
#: Share of the designs beyond the cells on each side.
_OUTSIDE = 0.002


def count_densities(
    results: Results, objectives: Sequence[str], frame: pd.DataFrame, rows: ReportRows, packer: ColumnPacker
) -> dict[str, Any]:
    """Count the feasible designs of a file in the cells of pairs of columns, the objectives first.

    The frame determines the extent of the cells. In the answer, ``columns`` has the lower and upper edge of the cells
    by column, ``pairs`` x, y and the packed counts, (CELLS * CELLS,), x varies fastest.
    """
    edges = _column_limits(results, objectives, frame[rows.kinds != INFEASIBLE])
    pairs = list(combinations(edges, 2))
    counts = np.zeros((len(pairs), CELLS * CELLS), dtype=np.int64)
    for columns in results.blocks(["feasible", *edges]):
        feasible = columns["feasible"]
        cells = {name: _cell_numbers(columns[name][feasible], *edges[name]) for name in edges}
        for k, (x, y) in enumerate(pairs):
            inside = (cells[x] >= 0) & (cells[y] >= 0)
            flat = cells[y][inside] * CELLS + cells[x][inside]
            counts[k] += np.bincount(flat, minlength=CELLS * CELLS)
    return {
        "cells": CELLS,
        "columns": {name: list(limits) for name, limits in edges.items()},
        "pairs": [[x, y, packer.add(counts[k])] for k, (x, y) in enumerate(pairs)],
    }


def _column_limits(results: Results, objectives: Sequence[str], frame: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """Lower and upper edge of the cells of each column."""
    limits: dict[str, tuple[float, float]] = {}
    for column in sorted(results.columns, key=lambda column: column.name not in objectives):
        if column.role not in ("parameter", "metric") or column.labels or len(limits) == _MAX_COLUMNS:
            continue
        values = frame[column.name].to_numpy(dtype=np.float64)
        values = values[np.isfinite(values)]
        if len(values) and values.min() < values.max():
            low, high = (float(value) for value in np.quantile(values, [_OUTSIDE, 1.0 - _OUTSIDE]))
            limits[column.name] = (low, high) if low < high else (float(values.min()), float(values.max()))
    return limits


def _cell_numbers(values: FloatArray, low: float, high: float) -> npt.NDArray[np.int64]:
    """Cell of each value, shape (n,); -1 outside and for NaN."""
    with np.errstate(invalid="ignore"):
        scaled = (values - low) * (CELLS / (high - low))
        inside = (values >= low) & (values <= high)
    return np.where(inside, np.minimum(np.where(inside, scaled, 0.0).astype(np.int64), CELLS - 1), -1)
