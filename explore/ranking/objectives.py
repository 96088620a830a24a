"""Objectives from texts such as "cv" or "swing_angle:max"."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from explore.errors import RequestError
from explore.model.quantities import Sense
from explore.model.request import Objective
from explore.suggest import suggestion

#: Endings of the names of metrics whose smaller values are better in every mechanism.
_MINIMISED_ENDINGS = ("cv", "variance", "_std", "_rms", "_peak_to_peak")


def parse_objective(text: str, senses: Mapping[str, Sense | None], columns: Sequence[str]) -> Objective:
    """Parse an objective such as "cv" or "swing_angle:max".

    Parameters
    ----------
    senses
        The default sense of each metric, or None.
    columns
        Columns that can be an objective.

    Raises
    ------
    RequestError
        If the column is unknown, or no sense is written and it has no default.
    """
    name, _, sense = text.partition(":")
    if name not in columns:
        raise RequestError(f"no column '{name}' to rank by in these results; {suggestion(name, columns)}")
    if sense == "" and ":" not in text:
        default = senses.get(name) or ("min" if name.endswith(_MINIMISED_ENDINGS) else None)
        if default is None:
            raise RequestError(f"'{name}' has no default sense: write {name}:min or {name}:max")
        return Objective(name, default)
    if sense not in ("min", "max"):
        raise RequestError(f"'{text}': the sense must be min or max, as in {name}:max")
    return Objective(name, "min" if sense == "min" else "max")


def choose_objectives(
    objectives: Sequence[str] | str | None,
    order_by: str | None,
    senses: Mapping[str, Sense | None],
    columns: Sequence[str],
    defaults: Sequence[str] = (),
) -> tuple[tuple[Objective, ...], Objective]:
    """The objectives and the one that orders each front.

    Without `objectives` they are those of the study (`defaults`), or `order_by` alone where it has none.
    """
    texts = [objectives] if isinstance(objectives, str) else list(defaults if objectives is None else objectives)
    if objectives is None and not texts and order_by is not None:
        texts = [order_by]
    if not texts:
        example = next((name for name in columns if senses.get(name)), "cv:min")
        raise RequestError(f"no objective: give `objectives`, such as {example}")
    choice = tuple(dict.fromkeys(parse_objective(text, senses, columns) for text in texts))
    order = choice[0] if order_by is None else parse_objective(order_by, senses, columns)
    return choice, order
