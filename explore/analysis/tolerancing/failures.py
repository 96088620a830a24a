"""The probability that a part misses a constraint or has no motion, down to one in many millions, with an interval.

Where the parts that were drawn hold enough failures, their share is the probability. Otherwise importance sampling
takes over, in standard normal scores of the dimensions: draws with a larger spread find failures, each is followed to
the nearest one in its direction, the most probable failure, and parts are drawn around these points. A part counts with
the ratio of its density to that of the draws. A fifth of the draws keep the larger spread, so that the weight of a
failure elsewhere is bounded, and a region that the search missed shows in the interval.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv, logsumexp, ndtri

from explore.analysis.tolerancing.outcomes import BoolArray
from explore.model.quantities import FloatArray

#: Probability that an interval holds the true value.
CONFIDENCE = 0.95
#: Number of failures among the parts that gives their probability to 3 %, so that nothing better is needed.
ENOUGH = 1000
#: Number of draws of importance sampling.
N_WEIGHTED = 1 << 17
#: Number of draws that look for failures with each spread.
_N_LOOK = 1 << 13
#: Spreads of the draws that look for failures, in standard deviations.
_SPREADS = (1.5, 2.5, 4.0)
#: Largest number of failing points to draw around.
_MOST_POINTS = 6
#: Cosine of the angle between two failing points from which on they are the same.
_SAME_DIRECTION = 0.8
#: Number of rounds of the descent to the nearest failing points.
_N_ROUNDS = 14
#: Number of steps tried from each point in a round of the descent.
_N_STEPS = 256
#: Shares of the draws with the spread of the parts, with a larger one, and around the failing points.
_SHARES = (0.1, 0.2, 0.7)
#: Distance beyond the nearest failing point from which on points hold no share of the probability that counts.
_FARTHEST = 3.0
#: Least number of weighted failures of an estimate that is believed.
_FEWEST = 200
#: Largest share of one failure in the sum of an estimate that is believed.
_LARGEST_SHARE = 0.05

Fails = Callable[[FloatArray], BoolArray]


@dataclass(frozen=True)
class Failure:
    """Probability that a part has no motion or misses a constraint, with the interval of `CONFIDENCE`.

    By "draws", the share of the parts, and Clopper and Pearson's exact interval; or "weighted", importance sampling.
    """

    probability: float
    low: float
    high: float
    method: str


def share_of(failures: int, count: int, confidence: float = CONFIDENCE) -> Failure:
    """The probability from the number of failures among independent parts, with Clopper and Pearson's interval."""
    tail = (1.0 - confidence) / 2.0
    low = float(betaincinv(failures, count - failures + 1, tail)) if failures else 0.0
    high = float(betaincinv(failures + 1, count - failures, 1.0 - tail)) if failures < count else 1.0
    return Failure(failures / count, low, high, "draws")


def estimate_failure(fails: Fails, dimensions: int, failures: int, count: int, random: np.random.Generator) -> Failure:
    """The probability of a failure, from failures among parts that were drawn, or by importance sampling.

    `fails` takes standard normal scores, (d, n), and tells which parts fail.
    """
    drawn = share_of(failures, count)
    if failures >= ENOUGH:
        return drawn
    points = find_failures(fails, dimensions, random)
    if not len(points):
        return drawn
    weighted = _sample_around(fails, points, random)
    surely = share_of(failures, count, 0.9999)
    if weighted is None or weighted.high < surely.low or weighted.low > surely.high:
        return drawn
    return weighted


def most_parts(failures: int) -> int:
    """Largest number of parts that `estimate_failure` asks for."""
    return 0 if failures >= ENOUGH else len(_SPREADS) * _N_LOOK + _N_ROUNDS * _MOST_POINTS * _N_STEPS + N_WEIGHTED


def find_failures(fails: Fails, dimensions: int, random: np.random.Generator) -> FloatArray:
    """The most probable failures in different directions, nearest first, (k, d); none if no failure is found."""
    spread = np.repeat(_SPREADS, _N_LOOK)
    scores = spread * random.standard_normal((dimensions, len(spread)))
    found = scores[:, fails(scores)].T
    chosen = _different(found[np.argsort(np.linalg.norm(found, axis=1))], _MOST_POINTS)
    if not len(chosen):
        return chosen
    for k in range(_N_ROUNDS):
        chosen = _step_inwards(fails, chosen, 0.6**k, random)
    radii = np.linalg.norm(chosen, axis=1)
    order = np.argsort(radii)
    return _different(chosen[order[radii[order] <= radii.min() + _FARTHEST]], _MOST_POINTS)


def _different(points: FloatArray, most: int) -> FloatArray:
    """The first points, each in another direction than those before it."""
    directions = points / np.maximum(np.linalg.norm(points, axis=1, keepdims=True), 1e-300)
    chosen: list[int] = []
    is_new: BoolArray = np.ones(len(points), dtype=np.bool_)
    while is_new.any() and len(chosen) < most:
        chosen.append(int(np.argmax(is_new)))
        is_new = is_new & (directions @ directions[chosen[-1]] < _SAME_DIRECTION)
    return points[chosen]


def _step_inwards(fails: Fails, points: FloatArray, width: float, random: np.random.Generator) -> FloatArray:
    """Each point, or the nearest failure to the origin among points around it in nearly the same direction."""
    k, d = points.shape
    radii = np.linalg.norm(points, axis=1, keepdims=True)
    directions = points / radii
    around = directions[:, None] + width * random.standard_normal((k, _N_STEPS, d)) / np.sqrt(d)
    around /= np.linalg.norm(around, axis=2, keepdims=True)
    # Half of them straight inwards, so that a point reaches the limit also where only its own direction fails.
    around[:, ::2] = directions[:, None]
    shrunk = radii * (1.0 - 0.7 * width * random.random((k, _N_STEPS)))
    trials = around * shrunk[..., None]
    failing = fails(np.ascontiguousarray(trials.reshape(-1, d).T)).reshape(k, _N_STEPS)
    nearest = np.where(failing, shrunk, np.inf).argmin(axis=1)
    rows = np.arange(k)
    has_failure: BoolArray = np.any(failing, axis=1)
    return np.where(has_failure[:, None], trials[rows, nearest], points)


def _sample_around(fails: Fails, points: FloatArray, random: np.random.Generator) -> Failure | None:
    """Importance sampling around the points; None if too few draws carry the estimate."""
    d = points.shape[1]
    radii = np.linalg.norm(points, axis=1)
    wide = max(_SPREADS[0], float(radii.min()) / np.sqrt(d))
    tilt = np.exp(-(radii**2 - radii.min() ** 2) / 4.0)
    shares = np.array([*_SHARES[:2], *(_SHARES[2] * tilt / tilt.sum())])
    kinds = random.choice(len(shares), N_WEIGHTED, p=shares)
    scores = random.standard_normal((N_WEIGHTED, d))
    scores[kinds == 1] *= wide
    around = kinds >= 2
    scores[around] += points[kinds[around] - 2]
    failing = fails(np.ascontiguousarray(scores.T))
    hits = scores[failing]
    if len(hits) < _FEWEST:
        return None
    squares = (hits**2).sum(axis=1)
    # Logarithms of the densities over that of the parts.
    logs = np.column_stack(
        [
            np.zeros(len(hits)),
            squares / 2.0 * (1.0 - 1.0 / wide**2) - d * np.log(wide),
            hits @ points.T - radii**2 / 2.0,
        ]
    )
    weights = np.exp(-logsumexp(logs, b=shares, axis=1))
    if weights.max() > _LARGEST_SHARE * weights.sum():
        return None
    # where all parts fail, the estimate may exceed 1
    probability = min(float(weights.sum() / N_WEIGHTED), 1.0)
    variance = float((weights**2).sum() / N_WEIGHTED - probability**2) / N_WEIGHTED
    # Of the logarithm, because the estimate is a sum of positive weights with a long tail.
    reach = np.exp(ndtri(0.5 + CONFIDENCE / 2.0) * np.sqrt(variance) / probability)
    return Failure(probability, probability / reach, min(probability * reach, 1.0), "weighted")
