"""Checks of the names of a mechanism's declaration: each is declared once, and those that are used exist."""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from typing import TypeVar

from explore.model.declaration import Declaration

_Item = TypeVar("_Item", str, int)

#: Columns of results, rankings, control curves, refinements and tolerances that are neither parameters nor metrics.
OWN_COLUMNS = (
    "design", "nodes", "error", "feasible", "status", "status_sentence", "front", "results", "knee", "crowding",
    "hypervolume_share", "alike", "violation", "piece", "parent", "yield", "yield_low", "yield_high",
    "failure_probability", "assembled",
)  # fmt: skip


def repeated(items: Iterable[_Item]) -> list[_Item]:
    """The items that occur more than once."""
    return [item for item, count in Counter(items).items() if count > 1]


def unknown_names(kind: str, names: Iterable[str], known: Collection[str], user: str) -> Iterator[str]:
    """A sentence for each name that is not known."""
    yield from (f"{user} names the {kind} '{name}', which does not exist" for name in names if name not in known)


def check_names(declaration: Declaration) -> Iterator[str]:
    """Problems of the names of all that is declared: each once."""
    kinds = {
        "parameter": [parameter.name for parameter in declaration.parameters],
        "signal": [signal.name for signal in declaration.signals],
        "metric": [
            *(metric.name for metric in declaration.metrics),
            *(formula.name for formula in declaration.formulas),
        ],
        "window": [window.name for window in declaration.windows],
        "drive": list(declaration.drives),
    }
    for kind, names in kinds.items():
        yield from (f"the {kind} '{name}' is declared twice" for name in repeated(names))
    columns = [*kinds["parameter"], *kinds["metric"]]
    yield from (f"'{name}' is a parameter and a metric" for name in repeated(columns))
    angle = declaration.input_angle.replace(" ", "_")
    yield from (f"the signal '{name}' has the name of the input angle" for name in kinds["signal"] if name == angle)
    yield from (f"'{name}' is the name of a column of all results" for name in columns if name in OWN_COLUMNS)
