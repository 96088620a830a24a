"""Cubic splines through points of an exact curve, with as many points as a deviation needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.figures.charts.turn import Span
from explore.figures.exporting.shapes import Spline
from explore.model.quantities import FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

#: Largest deviation of a spline from its curve, mm.
DEVIATION = 1e-3
#: Largest deviation of a spline from its curve as a share of its extent, which holds for small curves.
_RELATIVE_DEVIATION = 1e-5
#: Share of the deviation that the spline aims at, because it is measured at a few places only.
_MARGIN = 0.5
#: Number of intervals of a turn at first.
_FIRST_INTERVALS = 32
#: Least number of intervals of a part of a turn at first.
_LEAST_INTERVALS = 4
#: Largest number of halvings of an interval, whose length is then that of rounding errors of angles.
_ROUNDS = 24
#: Step of the difference quotient for slopes, deg: jumps of curvature change them by less than its thousandth.
_STEP = 1e-3
#: Places where the deviation is measured, as shares of the way between two points.
_PLACES = np.array([0.25, 0.5, 0.75])


def fit_curve(
    curve: Callable[[FloatArray], FloatArray], span: Span, breaks: Sequence[float], layer: str, name: str
) -> Spline:
    """A spline of a curve, a function from angles, deg, to points, (t, 2); over a turn it is closed.

    Its first derivative by the angle is continuous, its second but at the breaks, where the curve's law changes, or
    where there are none at 0. A part of a turn has no breaks.
    """
    if not span.is_turn:
        return _fit_parts(curve, [span.evenly(_FIRST_INTERVALS + 1)], None, layer, name)
    joints = np.unique(np.mod(breaks, 360.0)) if len(breaks) else np.zeros(1)
    ends = np.append(joints, joints[0] + 360.0)
    slopes = (curve(joints + _STEP) - curve(joints - _STEP)) / (2.0 * _STEP)
    counts = np.maximum(np.rint(np.diff(ends) / 360.0 * _FIRST_INTERVALS).astype(int), _LEAST_INTERVALS)
    spans = [np.linspace(*pair, count + 1) for pair, count in zip(pairwise(ends.tolist()), counts, strict=True)]
    return _fit_parts(curve, spans, slopes, layer, name)


def _fit_parts(
    curve: Callable[[FloatArray], FloatArray],
    spans: list[FloatArray],
    slopes: FloatArray | None,
    layer: str,
    name: str,
) -> Spline:
    """The spline of spans of angles that follow one another, with more angles where they are too few."""
    for _ in range(_ROUNDS):
        parts = _interpolate(curve, spans, slopes)
        deviations = [_deviations(curve, part, span) for part, span in zip(parts, spans, strict=True)]
        extent = float(np.ptp(np.vstack([part.c for part in parts]), axis=0).max())
        limit = _MARGIN * min(DEVIATION, _RELATIVE_DEVIATION * extent)
        if max(deviation.max() for deviation in deviations) <= limit:
            break
        spans = [_halved(span, deviation > limit) for span, deviation in zip(spans, deviations, strict=True)]
    knots, controls = _joined(parts)
    if slopes is not None:
        controls[-1] = controls[0]  # to the last bit, so that the curve is closed
    return Spline(layer, name, knots, controls, max(float(deviation.max()) for deviation in deviations))


def _interpolate(
    curve: Callable[[FloatArray], FloatArray], spans: Sequence[FloatArray], slopes: FloatArray | None
) -> list[BSpline]:
    """The spline of each span through the points at its angles, with slopes, shape (s, 2), where spans begin.

    Without slopes the curve is open, and its ends follow from the points beside them.
    """
    from scipy.interpolate import make_interp_spline

    if slopes is None:
        return [make_interp_spline(span, curve(span), 3) for span in spans]
    parts = []
    starts = [curve(span[:1])[0] for span in spans]
    for k, span in enumerate(spans):
        after = (k + 1) % len(spans)
        points = curve(span)
        points[-1] = starts[after]  # joints are the same to the last bit, and the curve is closed
        ends = ([(1, slopes[k])], [(1, slopes[after])])
        parts.append(make_interp_spline(span, points, 3, bc_type=ends))  # type: ignore[arg-type]  # SciPy takes slopes
    return parts


def _deviations(curve: Callable[[FloatArray], FloatArray], part: BSpline, span: FloatArray) -> FloatArray:
    """The largest deviation between each angle of a span and the next."""
    places = (span[:-1, None] + np.diff(span)[:, None] * _PLACES).ravel()
    return np.asarray(np.hypot(*(part(places) - curve(places)).T).reshape(-1, len(_PLACES)).max(axis=1))


def _halved(span: FloatArray, is_coarse: npt.NDArray[np.bool_]) -> FloatArray:
    """The angles with another in the middle of each coarse interval."""
    middles = 0.5 * (span[:-1] + span[1:])
    return np.sort(np.append(span, middles[is_coarse]))


def _joined(parts: Sequence[BSpline]) -> tuple[FloatArray, FloatArray]:
    """Knots and control points of one spline from those of its parts, which begin where those before them end."""
    first, *others = parts
    knots = [first.t[:-1], *(part.t[4:-1] for part in others), parts[-1].t[-1:]]
    controls = [first.c, *(part.c[1:] for part in others)]
    return np.concatenate(knots), np.vstack(controls)
