"""Overall size: the box around all positions of all links and points, along and across the line of the ground."""

from collections.abc import Callable

import numpy as np

from explore.model.quantities import FloatArray, Formula

#: Function of one array of shape (n,) for each input that returns a side of the box, mm, shape (n,).
Side = Callable[..., FloatArray]


def declare_size(
    axis: str, inputs: tuple[str, ...], width: Side, height: Side, optional: tuple[str, ...] = ()
) -> tuple[Formula, ...]:
    """Declare the metrics of the overall size: a box along a line, named `axis`, and across it.

    Both sides are functions of the metrics and parameters named by `inputs`, of which only motions with strokes have
    those in `optional`; they are `Extent` where points can be named.
    """
    extent = "extent of all positions of all links and points"
    return (
        Formula("envelope_width", "mm", f"{extent} along {axis}", "min", inputs, width, optional=optional),
        Formula("envelope_height", "mm", f"{extent} across {axis}", "min", inputs, height, optional=optional),
        Formula("footprint", "mm^2", "area of the box around all positions of all links and points", "min",
                ("envelope_width", "envelope_height"), np.multiply),
    )  # fmt: skip
