"""Tables for programs that read no attributes: words beside codes, and in names the units that are not declared."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import pandas as pd

    from explore.model.columns import Column
    from explore.units.shown import Scale


def with_labels(frame: pd.DataFrame, columns: Iterable[Column]) -> pd.DataFrame:
    """The table with a column of labels after each column of codes, such as ``status_label`` after ``status``."""
    labelled = frame.copy(deep=False)
    for column in columns:
        name = f"{column.name}_label"
        if column.labels and column.name in frame and frame[column.name].dtype != bool and name not in frame:
            labelled.insert(list(labelled).index(column.name) + 1, name, frame[column.name].map(column.labels))
    return labelled


def with_units(frame: pd.DataFrame, scales: Mapping[str, Scale]) -> pd.DataFrame:
    """The table with the unit in the name of each column that is not in its declared unit, such as ``crank [in]``.

    A program that expects the declared unit then misses the column, and does not take inches for millimetres.
    """
    from explore.units.shown import headings

    return frame.rename(columns=headings(scales, [str(name) for name in frame.columns]))
