"""Columns and designs of results that several figures need."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from explore.base.errors import RequestError
from explore.base.suggest import suggestion
from explore.model.columns import Column
from explore.model.quantities import FloatArray
from explore.results.ranking.rankings import Ranking, rank_source
from explore.results.ranking.reasons import nothing_ranked
from explore.results.ranking.violations import CHECKED, find_margins, find_scales, is_measured, total_violations
from explore.results.store.results import Results

if TYPE_CHECKING:
    import pandas as pd


def numeric_column(results: Results, name: str, role: str | None = None) -> Column:
    """Find a column of numbers, not of codes, that has the role if one is given; see `explore.model.columns.Column`."""
    columns = {
        c.name: c for c in results.columns if c.role != "index" and not c.labels and (role is None or c.role == role)
    }
    if name not in columns:
        raise RequestError(f"{results.path} has no {role or 'column of numbers'} '{name}'; {suggestion(name, columns)}")
    return columns[name]


def choose_design(results: Results, design: int | None, ranking: Ranking | None = None) -> int:
    """The number of the given design, which must be in the file, or of the best of the Pareto set when it is None."""
    if design is not None:
        results.design(design)
        return design
    if ranking is None and not results.objectives:
        raise RequestError(f"{results.path} has no objective, so no design is the best: choose one with `design`")
    ranking = ranking or rank_source(results)
    if ranking.frame.empty:
        raise RequestError(f"{nothing_ranked(ranking, results.path)}, so none is the best: choose one with `design`")
    return int(ranking.frame.index[0])


def violation_columns(results: Results) -> list[str]:
    """Columns that `violations` needs."""
    return ["status", *(c.name for c in results.columns if c.role == "margin")]


def violations(results: Results, frame: pd.DataFrame) -> FloatArray:
    """Total violation of the constraints by each design of a table with `violation_columns`, (n,).

    0 where they are met, infinite where the distance from feasible is not known. See `results.ranking.violations`.
    """
    metrics = [name.removesuffix("_margin") for name in violation_columns(results)[1:]]
    if not metrics:
        return np.where(np.isin(frame["status"].to_numpy(), CHECKED), 0.0, np.inf)
    margins = find_margins({str(name): frame[name].to_numpy() for name in frame}, metrics, ())
    measured = is_measured(frame["status"].to_numpy(), margins)
    scales = find_scales([{metric: margin[measured] for metric, margin in margins.items()}], len(frame))
    return np.where(measured, total_violations(margins, scales), np.inf)


def varying_parameters(results: Results) -> list[Column]:
    """The parameters with more than one value; those last that are undefined (NaN) in some designs."""
    parameters = [c for c in results.columns if c.role == "parameter"]
    frame = results.to_pandas([c.name for c in parameters])
    varying = [c for c in parameters if frame[c.name].min() < frame[c.name].max()]
    return sorted(varying, key=lambda c: bool(frame[c.name].isna().any()))


def designs_like(
    results: Results, names: Sequence[str], parameters: Sequence[Column], design: int | None
) -> tuple[pd.DataFrame, str]:
    """Read some columns of the designs that equal one design in some parameters; of all designs when it is None.

    The table, index "design", has the columns of these names and, of a given design, `parameters`; the text has the
    common values in words, and is empty when designs are not selected.
    """
    if design is None or not parameters:
        return results.to_pandas(list(dict.fromkeys(names))), ""
    row = results.design(design)
    frame = results.to_pandas(list(dict.fromkeys([*names, *(c.name for c in parameters)])))
    equal = np.logical_and.reduce([frame[c.name].to_numpy() == row[c.name] for c in parameters])
    values = (f"{c.name} {row[c.name]:.6g} {'' if c.unit == '1' else c.unit}".rstrip() for c in parameters)
    return frame[equal], ", ".join(values)
