"""Metrics of the user's own: formulas over parameters, metrics and statistics, checked and put in order."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter

from explore.base.entries import note_unknown
from explore.base.errors import Problems, RequestError
from explore.base.suggest import format_value
from explore.base.units.quantities import check_unit
from explore.model.expressions import Expression
from explore.model.mechanism import Mechanism
from explore.model.quantities import ComputedMetric, DerivedMetric, Formula, Metric, Parameter
from explore.model.window import Window
from explore.studies.request.formula_text import FormulaText, parse_formula
from explore.studies.request.names import find_input
from explore.studies.request.user_names import reason_against_name

_KEYS = ("formula", "unit")
_EXAMPLE = '{ formula = "coupler + ground", unit = "mm" }'
#: Largest number of steps of a formula and of the formulas it uses.
_MOST_STEPS = 1000
#: Largest number of formulas in a row that each use the next.
_MOST_LEVELS = 50

_NOTHING = Expression("", (("number", 0.0),))


@dataclass
class _Draft:
    """A formula whose names are not resolved."""

    text: FormulaText
    unit: str


def resolve_formulas(
    mechanism: Mechanism, entries: Mapping[str, object], window: Window, problems: Problems
) -> dict[str, DerivedMetric]:
    """The metrics that formulas define, by name, in the order of the entries ``{"formula": …, "unit": …}``.

    The keys of problems begin with "formulas". A formula with a mistake is replaced by one without inputs, so that what
    names it has no problem of its own.
    """
    drafts: dict[str, _Draft] = {}
    metrics: dict[str, DerivedMetric] = {}
    for name, entry in entries.items():
        reason = reason_against_name(mechanism, name)
        if reason:
            problems.append((("formulas", name), reason))
            continue
        metrics[name] = _metric(name, "1", _NOTHING, ())
        draft = _read_entry(name, entry, problems)
        if draft is not None:
            drafts[name] = draft
    resolver = _Resolver(mechanism, window, metrics)
    for name in _in_order(drafts, problems):
        problems += [(("formulas", name, "formula"), reason) for reason in resolver.add(name, drafts[name])]
    return resolver.metrics


@dataclass
class _Resolver:
    """Resolves the names of one formula after the other; `metrics` has those without problems."""

    mechanism: Mechanism
    window: Window
    metrics: dict[str, DerivedMetric]
    _sizes: dict[str, int] = field(default_factory=dict)
    _levels: dict[str, int] = field(default_factory=dict)

    def add(self, name: str, draft: _Draft) -> list[str]:
        """Resolve a formula after those that it uses; return the reasons why it cannot be."""
        expression, names = draft.text.expression, draft.text.names
        size = len(expression.steps) + sum(self._sizes.get(used, 0) for used in names)
        level = 1 + max((self._levels.get(used, 0) for used in names), default=0)
        if size > _MOST_STEPS:
            return [f"has {size:,} numbers, names and operators with the formulas it uses, above {_MOST_STEPS:,}"]
        if level > _MOST_LEVELS:
            return [f"uses formulas that use formulas, more than {_MOST_LEVELS} in a row; write some of them out"]
        inputs, reasons = [], []
        for used, position in names.items():
            try:
                inputs.append(self._find(used))
            except RequestError as error:
                reasons.append(f"at character {position + 1}: {error}")
        if not reasons:
            self.metrics[name] = _metric(name, draft.unit, expression, tuple(inputs))
            self._sizes[name], self._levels[name] = size, level
        return reasons

    def _find(self, name: str) -> ComputedMetric | Parameter:
        source = find_input(self.mechanism, name, self.window, self.metrics)
        if isinstance(source, Metric) and source.labels:
            raise RequestError(f"{name} is a label, not a quantity, so a formula cannot use it")
        return source


def _metric(
    name: str, unit: str, expression: Expression, inputs: tuple[ComputedMetric | Parameter, ...]
) -> DerivedMetric:
    names = tuple(source.name for source in inputs)
    formula = Formula(name, unit, expression.text, None, names, expression)
    return DerivedMetric(name, unit, expression.text, None, formula, inputs)


def _read_entry(name: str, entry: object, problems: Problems) -> _Draft | None:
    """The formula and the unit of an entry; None if there is a problem."""
    key = ("formulas", name)
    n_before = len(problems)
    if not isinstance(entry, Mapping):
        problems.append((key, f"must be a table such as {_EXAMPLE}, got {format_value(entry)}"))
        return None
    unknown = note_unknown(entry, _KEYS, problems, key)
    for word in _KEYS:
        if word not in entry and not unknown:
            problems.append((key, f"the key '{word}' is missing; a complete table is {_EXAMPLE}"))
        elif word in entry and not isinstance(entry[word], str):
            problems.append(((*key, word), f"must be a string in quotes, got {format_value(entry[word])}"))
    if len(problems) > n_before:
        return None
    unit = str(entry["unit"])
    try:
        check_unit(unit)
    except RequestError as error:
        problems.append(((*key, "unit"), str(error)))
    try:
        text = parse_formula(str(entry["formula"]))
        _check_meaning(text, unit)
    except RequestError as error:
        problems.append(((*key, "formula"), str(error)))
        return None
    return _Draft(text, unit) if len(problems) == n_before else None


def _check_meaning(text: FormulaText, unit: str) -> None:
    if not text.names:
        raise RequestError("names no parameter or metric, so it is the same in all designs")
    if text.expression.steps[-1][0] == "atan2" and unit == "rad":
        raise RequestError('atan2 gives degrees; write unit = "deg", or multiply it by pi / 180')


def _in_order(drafts: Mapping[str, _Draft], problems: Problems) -> list[str]:
    """The names, each after those that its formula uses; a cycle is one problem, and its members are left out."""
    graph = {name: [used for used in draft.text.names if used in drafts] for name, draft in drafts.items()}
    in_cycles: set[str] = set()
    while True:
        try:
            order = list(TopologicalSorter(graph).static_order())
        except CycleError as error:
            # The members, each of which uses the next; the line begins with the one that is first in the study.
            cycle = error.args[1][:0:-1]
            first = cycle.index(next(name for name in graph if name in cycle))
            chain = [*cycle[first:], *cycle[:first], cycle[first]]
            shown = " -> ".join(chain if len(chain) <= 6 else [*chain[:5], "…", chain[-1]])
            problems.append((("formulas", chain[0], "formula"), f"{chain[0]} is a function of itself: {shown}"))
            in_cycles.update(cycle)
            graph |= {name: [] for name in cycle}
            continue
        return [name for name in order if name not in in_cycles]
