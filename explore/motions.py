"""The motion of one design by the method that suits it, and a warning where the method asked for does not."""

from __future__ import annotations

import warnings

import numpy as np

from explore.comparison.guidance import DEFAULT, by_label, cheapest
from explore.comparison.verdicts import Verdict, judge
from explore.errors import RequestError
from explore.mechanisms import four_bar
from explore.methods.closed_form import ClosedForm
from explore.methods.contract import Capability, Level, Method, Outcome, Task, label
from explore.vocabulary import Columns, FloatArray, Mechanism, Status

_LINKS = ("crank", "coupler", "rocker", "ground")
#: Rows of the kernel's scratch array in the order of `explore.methods.contract.Motion.signals`.
_ROWS = [
    four_bar.COUPLER_ANGLE, four_bar.ROCKER_ANGLE, four_bar.COUPLER_VELOCITY, four_bar.ROCKER_VELOCITY,
    four_bar.COUPLER_ACCELERATION, four_bar.ROCKER_ACCELERATION,
]  # fmt: skip


def motion_signals(
    mechanism: Mechanism, columns: Columns, crank_angle: FloatArray, method: str, tolerance: float
) -> tuple[Columns, str, str]:
    """All signals that exist outside clutches, in declared units, each of shape (t,); the method, and why this one.

    Parameters
    ----------
    columns
        Parameters of one design whose crank turns, each of shape (1,).
    crank_angle : (t,) array
        In degrees.
    method, tolerance
        As `explore.simulate` says.

    Raises
    ------
    RequestError
        If there is no such method, or the angles do not suit it.
    """
    if not 0.0 < tolerance < 1.0:
        raise RequestError(f"tolerance = {tolerance:g}; give a number between 0 and 1")
    inputs = {p.name: p.default for p in mechanism.parameters if p.default is not None}
    inputs |= {name: float(column[0]) for name, column in columns.items()}
    chosen, why = _choose(mechanism, inputs, method, tolerance)
    if chosen.name == DEFAULT:
        rows = _closed_form(mechanism, inputs, crank_angle)
    else:
        rows = _by_method(chosen, inputs, np.deg2rad(crank_angle), tolerance)
    speed = inputs[mechanism.speed.name]
    signals: Columns = {}
    for s in mechanism.signals:
        if not s.only_in:
            values = np.sqrt(rows[s.row]) if s.magnitude else rows[s.row]
            signals[s.name] = values * (np.rad2deg(1.0) if s.unit == "deg" else speed**s.speed_power)
    return signals, label(chosen), why


def _choose(mechanism: Mechanism, inputs: dict[str, float], method: str, tolerance: float) -> tuple[Method, str]:
    if mechanism.fill is not four_bar.fill:
        if method not in ("auto", DEFAULT):
            raise RequestError(f"{mechanism.name} has its closed form only; leave out method={method!r}")
        return ClosedForm(), "the only one there is"
    if method != "auto":
        return by_label(method), "asked for"
    lengths = [inputs[name] for name in _LINKS]
    return cheapest(four_bar.classify(*lengths)[1] / max(lengths), tolerance)


def _closed_form(mechanism: Mechanism, inputs: dict[str, float], crank_angle: FloatArray) -> FloatArray:
    """The scratch array at crank angles in degrees, shape (s, t)."""
    geometry = np.array([[inputs[p.name] for p in mechanism.kernel_parameters]])
    kernel = np.zeros((1, mechanism.kernel_size))
    mechanism.closed_form(
        geometry, np.empty((len(mechanism.metrics), 1)), np.zeros(1, np.int8), kernel, np.ones((1, 3)), np.ones(1)
    )
    # Half the offset from the nearest multiple of 180 degrees, so that both sine and cosine keep their digits.
    quarter = np.round(crank_angle / 180.0)
    offset = np.deg2rad(crank_angle - 180.0 * quarter) / 2.0
    turn = quarter % 4.0
    sine, cosine = np.sin(offset), np.cos(offset)
    sin_half = np.select([turn == 0.0, turn == 1.0, turn == 2.0], [sine, cosine, -sine], -cosine)
    cos_half = np.select([turn == 0.0, turn == 1.0, turn == 2.0], [cosine, -sine, -cosine], sine)
    out = np.zeros((mechanism.signal_rows, len(crank_angle)))
    needs = int(np.bitwise_or.reduce([signal.needs for signal in mechanism.signals]))
    mechanism.fill(kernel[0], sin_half, cos_half, len(crank_angle), needs, out)
    return out


def _by_method(method: Method, inputs: dict[str, float], crank_angle: FloatArray, tolerance: float) -> FloatArray:
    """The scratch array at crank angles in rad by another method, judged against the closed form; shape (s, t)."""
    if Capability.ANY_ANGLE not in method.capabilities and (np.diff(crank_angle) <= 0.0).any():
        raise RequestError(f"{label(method)} goes from one crank angle to the next; give ascending angles")
    lengths = np.array([[inputs[name] for name in _LINKS]])
    task = Task(lengths, np.array([inputs["branch"]]), crank_angle[None, :], Level.ACCELERATIONS)
    motion = method.solve(task)
    judgement = judge(task, motion, ClosedForm().solve(task).signals, tolerance)
    verdict = Verdict(int(judgement.verdict[0]))
    if verdict is not Verdict.RIGHT:
        _warn(label(method), verdict, Outcome(int(motion.outcome[0])), judgement.largest[:, 0], tolerance)
    rows = np.empty((four_bar.SIGNAL_ROWS, len(crank_angle)))
    rows[_ROWS] = motion.signals[:, 0]
    difference = motion.signals[0, 0] - motion.signals[1, 0]
    rows[four_bar.TRANSMISSION_ANGLE] = np.abs(np.remainder(difference + np.pi, 2.0 * np.pi) - np.pi)
    return rows


def _warn(name: str, verdict: Verdict, outcome: Outcome, errors: FloatArray, tolerance: float) -> None:
    if outcome is not Outcome.OK:
        what = f"failed here: {outcome.sentence}"
    else:
        what = "is on the wrong branch here" if verdict is Verdict.WRONG_BRANCH else f"misses {tolerance:g} here"
        angle, velocity, acceleration = errors
        what += f": it is off by {angle:.1e} rad, {velocity:.1e} of the largest velocity"
        what += f" and {acceleration:.1e} of the largest acceleration, measured against the closed form"
    warnings.warn(f"{name} {what}; method='auto' chooses one that is right", RuntimeWarning, stacklevel=5)


def window_limits(mechanism: Mechanism, columns: Columns, window: str, drive: str) -> tuple[float, float] | None:
    """First and last crank angle of a stroke, deg, the last the larger; None when the output has no strokes.

    Parameters
    ----------
    columns
        Parameters of one design whose crank turns, each of shape (1,).
    window
        A window that is one stroke, such as "drive".
    drive
        The stroke that "drive" means.
    """
    inputs = [columns[p.name] if p.name in columns else np.array([p.default]) for p in mechanism.kernel_parameters]
    status, kernel = np.zeros(1, np.int8), np.zeros((1, mechanism.kernel_size))
    metrics, singular = np.empty((len(mechanism.metrics), 1)), np.ones((1, 3))
    geometry = np.ascontiguousarray(np.column_stack(inputs), dtype=np.float64)
    mechanism.closed_form(geometry, metrics, status, kernel, singular, np.ones(1))
    if status[0] != Status.OK:
        return None
    parts = np.zeros((4, 3))
    code = next(known.code for known in mechanism.windows if known.name == window)
    mechanism.pieces(kernel[0], code, mechanism.drives[drive], 0.0, 0.0, parts)
    anchor, first, last = parts[0]
    start, stop = (180.0 * anchor + 2.0 * np.rad2deg(np.arctan(half)) for half in (first, last))
    return float(start), float(stop)
