"""Reference motion of the loops with a slider in multiple precision (mpmath), and of all loops by the task.

The slider-crank follows from the sine of the rod's angle, the variable crank from the root of its quadratic equation,
both differentiated step by step; there are digits enough for all that cancels.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from explore.comparison.methods.contract import Outcome, Task
from explore.comparison.methods.geometry import geometric_outcome
from explore.comparison.reference import exact_motion, multiple_precision
from explore.model.quantities import FloatArray

#: Coefficients of z^k in twice the smoothstep, by its order.
_SHARES = {1: {2: 6, 3: -4}, 2: {3: 20, 4: -30, 5: 12}, 3: {4: 70, 5: -168, 6: 140, 7: -40}}


def exact_motion_of(task: Task) -> FloatArray:
    """The six rows of a motion of a task, rounded once, shape (6, n, t); NaN for a design without a motion."""
    motion_at = _MOTIONS.get(task.loop.name)
    if motion_at is None:
        return exact_motion(task.parameters, task.branch, task.crank_angle)
    signals = np.full((6, *task.crank_angle.shape), np.nan)
    for i in np.flatnonzero(geometric_outcome(task.parameters, task.loop) == Outcome.OK):
        design = [multiple_precision().mpf(float(parameter)) for parameter in task.parameters[i]]
        for j, theta in enumerate(task.crank_angle[i]):
            signals[:, i, j] = [float(x) for x in motion_at(multiple_precision().mpf(float(theta)), *design)]
    return signals


def _slider_crank(theta: Any, crank: Any, rod: Any, offset: Any) -> tuple[Any, ...]:
    """Slider and rod at a crank angle."""
    mp = multiple_precision()
    cosine, sine = mp.cos_sin(theta)
    across = offset - crank * sine
    along = mp.sqrt(rod * rod - across * across)
    w = -crank * cosine / along
    dw = (crank * sine + across * w * w) / along
    velocity = -crank * sine - across * w
    acceleration = -crank * cosine - along * w * w - across * dw
    return crank * cosine + along, mp.asin(across / rod), velocity, w, acceleration, dw


def _variable_crank(theta: Any, rod: Any, slider_speed: Any, speed: Any, time: Any, order: Any) -> tuple[Any, ...]:
    """Crank length and rod at a crank angle; the way back is the mirror image of the way there."""
    mp = multiple_precision()
    turned = theta - 2 * mp.pi * mp.floor(theta / (2 * mp.pi))
    back = turned > mp.pi
    angle = 2 * mp.pi - turned if back else turned
    travel, width = slider_speed / speed, speed * time
    regular_crank = mp.sqrt((-rod * rod + rod * mp.sqrt(rod * rod + 4 * travel * travel)) / 2)
    regular = mp.atan2(rod, regular_crank)
    lag, share, slope = _reversal(mp, int(order), min(angle, mp.pi - angle), width)
    side = 1 if angle < mp.pi / 2 else -1
    x = mp.hypot(rod, regular_crank) - travel * (angle - regular) - side * travel * width * lag
    x1, x2 = -travel * (1 - share), -side * travel / width * slope
    cosine, sine = mp.cos_sin(angle)
    y, y1 = x * sine, x1 * sine + x * cosine
    y2 = x2 * sine + 2 * x1 * cosine - x * sine
    root = mp.sqrt(rod * rod - y * y) * (1 if angle > regular else -1)
    root1 = -y * y1 / root
    root2 = -(y1 * y1 + y * y2 + root1 * root1) / root
    crank = x * cosine + root
    rate = x1 * cosine - x * sine + root1
    second = x2 * cosine - 2 * x1 * sine - x * cosine + root2
    across, across1 = -crank * sine, -rate * sine - crank * cosine
    across2 = -second * sine - 2 * rate * cosine + crank * sine
    along = mp.sqrt(rod * rod - across * across)
    w = across1 / along
    dw = (across2 + across * w * w) / along
    sense = -1 if back else 1
    return crank, sense * mp.asin(across / rod), sense * rate, w, second, sense * dw


def _reversal(mp: Any, order: int, near: Any, width: Any) -> tuple[Any, Any, Any]:
    """Lag over travel and width, share of the speed that is missing, and its slope, near a dead centre."""
    z = mp.mpf(1) / 2 - near / width
    if z <= 0:
        return mp.zero, mp.zero, mp.zero
    terms = _SHARES[order].items()
    return (
        sum(c * z ** (k + 1) / (k + 1) for k, c in terms),
        sum(c * z**k for k, c in terms),
        sum(c * k * z ** (k - 1) for k, c in terms),
    )


_MOTIONS: dict[str, Callable[..., tuple[Any, ...]]] = {
    "slider-crank": _slider_crank,
    "variable-crank": _variable_crank,
}
