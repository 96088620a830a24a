"""Angles of links of a table that turn fully, whose signals have no middle of a range to be continuous about."""

from collections.abc import Callable

import numpy as np

from explore.mechanisms.linkages.programs import FIRST_REFERENCE
from explore.mechanisms.linkages.table import PREFIX, LinkageTable
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray

#: Number of crank angles, from one end to the other, at which the direction of a link is followed.
_NODES = 4096
#: Largest turn of a link from one of these to the next, rad.
_LARGEST_STEP = 1.0


def turning_angles(
    mechanism: Mechanism,
    constants: FloatArray,
    input_angle: FloatArray,
    ends: tuple[float, float],
    fill: Callable[[FloatArray, FloatArray], FloatArray],
) -> dict[int, FloatArray]:
    """Rows of such angles, rad, at input angles (t,) in deg, that go on from the first of the `ends`, deg.

    `constants` are those of one design, and `fill` has the rows of signals, (s, t), from constants and input angles.
    """
    table = mechanism.table
    if not isinstance(table, LinkageTable) or not mechanism.name.startswith(PREFIX):
        return {}  # built-in ones have a table for their drawings
    names = {f"{link.name}_angle" for link in table.links}
    rows = [signal.row for signal in mechanism.signals if signal.name in names and mechanism.fills(signal)]
    references = constants[FIRST_REFERENCE : FIRST_REFERENCE + 3 * len(rows)].reshape(-1, 3)
    if not np.isnan(references).any():
        return {}
    # about the x axis in place of the middles
    directed = constants.copy()
    directed[FIRST_REFERENCE : FIRST_REFERENCE + references.size] = np.where(
        np.isnan(references), [0.0, 1.0, 0.0], references
    ).ravel()
    start, length = ends[0], ends[1] - ends[0]
    nodes = start + length * np.linspace(0.0, 1.0, _NODES + 1)
    blank = [row for row in rows if np.isnan(fill(constants, nodes[:1])[row, 0])]
    coarse, fine = fill(directed, nodes)[blank], fill(directed, input_angle)[blank]
    followed = np.unwrap(coarse, axis=1)
    turns = np.floor((input_angle - start) / length) if length == 360.0 else np.zeros(len(input_angle))
    found = {}
    for row, nearest, angles in zip(blank, followed, fine, strict=True):
        if np.abs(np.diff(nearest)).max() < _LARGEST_STEP:
            rough = np.interp(input_angle - length * turns, nodes, nearest) + turns * (nearest[-1] - nearest[0])
            found[row] = angles + 2.0 * np.pi * np.round((rough - angles) / (2.0 * np.pi))
    return found
