"""A slider-crank without rounding: status and dead centres from lengths that are fractions."""

import math
from collections.abc import Mapping
from typing import Any

from explore.mechanisms.slider_crank import kernel
from explore.model.exact import ExactDesign
from explore.model.status import Status


def exact_slider_crank(parameters: Mapping[str, Any]) -> ExactDesign:
    """A slider-crank of these parameters; a margin of up to 4 units in the last place is a change point.

    With the friction of its guide, where forces are asked for, it may be locked.
    """
    crank, rod, offset = (parameters[name] for name in ("crank", "rod", "offset"))
    margin = rod - crank - abs(offset)
    metrics = {"turning_margin": margin}
    if abs(offset) - crank > rod:
        return ExactDesign(kernel.CANNOT_ASSEMBLE, metrics)
    if abs(margin) <= 4 * type(margin)(*math.ulp(float(rod)).as_integer_ratio()):
        return ExactDesign(kernel.CHANGE_POINT, metrics)
    if margin < 0:
        return ExactDesign(kernel.CRANK_BLOCKED, metrics)
    # Friction locks the slider where its coefficient is the inverse tangent of the steepest rod, or more.
    friction, height = parameters.get("friction", 0), crank + abs(offset)
    if rod * rod <= height * height * (1 + friction * friction) and friction > 0:
        return ExactDesign(kernel.GUIDE_LOCKED, metrics)
    marks = {}
    for name, sine, sign in (("outer", offset / (rod + crank), 1), ("inner", -offset / (rod - crank), -1)):
        marks[name] = sign * (1 - sine * sine), sine * abs(sine)
    return ExactDesign(int(Status.OK), metrics, marks)
