"""The loop of the crank of variable length: crank + rod = position of the slider, which is given.

Its derivative is the equation that publications integrate for the crank's length. Where crank and rod are perpendicular
its matrix is singular, and the branch of a continuous motion changes its sign.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from explore.mechanisms.linkages.coordinate import ZERO, constant, length
from explore.mechanisms.linkages.table import FRAME, Body, LinkageTable, Slot, TableParameter
from explore.mechanisms.loops import Columns, Given, LoopDeclaration
from explore.model.quantities import FloatArray

_ORIGIN = ZERO, ZERO
#: Coefficients of z^k in twice the smoothstep, by its order.
_SHARES = {1: {2: 6, 3: -4}, 2: {3: 20, 4: -30, 5: 12}, 3: {4: 70, 5: -168, 6: 140, 7: -40}}


def singular_angle(columns: Columns, functions: Any = np) -> Any:
    """Crank angle between 0 and pi where crank and rod are perpendicular."""
    rod, travel = columns["rod"], columns["slider_speed"] / columns["speed"]
    return functions.atan2(rod, travel * functions.sqrt(2 * rod / (rod + functions.hypot(rod, 2 * travel))))


def _law(columns: Columns, angle: Any, functions: Any) -> Given:
    """The slider's position: constant speed between smooth reversals; design after design and angle after angle."""
    inputs = [*(columns[name] for name in ("rod", "slider_speed", "speed", "reversal_time", "blend_order")), angle]
    if not isinstance(angle, np.ndarray):
        return _position(functions, *inputs)
    position, rate, second = _POSITIONS(math, *inputs)
    return position, rate, second


def _position(functions: Any, *inputs: Any) -> Given:
    """The position and its derivatives by the angle, from functions of floats or of mpmath."""
    rod, slider_speed, speed, time, order, angle = inputs
    if not all(map(functions.isfinite, inputs)) or order not in _SHARES or min(inputs[:4]) <= 0.0:
        return math.nan, math.nan, math.nan
    pi, travel, width = functions.pi, slider_speed / speed, speed * time
    turned = angle - 2 * pi * functions.floor(angle / (2 * pi) + 0.5)
    folded = abs(turned)
    side, sense = 1 if folded < pi / 2 else -1, 1 if turned > 0 else -1
    z = max(0.5 - min(folded, pi - folded) / width, 0 * width)
    terms = _SHARES[int(order)].items()
    lag = sum(c * z ** (k + 1) / (k + 1) for k, c in terms)
    share, slope = sum(c * z**k for k, c in terms), sum(c * k * z ** (k - 1) for k, c in terms)
    crank = travel * functions.sqrt(2 * rod / (rod + functions.hypot(rod, 2 * travel)))
    regular = functions.atan2(rod, crank)
    position = functions.hypot(rod, crank) - travel * (folded - regular + side * width * lag)
    return position, sense * travel * (share - 1), -side * travel / width * slope


_POSITIONS = np.vectorize(_position, otypes=[float] * 3)


def _motion(columns: Columns, angle: FloatArray, values: FloatArray) -> FloatArray:
    """Second derivatives from the curvature of the groove; the rod's rates from L sin + l sin(b) = 0."""
    (rod_angle, crank, rate, curvature), rod = values, columns["rod"]
    sine, cosine = np.sin(angle), np.cos(angle)
    rate, across = rate / columns["speed"], rod * np.cos(rod_angle)
    rod_rate = -(rate * sine + crank * cosine) / across
    square = crank * crank + rate * rate
    second = (square + rate * rate - curvature * square * np.sqrt(square)) / crank
    turning = second * sine + 2.0 * rate * cosine - crank * sine
    rod_second = (rod * np.sin(rod_angle) * rod_rate * rod_rate - turning) / across
    return np.stack([rod_angle, crank, rod_rate, rate, rod_second, second])


def _derived(columns: Columns, values: FloatArray) -> Mapping[str, FloatArray]:
    """The crank and the groove; slider and forces are given, or follow from all of them."""
    rod_angle, crank, _, rate, _, second = values
    square = crank * crank + rate * rate
    return {
        "crank": crank,
        "crank_rate": columns["speed"] * rate,
        "rod_angle": rod_angle,
        "groove_pressure_angle": np.arctan2(rate, crank),
        "groove_curvature": (square + rate * rate - crank * second) / (square * np.sqrt(square)),
    }


LOOP = LoopDeclaration(
    table=LinkageTable(
        driver="disc",
        output="",
        frame=Body(FRAME, (("pivot", _ORIGIN),)),
        links=(
            Body("disc", (("pivot", _ORIGIN),)),
            Body("rod", (("pin", _ORIGIN), ("slider pin", (length("rod"), ZERO)))),
        ),
        slots=(
            Slot("groove", "pin", "disc", (_ORIGIN, (constant(1.0), ZERO))),
            Slot("guide", "slider pin", FRAME, (_ORIGIN, (constant(1.0), ZERO))),
        ),
        slides=(),
        parameters=(TableParameter("rod", "mm", lower=0.0),),
    ),
    signals=("rod_angle", "crank", "crank_rate", "groove_curvature"),
    motion=_motion,
    # a slicer of 100 revolutions per minute
    design={
        "rod": 500.0,
        "slider_speed": 800.0,
        "speed": 100.0 * math.pi / 30.0,
        "reversal_time": 0.1,
        "blend_order": 2.0,
    },
    law=_law,
    singular_angle=singular_angle,
    derived=_derived,
)
