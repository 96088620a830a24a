"""Objectives from texts such as "cv" or "swing_angle:max"."""

from collections.abc import Callable, Mapping, Sequence

from explore.base.errors import RequestError
from explore.base.suggest import format_value, suggestion
from explore.model.quantities import Sense
from explore.model.request import Objective

#: Endings of the names of metrics whose smaller values are better in every mechanism.
_MINIMISED_ENDINGS = ("cv", "variance", "_std", "_rms", "_peak", "_peak_to_peak")


def read_objective(text: str, default_sense: Callable[[str], Sense | None]) -> Objective:
    """Make an objective from a text such as "cv" or "swing_angle:max".

    A sense in it overrides the default one of the name: `default_sense` returns None for a name without, and raises
    `RequestError` for what cannot be an objective.
    """
    name, colon, suffix = (part.strip() for part in text.partition(":"))
    sense = default_sense(name)
    if colon:
        if suffix not in ("min", "max"):
            raise RequestError(f"unknown sense {format_value(suffix)} of {name}; write {name}:min or {name}:max")
        sense = "max" if suffix == "max" else "min"
    if sense is None:
        raise RequestError(f"{name} has no default sense; write {name}:min or {name}:max")
    return Objective(name, sense)


def parse_objective(text: str, senses: Mapping[str, Sense | None], columns: Sequence[str]) -> Objective:
    """Make an objective of results from a text such as "cv" or "swing_angle:max".

    `senses` has the default sense of each metric, or None; only `columns` can be objectives.
    """

    def default_sense(name: str) -> Sense | None:
        if name not in columns:
            raise RequestError(f"no column '{name}' to rank by in these results; {suggestion(name, columns)}")
        return senses.get(name) or ("min" if name.endswith(_MINIMISED_ENDINGS) else None)

    return read_objective(text, default_sense)


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
    names = [each.metric for each in choice]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise RequestError(f"{twice} is an objective in both senses; remove one")
    order = choice[0] if order_by is None else parse_objective(order_by, senses, columns)
    return choice, order
