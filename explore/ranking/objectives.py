"""What makes a design better: aims from texts such as "cv" or "swing_angle:max"."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from explore.errors import RequestError
from explore.suggest import suggestion
from explore.vocabulary import Objective, Sense

#: Endings of names whose small values are better wherever they come from.
_SMALL_IS_GOOD = ("cv", "variance", "_std", "_rms", "_peak_to_peak")


def parse_objective(text: str, senses: Mapping[str, Sense | None], columns: Sequence[str]) -> Objective:
    """An objective from "cv" or "swing_angle:max".

    Parameters
    ----------
    senses
        The own sense of each metric, None where it has none.
    columns
        The columns there are.
    """
    name, _, sense = text.partition(":")
    if name not in columns:
        raise RequestError(f"no column '{name}' to rank by in these results; {suggestion(name, columns)}")
    if sense == "" and ":" not in text:
        own = senses.get(name) or ("min" if name.endswith(_SMALL_IS_GOOD) else None)
        if own is None:
            raise RequestError(f"'{name}' has no better side of its own: write {name}:min or {name}:max")
        return Objective(name, own)
    if sense not in ("min", "max"):
        raise RequestError(f"'{text}': the sense is min or max, as in {name}:max")
    return Objective(name, "min" if sense == "min" else "max")


def choose_objectives(
    metrics: Sequence[str] | str | None,
    order_by: str | None,
    senses: Mapping[str, Sense | None],
    columns: Sequence[str],
    usual: Sequence[str] = (),
) -> tuple[tuple[Objective, ...], Objective]:
    """The aims of a ranking and what orders it: what was asked for, else the study's own."""
    texts = [metrics] if isinstance(metrics, str) else list(usual if metrics is None else metrics)
    if not texts:
        example = next((name for name in columns if senses.get(name)), "cv:min")
        raise RequestError(f"nothing to rank by: give metrics, such as {example}")
    objectives = tuple(dict.fromkeys(parse_objective(text, senses, columns) for text in texts))
    order = objectives[0] if order_by is None else parse_objective(order_by, senses, columns)
    return objectives, order


def senses_of(attributes: Mapping[str, object]) -> dict[str, Sense | None]:
    """The own sense of each metric, from a results file's attributes."""
    return dict(json.loads(str(attributes.get("senses", "{}"))))
