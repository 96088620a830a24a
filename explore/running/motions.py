"""The motion of one design, by the closed form or by another method with its errors measured."""

import warnings
from functools import partial

import numpy as np

from explore.base.errors import MotionError, RequestError
from explore.base.lanes.designs import fill_motion_of_design
from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Capability, Level, Method, Outcome, Task, method_label
from explore.comparison.methods.loops import find_loop, follow_unknowns
from explore.comparison.methods.registry import check_method, find_method
from explore.comparison.verdicts import Verdict, judge
from explore.evaluation.evaluate import LARGEST_PARAMETER, SMALLEST_PARAMETER, evaluate_columns
from explore.evaluation.windows import find_laws, window_ends
from explore.model.columns import Arrays
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray
from explore.model.status import Status
from explore.model.window import Window
from explore.running.turning_angles import turning_angles
from explore.studies.request.names import make_window
from explore.studies.request.parameters import read_value
from explore.studies.request.requests import make_request

#: A turn of the input, deg.
_TURN = 360.0
#: Words for the whole motion of a limited mechanism, and of others.
_WHOLE = ("motion over its range", "full turn")
#: Least span of a motion over given angles, deg: one angle has none.
_LEAST_SPAN = 1e-9


def motion_interval(mechanism: Mechanism, columns: Arrays, input_angle: FloatArray | None) -> Window | None:
    """None for a design that has its whole motion, else the interval of the given angles, deg, if any are given.

    A `MotionError` says that there is no motion at the angles.
    """
    limits = mechanism.limits
    whole = (float(limits.start), float(limits.stop)) if limits else (0.0, _TURN)
    least, greatest = whole if input_angle is None else (float(input_angle.min()), float(input_angle.max()))
    if limits:
        turn = limits.turns_into(least, greatest)
        if turn is None:
            outside = least if least < whole[0] else greatest
            raise MotionError(f"{outside:g} deg is outside the range of the crank, {whole[0]:g} to {whole[1]:g} deg")
        least, greatest = least + turn, greatest + turn
    sentence = _whole_motion_lacks(mechanism, columns)
    if sentence is None:
        return None
    if greatest - least >= whole[1] - whole[0]:
        raise MotionError(f"no {_WHOLE[limits is None]} to simulate: {sentence}")
    interval = _interval(mechanism, least, greatest)
    status = int(mechanism.evaluate_closed_form(_geometry(mechanism, columns), interval).status[0])
    if status in mechanism.moving_statuses:
        return interval
    if status in mechanism.statuses:  # what the interval lacks may be something else than what the turn does
        sentence = mechanism.status_sentences[mechanism.status_labels[status]]
    place = f"from {least:g} to {greatest:g} deg" if greatest > least else f"at {least:g} deg"
    raise MotionError(f"no motion {place}: {sentence}")


def whole_motion_angles(mechanism: Mechanism, count: int) -> FloatArray:
    """Evenly spaced input angles, deg: those of the turn from 0, or from end to end of a range."""
    if mechanism.limits:
        ends = float(mechanism.limits.start), float(mechanism.limits.stop)
        return np.asarray(np.linspace(*ends, max(count, 0)), dtype=np.float64)
    return np.asarray(np.arange(count) * _TURN / max(count, 1), dtype=np.float64)


def motion_span(mechanism: Mechanism, columns: Arrays, interval: Window | None) -> tuple[float, float]:
    """First and last input angle, deg, of the whole motion of a design, or of an interval where it lacks the whole."""
    whole = mechanism.limits
    if interval and _whole_motion_lacks(mechanism, columns) is not None:
        whole = interval
    return (float(whole.start), float(whole.stop)) if whole else (0.0, _TURN)


def _whole_motion_lacks(mechanism: Mechanism, columns: Arrays) -> str | None:
    """Why a design lacks its whole motion, as a sentence; None if it has it.

    A `MotionError` says that it has no motion over any interval either.
    """
    request = make_request(mechanism, metrics=[mechanism.any_metric], window=mechanism.whole_motion.name)
    status = int(evaluate_columns(request, columns).columns["status"][0])
    if status == Status.NOT_FINITE:
        _refuse_unusable(mechanism, columns)
    # Whether the motion exists is asked, not whether the statistic of a mechanism without closed forms is exact enough.
    if status in (Status.OK, Status.TOLERANCE_NOT_MET):
        return None
    sentence = mechanism.status_sentences[mechanism.status_labels[status]]
    if status in mechanism.statuses and mechanism.statuses[status].lacks_turn and mechanism.takes_interval:
        return sentence
    raise MotionError(f"no {_WHOLE[mechanism.limits is None]} to simulate: {sentence}")


def _interval(mechanism: Mechanism, least: float, greatest: float) -> Window:
    """The interval of given input angles, deg, within the range of a limited mechanism."""
    ends = {"from": least, "to": max(greatest, least + _LEAST_SPAN)}
    if mechanism.limits and ends["to"] > mechanism.limits.stop:
        ends = {"from": greatest - _LEAST_SPAN, "to": greatest}
    return make_window(mechanism, ends)


def _refuse_unusable(mechanism: Mechanism, columns: Arrays) -> None:
    """Raise `RequestError` that names the first parameter of a design whose value is out of its range, if one is."""
    for name, column in columns.items():
        parameter, value = mechanism.parameter(name), float(column[0])
        try:
            read_value(parameter, value)
        except RequestError as error:
            raise RequestError(f"{name}: {error}") from None
        if value != 0.0 and not SMALLEST_PARAMETER < abs(value) <= LARGEST_PARAMETER:
            limits = f"{SMALLEST_PARAMETER:g} to {LARGEST_PARAMETER:g}"
            raise RequestError(f"{name}: {value:g} is outside {limits}, the magnitudes that are computed with")


def motion_signals(
    mechanism: Mechanism,
    columns: Arrays,
    input_angle: FloatArray,
    method: str,
    tolerance: float,
    interval: Window | None = None,
) -> tuple[Arrays, str, tuple[str, ...]]:
    """Solve the motion of one design that makes a full turn, or moves over the interval, at angles (t,) in deg.

    Its parameters are of shape (1,), `method` and `tolerance` those of `explore.simulate`. The first result has the
    signals in declared units, each of shape (t,), except those that exist only behind clutches; and, where a kernel of
    their own fills them, those under load of a design without one, without the strokes they need, or whose status under
    load is that of no unique forces. By another method than the closed form those that follow from the unknowns of the
    mechanism's loop. The second is the name and the setting of the method, the third the names of the signals that only
    the closed form has. A `RequestError` says that there is no such method, that it does not solve the mechanism, or
    that it needs ascending crank angles.
    """
    if not 0.0 < tolerance < 1.0:
        raise RequestError(f"tolerance = {tolerance:g}; give a number between 0 and 1")
    inputs = {p.name: p.default for p in mechanism.parameters if p.default is not None}
    inputs |= {name: float(column[0]) for name, column in columns.items()}
    solver = find_method(method)
    status = _status(mechanism, columns)
    has_stroke = status not in mechanism.statuses or not mechanism.statuses[status].lacks_strokes
    filled = [
        signal
        for signal in mechanism.signals
        if mechanism.fills(signal)
        or (
            (not signal.required_loads or any(inputs[name] != 0.0 for name in signal.required_loads))
            and (has_stroke or not signal.needs_stroke)
        )
    ]
    if _status(mechanism.kernel_of(filled), columns) != status:
        filled = [signal for signal in filled if not signal.depends_on_load]
    if isinstance(solver, ClosedForm):
        rows = dict(enumerate(_closed_form(mechanism.kernel_of(filled), inputs, input_angle, interval)))
    elif mechanism.points:
        raise RequestError(f"points have only the closed form; leave out method={method!r}, or the points")
    else:
        rows = _by_method(solver, mechanism, inputs, np.deg2rad(input_angle), tolerance)
    speed = inputs[mechanism.speed.name] if mechanism.speed else 1.0
    signals: Arrays = {}
    for signal in filled if isinstance(solver, ClosedForm) else filter(mechanism.fills, filled):
        if not signal.only_in and signal.row in rows:
            values = np.sqrt(rows[signal.row]) if signal.is_magnitude else rows[signal.row]
            signals[signal.name] = values * (np.rad2deg(1.0) if signal.unit == "deg" else speed**signal.speed_power)
    left_out = [] if isinstance(solver, ClosedForm) else [s.name for s in filled if s.name not in signals]
    return signals, method_label(solver), tuple(left_out)


def _closed_form(
    mechanism: Mechanism, inputs: dict[str, float], input_angle: FloatArray, interval: Window | None
) -> FloatArray:
    """Rows of the signals at input angles in degrees, shape (s, t)."""
    geometry = np.array([[inputs[p.name]] for p in mechanism.kernel_parameters])
    constants = np.ascontiguousarray(mechanism.constants(geometry, interval)[:, 0])
    signals = _fill(mechanism, constants, input_angle)
    part = interval or mechanism.limits
    ends = (float(part.start), float(part.stop)) if part else (0.0, _TURN)
    for row, angles in turning_angles(mechanism, constants, input_angle, ends, partial(_fill, mechanism)).items():
        signals[row] = angles
    return signals


def _fill(mechanism: Mechanism, constants: FloatArray, input_angle: FloatArray) -> FloatArray:
    """Rows of the signals of one design, from its constants."""
    input_angle = np.fmod(input_angle, 360.0)  # whole turns are exact in degrees, and would not be in radians
    # The offset from the anchor or its opposite, whichever is nearer, keeps all digits of sine and cosine; half turns
    # are taken off first, because the offset of an angle beside the opposite would be rounded.
    anchor = np.rad2deg(mechanism.anchor_angle)
    half_turns = np.round((input_angle - anchor) / 180.0)
    tangents = np.tan(0.5 * np.deg2rad((input_angle - 180.0 * half_turns) - anchor))
    anchors = (half_turns % 2.0).astype(np.int64)
    signals = np.zeros((mechanism.signal_rows, len(input_angle)))
    needs = int(np.bitwise_or.reduce([signal.needs for signal in mechanism.signals if mechanism.fills(signal)]))
    variant = int(constants[mechanism.variant_row]) if mechanism.variant_row >= 0 else 0
    laws = find_laws(mechanism, constants, np.deg2rad(input_angle))
    fill_motion_of_design(
        mechanism.fill, constants, anchors, laws, tangents, variant, needs, mechanism.signal_rows, signals
    )
    return signals


def _by_method(
    method: Method, mechanism: Mechanism, inputs: dict[str, float], crank_angle: FloatArray, tolerance: float
) -> dict[int, FloatArray]:
    """Rows of the kernel at crank angles in rad by another method, with a warning if it is inaccurate."""
    loop = find_loop(mechanism)
    check_method(method, loop)
    if Capability.ANY_ANGLE not in method.capabilities and (np.diff(crank_angle) <= 0.0).any():
        raise RequestError(f"{method_label(method)} proceeds from one crank angle to the next; give ascending angles")
    parameters = np.array([[inputs[name] for name in loop.parameters]])
    task = Task(loop, parameters, crank_angle[None, :], Level.ACCELERATIONS)
    motion = method.solve(task)
    judgement = judge(task, motion, ClosedForm().solve(task).signals, tolerance)
    verdict = Verdict(int(judgement.verdict[0]))
    if verdict is not Verdict.ACCURATE:
        _warn(method_label(method), verdict, Outcome(int(motion.outcome[0])), judgement.max_error[:, 0], tolerance)
    values = follow_unknowns(mechanism, loop, inputs, motion.signals[:, 0])
    return {mechanism.signal(name).row: each for name, each in values.items()}


def _warn(name: str, verdict: Verdict, outcome: Outcome, errors: FloatArray, tolerance: float) -> None:
    if outcome is not Outcome.OK:
        problem = f"failed for this design: {outcome.sentence}"
    else:
        problem = "is on the wrong branch" if verdict is Verdict.WRONG_BRANCH else f"misses the tolerance {tolerance:g}"
        angle, velocity, acceleration = errors
        problem += f" for this design: its errors against the closed form are {angle:.1e} rad, {velocity:.1e} of the"
        problem += f" largest velocity and {acceleration:.1e} of the largest acceleration"
    warnings.warn(f"{name} {problem}; the default method, the closed form, is exact", RuntimeWarning, stacklevel=5)


def window_limits(mechanism: Mechanism, columns: Arrays, window: str, drive: str) -> tuple[float, float] | None:
    """First and last input angle of a stroke, deg, ascending; None if the output has no strokes.

    The columns are parameters of one design that can make a full turn, each of shape (1,). The window is one stroke,
    such as "drive", which means the stroke `drive`.
    """
    geometry = _geometry(mechanism, columns)
    if _status(mechanism, columns) != Status.OK:
        return None
    start, stop = np.rad2deg(window_ends(mechanism, mechanism.constants(geometry), mechanism.window(window), drive)[0])
    return float(start), float(stop)


def mark_angles(mechanism: Mechanism, columns: Arrays) -> dict[str, float]:
    """Input angles of the marks of one design by name, deg; those that the design does not have are left out."""
    constants = mechanism.constants(_geometry(mechanism, columns))[:, 0]
    offsets = {name: 2.0 * np.arctan(constants[row]) for name, row in mechanism.marks.items()}
    angles = {name: float(np.rad2deg(mechanism.anchor_angle + offset)) for name, offset in offsets.items()}
    return {name: angle for name, angle in angles.items() if np.isfinite(angle)}


def _status(mechanism: Mechanism, columns: Arrays) -> int:
    return int(mechanism.evaluate_closed_form(_geometry(mechanism, columns)).status[0])


def _geometry(mechanism: Mechanism, columns: Arrays) -> FloatArray:
    """What the closed form takes of one design, shape (p, 1)."""
    return np.stack([columns.get(p.name, np.array([p.default])) for p in mechanism.kernel_parameters])
