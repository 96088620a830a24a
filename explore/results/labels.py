"""Texts of figures and of the report: labels of axes, units, the name of a study."""

import textwrap
from collections.abc import Mapping

from explore.model.columns import Column
from explore.results.store.results import Results


def axis_label(column: Column, width: int = 72) -> str:
    """Meaning and unit of a column, wrapped at `width` characters; of a margin the name: its description is long."""
    words = column.name if column.role == "margin" else column.long_name
    return "\n".join(textwrap.wrap(f"{words} [{unit_text(column.unit)}]" if column.unit else words, width))


def unit_text(unit: str) -> str:
    """A unit with its exponents raised: "mm²" for "mm^2"."""
    return unit.replace("^2", "²").replace("^3", "³").replace("^4", "⁴")


def results_name(results: Results) -> str:
    """Name of the results file without its endings."""
    return results.path.name.removesuffix(".h5").removesuffix(".packed")


def distinct_names(sources: Mapping[str, Results]) -> dict[str, str]:
    """Short names of several results by the names of their files; the names of the files if two have the same."""
    names = {path: results_name(results) for path, results in sources.items()}
    return names if len(set(names.values())) == len(names) else {path: path for path in sources}


def completeness_note(results: Results) -> str:
    """Addition to a heading when the file does not hold all designs of the study; else empty."""
    if results.keep != "all":
        return ", only the Pareto set was kept"
    return "" if results.is_complete else f", {results.n_committed:,} so far"
