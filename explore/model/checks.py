"""Checks of a mechanism's declaration: names that exist, codes that differ, and columns that the kernel agrees with."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from enum import IntEnum
from typing import TypeVar

from explore.model.declaration import Declaration

_Item = TypeVar("_Item", str, int)

#: Fields of signals that share a row: properties of the row, not of the signal.
_ROW_FIELDS = ("row", "needs", "pole_order", "is_magnitude", "terms_row", "is_residual")


def check_declaration(declaration: Declaration) -> None:
    """Check a declaration.

    Raises
    ------
    ValueError
        With the first problem, in one sentence.
    """
    for problems in (_names, _codes, _parameters, _columns, _signals, _windows, _formulas, _defaults):
        for problem in problems(declaration):
            raise ValueError(f"mechanism '{declaration.name}': {problem}")


def _repeated(items: Iterable[_Item]) -> list[_Item]:
    return [item for item, count in Counter(items).items() if count > 1]


def _unknown(kind: str, names: Iterable[str], known: Collection[str], user: str) -> Iterator[str]:
    """A sentence for each name that is not known."""
    yield from (f"{user} names the {kind} '{name}', which does not exist" for name in names if name not in known)


def _names(declaration: Declaration) -> Iterator[str]:
    kinds = {
        "parameter": [parameter.name for parameter in declaration.parameters],
        "signal": [signal.name for signal in declaration.signals],
        "metric": [
            *(metric.name for metric in declaration.metrics),
            *(formula.name for formula in declaration.formulas),
        ],
        "window": [window.name for window in declaration.windows],
    }
    for kind, names in kinds.items():
        yield from (f"the {kind} '{name}' is declared twice" for name in _repeated(names))


def _codes(declaration: Declaration) -> Iterator[str]:
    for kind, codes in (("windows", [w.code for w in declaration.windows]), ("drives", declaration.drives.values())):
        yield from (f"two {kind} have the code {code}" for code in _repeated(codes))


def _parameters(declaration: Declaration) -> Iterator[str]:
    count = sum(parameter.scales_speed for parameter in declaration.parameters)
    if count != 1:
        yield f"{count} parameters scale the speed; exactly one must"
    for parameter in declaration.parameters:
        if parameter.default is not None and not parameter.allows(parameter.default):
            yield f"the default {parameter.default:g} of '{parameter.name}' is outside its own range"
    names = {parameter.name for parameter in declaration.parameters}
    yield from _unknown("parameter", declaration.loop_lengths, names, "loop_lengths")


def _columns(declaration: Declaration) -> Iterator[str]:
    """Problems of the kernel's columns: names and order must be those of the declaration."""
    checked: tuple[tuple[str, type[IntEnum], list[str]], ...] = (
        ("parameter_columns", declaration.parameter_columns, [p.name for p in declaration.kernel_parameters]),
        ("metric_columns", declaration.metric_columns, [metric.name for metric in declaration.metrics]),
    )
    for field, columns, declared in checked:
        in_kernel = {column.name.lower(): column.value for column in columns}
        in_declaration = {name: position for position, name in enumerate(declared)}
        for name in dict.fromkeys((*in_declaration, *in_kernel)):
            if in_kernel.get(name) != in_declaration.get(name):
                actual, expected = in_kernel.get(name, "absent"), in_declaration.get(name, "absent")
                yield f"{field} has '{name}' at {actual}, the declaration at {expected}"


def _signals(declaration: Declaration) -> Iterator[str]:
    by_name = {signal.name: signal for signal in declaration.signals}
    parameters = {parameter.name for parameter in declaration.parameters}
    for signal in declaration.signals:
        for field, row, first in (("row", signal.row, 0), ("terms_row", signal.terms_row, -1)):
            if not first <= row < declaration.signal_rows:
                yield f"{field} {row} of the signal '{signal.name}' is not one of the {declaration.signal_rows} rows"
        yield from _unknown("parameter", signal.required_loads, parameters, f"the signal '{signal.name}'")
        if signal.derivative_of:
            yield from _unknown("signal", [signal.derivative_of], by_name, f"derivative_of of '{signal.name}'")
        if signal.shares_row_with:
            yield from _unknown("signal", [signal.shares_row_with], by_name, f"the signal '{signal.name}'")
            other = by_name.get(signal.shares_row_with, signal)
            for field in _ROW_FIELDS:
                if getattr(signal, field) != getattr(other, field):
                    yield f"the signals '{signal.name}' and '{other.name}' share a row, but differ in {field}"
    own_rows = [signal.row for signal in declaration.signals if not signal.shares_row_with]
    for row in _repeated(own_rows):
        yield f"two signals have the row {row}; the second must say so in shares_row_with"


def _windows(declaration: Declaration) -> Iterator[str]:
    windows, signals = {window.name for window in declaration.windows}, {signal.name for signal in declaration.signals}
    for parameter in declaration.parameters:
        yield from _unknown("window", parameter.only_in, windows, f"only_in of '{parameter.name}'")
    for signal in declaration.signals:
        yield from _unknown("window", signal.only_in, windows, f"only_in of '{signal.name}'")
    yield from _unknown("window", [declaration.default_window], windows, "default_window")
    yield from _unknown("drive", [declaration.default_drive], declaration.drives, "default_drive")
    for signal_name, window_name in sorted(declaration.zero_mean):
        yield from _unknown("signal", [signal_name], signals, "zero_mean")
        yield from _unknown("window", [window_name], windows, "zero_mean")
    yield from _unknown("signal", declaration.output_signals.values(), signals, "output_signals")
    for field in ("output_signals", "default_metrics"):
        by_window = getattr(declaration, field)
        yield from _unknown("window", by_window, {"", *windows}, field)
        if "" not in by_window:
            yield f"{field} has no entry '' for the windows that it does not name"


def _formulas(declaration: Declaration) -> Iterator[str]:
    parameters = {parameter.name for parameter in declaration.parameters}
    known = {*declaration.metric_names(), *parameters}
    for formula in declaration.formulas:
        user = f"the formula '{formula.name}'"
        yield from _unknown("input", formula.inputs, known, user)
        yield from _unknown("parameter", (*formula.alternatives, *formula.optional), parameters, user)


def _defaults(declaration: Declaration) -> Iterator[str]:
    metrics = set(declaration.metric_names())
    for names in declaration.default_metrics.values():
        yield from _unknown("metric", names, metrics, "default_metrics")
    for objective in declaration.objectives:
        name, colon, sense = objective.partition(":")
        yield from _unknown("metric", [name], metrics, "objectives")
        if colon and sense not in ("min", "max"):
            yield f"the objective '{objective}' has no sense 'min' or 'max' after its colon"
