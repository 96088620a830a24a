"""The vector loop of a four-bar linkage: residual, determinant and rates.

For the methods that iterate or integrate angles.

::

    r1 e^{i theta_1} + r2 e^{i theta_2} - r4 - r3 e^{i theta_3} = 0

All functions broadcast; ``lengths`` unpacks to r1 … r4, so the lengths are on the first axis. The formulas are those of
textbooks (Norton, Design of Machinery, sections 4.5, 6.7 and 7.3), with the cancellations that the comparison shows.
"""

from __future__ import annotations

import numpy as np

from explore.model.quantities import FloatArray


def residual(lengths: FloatArray, crank: FloatArray, coupler: FloatArray, rocker: FloatArray) -> FloatArray:
    """Components x and y of the gap in the loop, in the unit of the lengths, first axis 2."""
    r1, r2, r3, r4 = lengths
    x = r1 * np.cos(crank) + r2 * np.cos(coupler) - r4 - r3 * np.cos(rocker)
    y = r1 * np.sin(crank) + r2 * np.sin(coupler) - r3 * np.sin(rocker)
    return np.stack([x, y])


def determinant(lengths: FloatArray, coupler: FloatArray, rocker: FloatArray) -> FloatArray:
    """Determinant of the Jacobian of the loop by both angles; its sign is opposite to that of the branch."""
    return np.asarray(lengths[1] * lengths[2] * np.sin(coupler - rocker))


def newton_correction(lengths: FloatArray, gap: FloatArray, coupler: FloatArray, rocker: FloatArray) -> FloatArray:
    """Newton step of both angles, first axis 2."""
    r2, r3 = lengths[1], lengths[2]
    jacobian = determinant(lengths, coupler, rocker)
    # J = [[-r2 sin, r3 sin], [r2 cos, -r3 cos]]
    by_coupler = r3 * (np.cos(rocker) * gap[0] + np.sin(rocker) * gap[1]) / jacobian
    by_rocker = r2 * (np.cos(coupler) * gap[0] + np.sin(coupler) * gap[1]) / jacobian
    return np.stack([by_coupler, by_rocker])


def velocities(lengths: FloatArray, crank: FloatArray, coupler: FloatArray, rocker: FloatArray) -> FloatArray:
    """First derivatives of coupler and rocker angle by the crank angle, first axis 2."""
    r1, r2, r3, _ = lengths
    w2 = r1 * np.sin(rocker - crank) / (r2 * np.sin(coupler - rocker))
    w3 = r1 * np.sin(crank - coupler) / (r3 * np.sin(rocker - coupler))
    return np.stack([w2, w3])


def accelerations(
    lengths: FloatArray, crank: FloatArray, coupler: FloatArray, rocker: FloatArray, rates: FloatArray
) -> FloatArray:
    """Second derivatives of both angles by the crank angle, first axis 2."""
    r1, r2, r3, _ = lengths
    w2, w3 = rates
    a2 = r3 * w3 * w3 - r1 * np.cos(crank - rocker) - r2 * w2 * w2 * np.cos(coupler - rocker)
    a3 = r1 * np.cos(crank - coupler) + r2 * w2 * w2 - r3 * w3 * w3 * np.cos(rocker - coupler)
    return np.stack([a2 / (r2 * np.sin(coupler - rocker)), a3 / (r3 * np.sin(rocker - coupler))])


def fill_signals(
    signals: FloatArray, lengths: FloatArray, crank: FloatArray, coupler: FloatArray, rocker: FloatArray
) -> None:
    """Fill ``signals[2 level, …]`` with the angles, and with velocities and accelerations as far as it has rows."""
    signals[0], signals[1] = coupler, rocker
    with np.errstate(all="ignore"):  # at a toggle position the quotients are not finite
        if len(signals) > 2:
            signals[2:4] = velocities(lengths, crank, coupler, rocker)
        if len(signals) > 4:
            signals[4:6] = accelerations(lengths, crank, coupler, rocker, signals[2:4])
