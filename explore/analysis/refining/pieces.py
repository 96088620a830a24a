"""Quadratic pieces of an objective and of margins, and the best step that they allow.

Where an objective has kinks, as a peak that two crank angles share, it is locally the largest of several smooth
functions. Each sample tells the one that holds there, by value, first and second derivatives, which extrapolate it
across the kink. The step minimises the largest of all pieces of the objective, where no piece of a margin is negative.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray

#: Function from positions, shape (n, d), to values of several functions, (n, k).
Functions = Callable[[FloatArray], FloatArray]
#: Kind of the pieces of the objective; margins are 1, 2, …
OBJECTIVE = 0
#: Difference from the value at the position, of the change over the radius, from which on a piece does not hold there.
_OTHER = 1e-5


@dataclass(frozen=True)
class Pieces:
    """Quadratic functions about places (n, d): kinds (n,), values (n,), slopes (n, d), and bends (n, d, d)."""

    kinds: npt.NDArray[np.int64]
    places: FloatArray
    values: FloatArray
    slopes: FloatArray
    bends: FloatArray

    def chosen(self, which: npt.NDArray[Any]) -> Pieces:
        """Some of them."""
        return Pieces(*(array[which] for array in vars(self).values()))

    def joined(self, other: Pieces) -> Pieces:
        """These and others behind them."""
        return Pieces(*(np.concatenate(pair) for pair in zip(vars(self).values(), vars(other).values(), strict=True)))

    def at(self, position: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values, (n,), and slopes, (n, d), at a position."""
        steps = position - self.places
        turned = np.einsum("nab,nb->na", self.bends, steps)
        values = self.values + np.einsum("na,na->n", self.slopes + 0.5 * turned, steps)
        return np.asarray(values), self.slopes + turned


def pieces_at(functions: Functions, places: FloatArray, step: float) -> Pieces:
    """The pieces that hold at places, (m, d), from differences over a step; without those that are not defined."""
    d = places.shape[1]
    axes, pairs = np.eye(d), [(a, b) for a in range(d) for b in range(a)]
    both = np.array([axes[a] + axes[b] for a, b in pairs]).reshape(-1, d)
    offsets = np.concatenate([np.zeros((1, d)), axes, -axes, both, -both])
    places = np.clip(places, step, 1.0 - step)
    found = functions((places[:, None] + step * offsets).reshape(-1, d)).reshape(len(places), len(offsets), -1)
    is_defined = np.isfinite(found).all(axis=(1, 2))
    places, found, m = places[is_defined], found[is_defined], int(is_defined.sum())
    centre, above, below = found[:, 0], found[:, 1 : d + 1], found[:, d + 1 : 2 * d + 1]
    count = found.shape[2]
    sums = found[:, 2 * d + 1 :].reshape(m, 2, len(pairs), count).sum(axis=1) - 2.0 * centre[:, None]
    bends = np.zeros((m, count, d, d))
    for a in range(d):
        bends[:, :, a, a] = (above[:, a] + below[:, a] - 2.0 * centre) / step**2
    for k, (a, b) in enumerate(pairs):
        mixed = 0.5 * (sums[:, k] / step**2 - bends[:, :, a, a] - bends[:, :, b, b])
        bends[:, :, a, b] = bends[:, :, b, a] = mixed
    slopes = np.swapaxes(above - below, 1, 2) / (2.0 * step)
    return Pieces(
        np.tile(np.arange(count), m), np.repeat(places, count, axis=0), centre.reshape(-1),
        slopes.reshape(-1, d), bends.reshape(-1, d, d),
    )  # fmt: skip


def best_step(pieces: Pieces, position: FloatArray, now: FloatArray, radius: float) -> tuple[FloatArray, float]:
    """The step of at most `radius` in each coordinate to the least objective, and how much less that is.

    `now` has the objective and the margins at the position.
    """
    from scipy.optimize import minimize

    d = len(position)
    pieces, signs, scales = _holding(pieces, position, now, radius)
    is_objective = pieces.kinds == OBJECTIVE
    if not is_objective.any():
        return np.zeros(d), 0.0
    size = float(scales[is_objective][0])
    level = np.where(is_objective, now[OBJECTIVE], 0.0)

    def change(z: FloatArray) -> float:
        """The last of the variables: of the objective, over its scale."""
        return float(z[d])

    def rooms(z: FloatArray) -> FloatArray:
        return np.asarray(signs * (pieces.at(position + radius * z[:d])[0] - level) / scales + is_objective * z[d])

    def slopes(z: FloatArray) -> FloatArray:
        steep = pieces.at(position + radius * z[:d])[1] * (radius * signs / scales)[:, None]
        return np.column_stack([steep, is_objective])

    bounds = [*zip(np.maximum(-1.0, -position / radius), np.minimum(1.0, (1.0 - position) / radius), strict=True)]
    arguments: dict[str, Any] = {
        "jac": lambda _: np.append(np.zeros(d), 1.0),
        "bounds": [*bounds, (None, None)],
        "constraints": [{"type": "ineq", "fun": rooms, "jac": slopes}],
        "options": {"maxiter": 50, "ftol": 1e-8},
    }
    found = minimize(change, np.zeros(d + 1), method="SLSQP", **arguments)
    return np.nan_to_num(radius * found.x[:d]), float(-found.x[d] * size)


def _holding(
    pieces: Pieces, position: FloatArray, now: FloatArray, radius: float
) -> tuple[Pieces, FloatArray, FloatArray]:
    """The pieces that say of the position nothing worse than is, with the sign of what is good and a scale of each.

    Others are differences across a kink, or hold beyond one of a function that is the least of several.
    """
    scales, here = np.empty(len(pieces.kinds)), np.empty(len(pieces.kinds))
    for kind in np.unique(pieces.kinds):
        own = pieces.kinds == kind
        scales[own] = radius * float(np.abs(pieces.slopes[own]).max()) or 1.0
        here[own] = now[kind]
    signs = np.where(pieces.kinds == OBJECTIVE, -1.0, 1.0)
    holds = signs * (pieces.at(position)[0] - here) >= -_OTHER * scales
    return pieces.chosen(holds), signs[holds], scales[holds]
