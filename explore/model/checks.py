"""Checks of a mechanism's declaration: codes that differ, and columns that the kernel agrees with."""

import math
import re
from collections.abc import Iterator
from dataclasses import fields

from explore.model.declaration import ANCHORS, INTERVAL_ROWS, Declaration, own_row
from explore.model.drawing_checks import check_drawing
from explore.model.name_checks import check_names, repeated, unknown_names
from explore.model.points import MOST_POINTS, POINT_ROWS, SLOT_ROWS
from explore.model.quadrature import MOST_BREAKS, MOST_SENSES, MOST_SINGULARITIES, Adaptive, Located
from explore.model.status import OWN_CODES, Status

#: Fields of signals that share a row: properties of the row, not of the signal.
_ROW_FIELDS = ("row", "needs", "pole_order", "is_magnitude", "terms_row", "lag_row", "is_residual", "has_corners",
               "corners_at", "has_own_singularities")  # fmt: skip

#: Fields that are the row of a constant, or -1.
_CONSTANT_ROWS = ("noise_row", "closed_error_row", "phases_row", "variant_row")

#: Units of signals that no length parameter scales.
_PLAIN_UNIT = re.compile(r"(1|deg|rad)?(/s(\^\d)?)?")


def check_declaration(declaration: Declaration) -> None:
    """Check a declaration; a ValueError has the first problem, in one sentence."""
    checks = (
        check_names, _parameters, check_drawing, _columns, _statuses, _signals, _references, _windows, _closed_forms,
        _formulas, _defaults, _extended,
    )  # fmt: skip
    for problems in checks:
        for problem in problems(declaration):
            raise ValueError(f"mechanism '{declaration.name}': {problem}")


def _parameters(declaration: Declaration) -> Iterator[str]:
    if not declaration.kernel_parameters or not (declaration.metrics or declaration.signals):
        yield "a mechanism has at least one parameter, and a closed-form metric or a signal"
    speeds = [parameter.name for parameter in declaration.parameters if parameter.scales_speed]
    if len(speeds) > 1:
        yield f"{len(speeds)} parameters scale the speed, {' and '.join(speeds)}; at most one does"
    if not speeds:
        for parameter in declaration.parameters:
            if parameter.is_dynamic:
                yield f"'{parameter.name}' makes loads depend on the speed, but no parameter scales the speed"
        for signal in declaration.signals:
            if signal.speed_power:
                yield f"the signal '{signal.name}' has a power of the speed, but no parameter scales the speed"
    for parameter in declaration.parameters:
        if not parameter.lower < parameter.upper:
            yield f"the range of '{parameter.name}' is empty: above {parameter.lower:g}, up to {parameter.upper:g}"
        for choice in parameter.choices:
            if not parameter.allows(choice):
                yield f"the choice {choice:g} of '{parameter.name}' is outside its own range"
        if parameter.default is not None and not parameter.allows(parameter.default):
            yield f"the default {parameter.default:g} of '{parameter.name}' is outside its own range"
        if parameter.adds_jumps and not (declaration.extended or declaration).breaks:
            yield f"'{parameter.name}' adds jumps, but no breaks say where"
        if parameter.adds_jumps and parameter.affects != "load":
            yield f"'{parameter.name}' adds jumps, but is no load"
    by_name = {parameter.name: parameter for parameter in declaration.parameters}
    yield from unknown_names("parameter", declaration.loop_lengths, by_name, "loop_lengths")
    for name in declaration.loop_lengths:
        if by_name[name].scales_speed or by_name[name].choices or by_name[name].affects != "motion":
            yield f"loop_lengths names '{name}', which is not a length"
    if len(declaration.loop_lengths) == 1:
        yield f"loop_lengths has only '{declaration.loop_lengths[0]}'; a loop has at least two lengths"


def _columns(declaration: Declaration) -> Iterator[str]:
    """Problems of the record's rows: names and order must be those of the declaration."""
    own = {own_row(parameter.name): parameter.name for parameter in declaration.parameters}
    rows = {own.get(row.name, row.name.lower()): int(row) for row in declaration.rows}
    if rows.get("status") != declaration.n_constants:
        row = rows.get("status", "absent")
        yield f"the row of the status is {row}; it follows the {declaration.n_constants} constants"
    has_slots = declaration.floating_link is not None and declaration.extended is None
    names = [
        *(parameter.name for parameter in declaration.kernel_parameters if parameter.affects != "point"),
        *(map(str.lower, SLOT_ROWS) if has_slots else ()),
        *(map(str.lower, INTERVAL_ROWS) if declaration.takes_interval else ()),
        *(metric.name for metric in declaration.metrics),
    ]
    for position, name in enumerate(names, declaration.n_constants + 1):
        if rows.get(name) != position:
            yield f"rows has '{name}' at {rows.get(name, 'absent')}, the declaration at {position}"
    for name, row in rows.items():
        if row > declaration.n_constants and name not in names and not name.startswith("_"):
            yield f"rows has '{name}' at {row}, the declaration at absent"
    if not 0 <= declaration.n_fill_constants <= declaration.n_constants:
        yield f"fill reads {declaration.n_fill_constants} constants of {declaration.n_constants}"
    for row in declaration.integrated_rows:
        if not 0 <= row < declaration.signal_rows:
            yield f"integrated_rows names the row {row}, which is not one of the {declaration.signal_rows} signal rows"
    constants = [("marks", row, 0) for row in declaration.marks.values()]
    constants += [("singularities", row, 0) for row, _ in declaration.singularities]
    constants += [(name, getattr(declaration, name), -1) for name in _CONSTANT_ROWS]
    yield from _points(declaration)
    for field, row, first in constants:
        if not first <= row < declaration.n_constants:
            yield f"{field} names the row {row}, which is not one of the {declaration.n_constants} constants"
    if not isinstance(declaration.quadrature, Adaptive) and not declaration.singularities:
        yield "the quadrature is graded, but names no singularities; without them it is adaptive"
    if len(declaration.breaks) > MOST_BREAKS:
        yield f"breaks has {len(declaration.breaks)} marks; at most {MOST_BREAKS} are used"
    if declaration.breaks and declaration.senses:
        yield "it has both breaks and senses; the law of a panel says only one of them"
    if len(declaration.senses) > MOST_SENSES:
        yield f"senses has {len(declaration.senses)} signals; at most {MOST_SENSES} are told"
    if len(declaration.singularities) > MOST_SINGULARITIES:
        yield f"singularities has {len(declaration.singularities)} entries; at most {MOST_SINGULARITIES} are used"
    for _, anchor in declaration.singularities:
        if anchor not in (0, 1) and not isinstance(declaration.quadrature, Located):
            yield f"singularities names the anchor {anchor}; it is 0 or, for its opposite, 1"


def _points(declaration: Declaration) -> Iterator[str]:
    """Problems of the link whose points can be named."""
    link = declaration.floating_link
    if link is None:
        return
    kernel, drawing = declaration.extended or declaration, declaration.drawing
    if not link.kernels and kernel.signal_rows < link.first_row + MOST_POINTS * POINT_ROWS:
        yield f"the points of '{link.name}' need {MOST_POINTS * POINT_ROWS} signal rows from {link.first_row} on"
    yield from unknown_names("signal", [link.angle], [signal.name for signal in declaration.signals], "floating_link")
    if drawing is not None:
        yield from unknown_names("point", [link.origin], drawing.points, "floating_link")
        yield from unknown_names("link", [link.name], [each.name for each in drawing.links], "floating_link")


def _statuses(declaration: Declaration) -> Iterator[str]:
    for code, status in declaration.statuses.items():
        if code not in OWN_CODES:
            yield f"the status '{status.label}' has the code {code}; a mechanism's own are 2 to 5 and 20 to 127"
    labels = [status.label for status in (*Status, *declaration.statuses.values())]
    yield from (f"two statuses have the label '{label}'" for label in repeated(labels))


def _references(declaration: Declaration) -> Iterator[str]:
    """Problems of what signals are derivatives of and relative to."""
    by_name = {signal.name: signal for signal in declaration.signals}
    lengths = {parameter.name for parameter in declaration.kernel_parameters if not parameter.scales_speed}
    corners = [(signal.name, signal.has_corners, signal.corners_at) for signal in declaration.signals]
    corners += [(each.name, each.adds_corners, each.corners_at) for each in declaration.parameters]
    yield from unknown_names("signal", declaration.senses, by_name, "senses")
    for name, has_corners, corners_at in corners:
        if corners_at:
            yield from unknown_names("signal", corners_at, by_name, f"corners_at of '{name}'")
            if not has_corners:
                yield f"corners_at of '{name}' names a signal, but '{name}' is not declared to have corners"
    for signal in declaration.signals:
        if signal.derivative_of:
            yield from unknown_names("signal", [signal.derivative_of], by_name, f"derivative_of of '{signal.name}'")
        if signal.relative_to:
            yield from unknown_names("length", [signal.relative_to], lengths, f"relative_to of '{signal.name}'")
    for signal in declaration.signals:
        names = [signal.name]
        while by_name[names[-1]].derivative_of and len(names) <= len(by_name):
            names.append(by_name[names[-1]].derivative_of)
        if len(names) > len(by_name):
            yield f"the signal '{signal.name}' is, by derivative_of, a derivative of itself"
    for signal in declaration.signals:
        reference = declaration.reference(signal)
        is_bounded = declaration.knows_rounding or reference is not None or signal.terms_row >= 0
        if not is_bounded and not _PLAIN_UNIT.fullmatch(signal.unit):
            yield f"the signal '{signal.name}' is in {signal.unit}; relative_to names the length that it grows with"
        if signal.shares_row_with and reference != declaration.reference(by_name[signal.shares_row_with]):
            yield f"the signals '{signal.name}' and '{signal.shares_row_with}' share a row, but differ in relative_to"


def _signals(declaration: Declaration) -> Iterator[str]:
    by_name = {signal.name: signal for signal in declaration.signals}
    parameters = {parameter.name for parameter in declaration.parameters}
    signal_rows: float = (declaration.extended or declaration).signal_rows
    if declaration.points and declaration.floating_link and declaration.floating_link.kernels:
        signal_rows = math.inf  # a kernel has no rows for signals that it leaves to others
    for signal in declaration.signals:
        for field, row, first in (("row", signal.row, 0), ("terms_row", signal.terms_row, -1)):
            if not first <= row < signal_rows:
                yield f"{field} {row} of the signal '{signal.name}' is not one of the {signal_rows} rows"
        if signal.pole_order not in (2, 4, 6):
            yield f"pole_order of the signal '{signal.name}' is {signal.pole_order}; it is 2, 4 or 6"
        yield from unknown_names("parameter", signal.required_loads, parameters, f"the signal '{signal.name}'")
        marks = {*declaration.marks, *ANCHORS}
        yield from unknown_names("mark", signal.extremes_at, marks, f"extremes_at of '{signal.name}'")
        if signal.shares_row_with:
            yield from unknown_names("signal", [signal.shares_row_with], by_name, f"the signal '{signal.name}'")
            other = by_name.get(signal.shares_row_with, signal)
            for field in _ROW_FIELDS:
                if getattr(signal, field) != getattr(other, field):
                    yield f"the signals '{signal.name}' and '{other.name}' share a row, but differ in {field}"
    own_rows = [signal.row for signal in declaration.signals if not signal.shares_row_with]
    for row in repeated(own_rows):
        yield f"two signals have the row {row}; the second must say so in shares_row_with"


def _windows(declaration: Declaration) -> Iterator[str]:
    yield from unknown_names("mark", declaration.breaks, declaration.marks, "breaks")
    yield from unknown_names("window", declaration.strokes, [w.name for w in declaration.windows], "strokes")
    for window in declaration.windows:
        yield from unknown_names("mark", window.ends, declaration.marks, f"the window '{window.name}'")
        if len(window.ends) != (2 if window.kind == "arc" else 0):
            yield f"the window '{window.name}' has {len(window.ends)} ends; an arc has two marks, no other kind has any"
        if len(set(window.ends)) < len(window.ends):
            yield f"the window '{window.name}' ends where it begins, at the mark '{window.ends[0]}'"
        if window.name == "interval" and window.kind != "interval":
            yield f"the window 'interval' is of kind '{window.kind}'; that name is of explicit angles"
        if window.kind == "interval" and window.name != "interval" and not declaration.takes_interval:
            yield f"the window '{window.name}' limits the input angle, which needs takes_interval"
    count = sum(window.is_whole for window in declaration.windows)
    if count != 1:
        yield f"{count} windows are the full turn or the range of input angles; exactly one is"
    yield from _strokes(declaration)
    windows, signals = {window.name for window in declaration.windows}, {signal.name for signal in declaration.signals}
    for parameter in declaration.parameters:
        yield from unknown_names("window", parameter.only_in, windows, f"only_in of '{parameter.name}'")
    for signal in declaration.signals:
        yield from unknown_names("window", signal.only_in, windows, f"only_in of '{signal.name}'")
    yield from unknown_names("window", [declaration.default_window], windows, "default_window")
    for signal_name, window_name in sorted(declaration.zero_mean):
        yield from unknown_names("signal", [signal_name], signals, "zero_mean")
        yield from unknown_names("window", [window_name], windows, "zero_mean")
    yield from unknown_names("signal", declaration.output_signals.values(), signals, "output_signals")
    for field in ("output_signals", "default_metrics"):
        by_window = getattr(declaration, field)
        yield from unknown_names("window", by_window, {"", *windows}, field)
        if "" not in by_window:
            yield f"{field} has no entry '' for the windows that it does not name"


def _strokes(declaration: Declaration) -> Iterator[str]:
    """Problems of the windows that depend on the drive."""
    for window in declaration.windows:
        if window.name in declaration.strokes and window.kind != "arc":
            yield f"the stroke '{window.name}' is not an arc"
    strokes = [declaration.window(name) for name in declaration.strokes]
    if len(strokes) == 2 and strokes[0].ends != strokes[1].ends[::-1]:
        yield f"the strokes '{strokes[0].name}' and '{strokes[1].name}' do not make up the turn"
    dependent = [window for window in declaration.windows if window.kind in ("drive", "return", "clutch")]
    if dependent and not declaration.drives:
        yield f"the window '{dependent[0].name}' needs drives"
    for window in dependent:
        if len(declaration.strokes) != 2:
            yield f"the window '{window.name}' needs two strokes"
        if window.kind == "clutch":
            if declaration.phases_row < 0:
                yield f"the window '{window.name}' needs a phases_row"
            name = declaration.output_signals.get(window.name)
            for signal in declaration.signals:
                if signal.name == name and declaration.derivative(signal) is None:
                    yield f"the window '{window.name}' needs a signal that is the derivative of '{name}'"
    for drive in declaration.drives:
        if drive not in ("slow", "fast", *declaration.strokes):
            yield f"the drive '{drive}' is neither slow nor fast nor a stroke"


def _closed_forms(declaration: Declaration) -> Iterator[str]:
    statistics = {*declaration.metric_names()} - {metric.name for metric in declaration.metrics}
    for metric in declaration.metrics:
        if metric.closed_form_of and metric.closed_form_of not in statistics:
            yield f"'{metric.name}' is the closed form of '{metric.closed_form_of}', which is no statistic of a signal"


def _formulas(declaration: Declaration) -> Iterator[str]:
    parameters = {parameter.name for parameter in declaration.parameters}
    known = {*declaration.metric_names(), *parameters}
    for formula in declaration.formulas:
        user = f"the formula '{formula.name}'"
        yield from unknown_names("input", formula.inputs, known, user)
        yield from unknown_names("parameter", formula.alternatives, parameters, user)
        yield from unknown_names("parameter", formula.optional, known, user)


def _defaults(declaration: Declaration) -> Iterator[str]:
    metrics = set(declaration.metric_names())
    for names in declaration.default_metrics.values():
        yield from unknown_names("metric", names, metrics, "default_metrics")
    for objective in declaration.objectives:
        name, colon, sense = objective.partition(":")
        yield from unknown_names("metric", [name], metrics, "objectives")
        if colon and sense not in ("min", "max"):
            yield f"the objective '{objective}' has no sense 'min' or 'max' after its colon"


#: Fields in which an extended mechanism may differ: all that its kernel fills or takes, and how that is integrated.
_KERNEL_FIELDS = (
    "rows", "n_constants", "n_fill_constants", "phases_row", "variant_row", "signal_rows", "breaks", "quadrature",
    "integrals", "integrated_rows", "close", "fill", "disturbed_fill", "precise_close", "precise_fill",
    "disturbed_precise_fill", "keeps_constants", "extended",
)  # fmt: skip


def _extended(declaration: Declaration) -> Iterator[str]:
    if declaration.extended is None:
        return
    for name in (field.name for field in fields(declaration) if field.name not in _KERNEL_FIELDS):
        if getattr(declaration, name) != getattr(declaration.extended, name):
            yield f"its extended mechanism differs in {name}"
    taken = {parameter.name for parameter in declaration.kernel_parameters}
    for parameter in declaration.geometry:
        if parameter.affects == "motion" and parameter.name not in taken:
            yield f"rows has no '{parameter.name}', on which the motion depends"
    if declaration.extended.signal_rows <= declaration.signal_rows:
        yield "its extended mechanism has no more signal rows"
