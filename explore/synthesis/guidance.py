"""Four-bars that carry a body through three, four or five poses exactly: pairs of dyads, and what they do between.

Two dyads make a four-bar whose coupler is the body. It meets the poses, but perhaps only on two branches, in another
order, or with a crank that does not turn: that is told of each pair.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.defects import OTHER_BRANCH, OTHER_CIRCUIT, PASSES, WRONG_ORDER
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.poses import Poses, burmester_curves, find_dyads, fixed_pivots

BoolArray = npt.NDArray[np.bool_]

#: Number of moving pivots that are tried for three poses.
_N_PIVOTS = 4096
#: Number of angles of the first link that are tried for four poses.
_N_ANGLES = 720
#: Largest number of dyads whose pairs are looked at.
_MOST_DYADS = 700


@dataclass(frozen=True)
class PivotBox:
    """Where a fixed pivot may be: corners, lower left and upper right, infinite where a side is open."""

    lowest: complex = complex(-np.inf, -np.inf)
    highest: complex = complex(np.inf, np.inf)

    def has(self, pivots: ComplexArray) -> BoolArray:
        """Whether pivots are inside, shape (n,); those on the edge, but for rounding errors, are."""
        beyond = 1e-9 * np.abs(pivots)
        return np.asarray(
            (pivots.real >= self.lowest.real - beyond) & (pivots.real <= self.highest.real + beyond)
            & (pivots.imag >= self.lowest.imag - beyond) & (pivots.imag <= self.highest.imag + beyond)
        )  # fmt: skip

    def draw(self, rng: np.random.Generator, count: int, centre: complex, reach: float) -> ComplexArray:
        """Pivots inside, evenly at random; along an axis with an open side, within a reach of a centre."""
        low = np.maximum([self.lowest.real, self.lowest.imag], [centre.real - reach, centre.imag - reach])
        high = np.minimum([self.highest.real, self.highest.imag], [centre.real + reach, centre.imag + reach])
        x, y = low[:, None] + np.maximum(high - low, 0.0)[:, None] * rng.uniform(size=(2, count))
        return np.asarray(x + 1j * y)


#: Boxes of the pivots of crank and rocker without bounds.
ANYWHERE = (PivotBox(), PivotBox())


@dataclass(frozen=True)
class Pairs:
    """Four-bars of pairs of dyads.

    Pivots of crank and rocker, complex (2, n), the moving ones in the first pose; fates between the poses; whether the
    crank turns fully; the least transmission angle, or its supplement, over the turn, rad, NaN for others; the branch
    in the first pose, as of `FourBar`; each (n,).
    """

    fixed: ComplexArray
    moving: ComplexArray
    fates: npt.NDArray[np.str_]
    turning: BoolArray
    transmission_angles: FloatArray
    branches: FloatArray

    @property
    def lengths(self) -> FloatArray:
        """Crank, coupler, rocker and ground, shape (4, n)."""
        crank, rocker = np.abs(self.moving - self.fixed)
        return np.array(
            [crank, np.abs(np.diff(self.moving, axis=0)[0]), rocker, np.abs(np.diff(self.fixed, axis=0)[0])]
        )

    def rows(self, chosen: npt.NDArray[Any]) -> Pairs:
        """Some of them."""
        columns = vars(self).values()
        return Pairs(*(column[:, chosen] if column.ndim == 2 else column[chosen] for column in columns))


def find_pairs(poses: Poses, length_max: float, seed: int = 0, boxes: tuple[PivotBox, PivotBox] = ANYWHERE) -> Pairs:
    """All four-bars of five poses; of four and three, some of many dyads with links up to a length.

    No link is longer than `length_max`, nor any moving pivot farther from the body's point. The seed is that of the
    choice among the dyads of three poses, which are a plane of points. The boxes bound the pivots of crank and rocker;
    of five poses all are returned, wherever they are.
    """
    n = len(poses.points)
    if n == 5:
        dyads = find_dyads(poses)
        fixed, moving = (np.array([getattr(each, name) for each in dyads]) for name in ("fixed", "moving"))
    elif n == 4:
        curves = burmester_curves(poses, np.linspace(0.0, 2.0 * np.pi, _N_ANGLES + 2)[1:-1])
        fixed, moving = (each.ravel() for each in curves)
    elif n == 3:
        fixed, moving = _dyads_of_three(poses, length_max, seed, boxes)
    else:
        raise RequestError(f"three to five poses can be met exactly, not {n}")
    if n < 5:
        with np.errstate(invalid="ignore"):
            near = (np.abs(moving - fixed) <= length_max) & (np.abs(moving - poses.points[0]) <= length_max)
        near &= boxes[0].has(fixed) | boxes[1].has(fixed)
        fixed, moving = fixed[near], moving[near]
        some = np.unique(np.linspace(0, max(len(fixed) - 1, 0), _MOST_DYADS).astype(np.int64))
        fixed, moving = (each[some] if len(each) else each for each in (fixed, moving))
    crank, rocker = np.nonzero(~np.eye(len(fixed), dtype=np.bool_))
    return _examined(poses, fixed[np.array([crank, rocker])], moving[np.array([crank, rocker])])


def _dyads_of_three(
    poses: Poses, length_max: float, seed: int, boxes: tuple[PivotBox, PivotBox]
) -> tuple[ComplexArray, ComplexArray]:
    """Fixed and moving pivots of dyads: from moving pivots at random, or from fixed ones where these have boxes.

    The distances of moving pivots spread evenly over the orders of magnitude between the size of the poses and the
    longest link: evenly over the plane, few would be near where links may be long, and small linkages be missed.
    """
    rng, first = np.random.default_rng(seed), complex(poses.points[0])
    if boxes == ANYWHERE:
        size = max(np.ptp(poses.points.real), np.ptp(poses.points.imag))
        shares = min(1.0, size / length_max) ** rng.uniform(size=_N_PIVOTS)
        moving = first + shares * (PivotBox().draw(rng, _N_PIVOTS, first, length_max) - first)
        return fixed_pivots(poses, moving), moving
    fixed = np.concatenate([box.draw(rng, _N_PIVOTS, first, 2.0 * length_max) for box in boxes])
    # Seen from the body the ground takes the inverse poses, and the two pivots of a dyad change places.
    turned = np.exp(-1j * (poses.angles - poses.angles[0]))
    inverse = Poses(first + turned * (first - poses.points), -poses.angles)
    return fixed, fixed_pivots(inverse, fixed)


def _examined(poses: Poses, fixed: ComplexArray, moving: ComplexArray) -> Pairs:
    """The motions of the pairs: fates, whether cranks turn, transmission angles."""
    rotations, shifts = poses.displacements()
    places = np.concatenate([moving[None], rotations[:, None, None] * moving + shifts[:, None, None]])
    pins, ends = places[:, 0], places[:, 1]  # [pose, pair]
    sides = np.where(((fixed[1] - pins).conj() * (ends - pins)).imag >= 0.0, 1.0, -1.0)
    empty = np.zeros(fixed.shape[1])
    pairs = Pairs(fixed, moving, empty.astype("<U16"), empty > 0.0, empty, sides[0])
    crank, coupler, rocker, ground = lengths = pairs.lengths
    ordered = np.sort(lengths, axis=0)
    turning = (np.minimum(crank, ground) == ordered[0]) & (ordered[0] + ordered[3] < ordered[1] + ordered[2])
    with np.errstate(invalid="ignore", divide="ignore"):
        cosines = [
            (coupler**2 + rocker**2 - side**2) / (2.0 * coupler * rocker) for side in (ground - crank, ground + crank)
        ]
        worst = np.arccos(np.abs(np.array(cosines)).max(axis=0))
    one_side = (sides == sides[0]).all(axis=0)
    passes, one_circuit = _passed(np.angle((pins - fixed[0]) * (fixed[1] - fixed[0]).conj()), lengths)
    # The two branches of a crank that turns are two circuits.
    one_circuit &= one_side | ~turning
    fates = np.where(one_side, np.where(passes, PASSES, WRONG_ORDER), OTHER_BRANCH)
    fates = np.where(one_circuit, fates, OTHER_CIRCUIT)
    return Pairs(fixed, moving, fates, turning, np.where(turning, worst, np.nan), sides[0])


def _passed(angles: FloatArray, lengths: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Whether the crank's angles from the frame, (poses, n), go one way, and whether one range of the crank has them.

    As `defects._ranges` says, the crank passes the angle 0 if coupler and rocker reach over the short distance there,
    and half a turn if they do over the long one. Where it passes neither, angles of both signs are on two circuits.
    """
    crank, coupler, rocker, ground = lengths
    is_ahead, is_back = np.abs(crank - ground) >= np.abs(coupler - rocker), crank + ground <= coupler + rocker
    steps = np.diff(np.where(is_back & ~is_ahead, angles % (2.0 * np.pi), angles), axis=0)
    one_way = (steps > 0.0).all(axis=0) | (steps < 0.0).all(axis=0)
    forwards, backwards = ((sense * steps % (2.0 * np.pi)).sum(axis=0) for sense in (1.0, -1.0))
    within_turn = np.minimum(forwards, backwards) < 2.0 * np.pi
    one_sign = (np.sign(angles) == np.sign(angles[0])).all(axis=0)
    return np.where(is_ahead & is_back, within_turn, one_way), is_ahead | is_back | one_sign
