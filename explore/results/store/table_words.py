"""Tables for people, and for programs that read no attributes: words for codes, and units in names of columns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from explore.base.errors import RequestError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import pandas as pd

    from explore.base.units.shown import Scale
    from explore.model.columns import Column


def with_labels(frame: pd.DataFrame, columns: Iterable[Column]) -> pd.DataFrame:
    """The table with a column of labels after each column of codes, such as ``status_label`` after ``status``."""
    labelled = frame.copy(deep=False)
    for column in columns:
        name = f"{column.name}_label"
        if column.labels and column.name in frame and frame[column.name].dtype != bool and name not in frame:
            labelled.insert(list(labelled).index(column.name) + 1, name, frame[column.name].map(column.labels))
    return labelled


def in_words(table: pd.DataFrame) -> pd.DataFrame:
    """The table with words in place of the codes of columns such as ``status``.

    Codes stay codes in all tables otherwise, as in the files, so that ``table["status"] == 1`` means the same
    everywhere.

    Parameters
    ----------
    table
        One of `evaluate`, `rank`, `read_results` and so on, with ``attrs["labels"]``.

    Returns
    -------
    DataFrame
        With categorical columns, whose categories are all words that a code can have. Words stay as they are.
    """
    import pandas as pd

    labels = table.attrs.get("labels")
    if labels is None:
        raise RequestError('the table has no attrs["labels"]; give one of evaluate, rank or read_results, unchanged')
    words = table.copy(deep=False)
    for name, meanings in labels.items():
        if name in table and table[name].dtype != bool:
            categories = list(dict.fromkeys(meanings.values()))
            as_words = meanings | {word: word for word in categories}
            words[name] = pd.Categorical(table[name].map(as_words), categories=categories)
    return words


def with_units(frame: pd.DataFrame, scales: Mapping[str, Scale]) -> pd.DataFrame:
    """The table with the unit in the name of each column that is not in its declared unit, such as ``crank [in]``.

    A program that expects the declared unit then misses the column, and does not take inches for millimetres.
    """
    from explore.base.units.shown import headings

    return frame.rename(columns=headings(scales, [str(name) for name in frame.columns]))
