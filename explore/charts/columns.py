"""Columns of results as axes: which can be drawn, what an axis says, and which designs matter."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from explore.errors import RequestError
from explore.ranking.rankings import Ranking, rank_source
from explore.store.results import Results
from explore.suggest import suggestion
from explore.vocabulary import Column

if TYPE_CHECKING:
    import pandas as pd

#: Letters of one line of an axis's label, about as many as a usual figure holds.
LETTERS = 72


def drawable(results: Results, name: str, roles: Sequence[str] = ()) -> Column:
    """The column of that name, if it holds numbers that an axis can show.

    Parameters
    ----------
    roles
        Those of `explore.vocabulary.Column` that will do; all when empty.

    Raises
    ------
    RequestError
        If there is none.
    """
    known = {
        c.name: c for c in results.columns if c.role != "index" and not c.labels and (not roles or c.role in roles)
    }
    if name not in known:
        kind = roles[0] if len(roles) == 1 else "column of numbers"
        raise RequestError(f"{results.path} has no {kind} '{name}'; {suggestion(name, known)}")
    return known[name]


def axis_label(column: Column, letters: int = LETTERS) -> str:
    """What a column means, with its unit, in lines of so many letters; margins are named, as their meaning is long."""
    words = column.name if column.role == "margin" else column.long_name
    return "\n".join(textwrap.wrap(f"{words} [{unit_text(column.unit)}]" if column.unit else words, letters))


def unit_text(unit: str) -> str:
    """A unit as it is printed: squares and cubes raised."""
    return unit.replace("^2", "²").replace("^3", "³").replace("^4", "⁴")


def study_name(results: Results) -> str:
    """Name of the study by its file, without the endings."""
    return results.path.name.removesuffix(".h5").removesuffix(".packed")


def state(results: Results) -> str:
    """What a heading adds when designs are not there, or not yet."""
    if results.keep != "all":
        return ", only the Pareto set was kept"
    return "" if results.complete else f", {results.n_committed:,} so far"


def choose_design(results: Results, design: int | None, ranking: Ranking | None = None) -> int:
    """The design asked for, or the best of the Pareto set.

    Raises
    ------
    RequestError
        If none was asked for and none is feasible.
    ResultsError
        If the one asked for is not there.
    """
    if design is not None:
        results.rows([design])
        return design
    best = (ranking or rank_source(results)).frame.index
    if best.empty:
        raise RequestError(f"no design of {results.path} is feasible, so none is the best: choose one with --design N")
    return int(best[0])


def varying(results: Results) -> list[Column]:
    """The parameters that have more than one value, first those that every design has: one solved for may lack it."""
    parameters = [c for c in results.columns if c.role == "parameter"]
    frame = results.to_pandas([c.name for c in parameters])
    several = [c for c in parameters if frame[c.name].min() < frame[c.name].max()]
    return sorted(several, key=lambda c: bool(frame[c.name].isna().any()))


def others_fixed(
    results: Results, names: Sequence[str], others: Sequence[Column], design: int | None
) -> tuple[pd.DataFrame, str]:
    """Columns of the designs that equal one design in other parameters, and these in words; of all when it is None."""
    if design is None or not others:
        return results.to_pandas(list(dict.fromkeys(names))), ""
    row = results.design(design)
    frame = results.to_pandas(list(dict.fromkeys([*names, *(c.name for c in others)])))
    same = np.logical_and.reduce([frame[c.name].to_numpy() == row[c.name] for c in others])
    return frame[same], ", ".join(f"{c.name} {row[c.name]:.6g} {c.unit}" for c in others)
