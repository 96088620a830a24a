"""Nodes taken over nodes needed, on 1,000 ordinary crank-rockers: ``python benchmarks/nodes_taken.py``.

Lengths are uniform in [0.1, 1] with a Grashof margin of at least 2 % of the longest pair. A design needs the smallest
number of nodes from which on the statistic's true error stays below the tolerance: of the graded rule, and over a full
turn also of equispaced samples, whichever are fewer. The rules, and the references of 400 equispaced or 100 graded
nodes, are written here once more in NumPy.
"""

from functools import partial

import numpy as np

import explore
from explore.comparison.methods.loops import find_loop
from explore.mechanisms.registry import MECHANISMS

TOLERANCES = (1e-6, 1e-9, 1e-12)
MOST = 48
LARGEST_SCALE = 0.9


def draw(count, rng):
    """Lengths of crank-rockers, shape (count, 4): crank, coupler, rocker, ground."""
    trials = rng.uniform(0.1, 1.0, (60 * count, 4))
    crank, others = trials[:, 0], trials[:, 1:]
    longest = others.max(axis=1)
    is_rocking = (crank < others.min(axis=1)) & (crank + longest < 0.98 * (others.sum(axis=1) - longest))
    return trials[is_rocking][:count]


def velocity(lengths, angles):
    """Rocker velocity for unit crank speed at angles of shape (n, nodes)."""
    loop = find_loop(MECHANISMS["crank-rocker"])
    return loop.closed.close(loop.columns([*lengths.T, np.ones(len(lengths))])).fill(angles, 4)[3]


def strokes(lengths):
    """Crank angles at the ends of the longer and of the shorter stroke, each of shape (n, 2)."""
    crank, coupler, rocker, ground = lengths.T
    extended, overlapped = crank + coupler, coupler - crank
    first = np.arccos((extended**2 + ground**2 - rocker**2) / (2 * extended * ground))
    second = np.pi + np.arccos((overlapped**2 + ground**2 - rocker**2) / (2 * overlapped * ground))
    one, other = np.stack([first, second], axis=1), np.stack([second, first + 2 * np.pi], axis=1)
    is_longer = (second - first >= np.pi)[:, None]
    return np.where(is_longer, one, other), np.where(is_longer, other, one)


def scales(lengths):
    """T of the anchors 0 and pi: the nearest singularity of each, at most LARGEST_SCALE; shape (2, n)."""
    crank, coupler, rocker, ground = lengths.T
    near = (ground - crank) ** 2 - (coupler - rocker) ** 2
    far = (coupler + rocker) ** 2 - (ground + crank) ** 2
    product = 4 * crank * ground
    of_pivot = (ground - crank) / (ground + crank)
    at_zero = np.minimum(np.sqrt(near / (near + product)), of_pivot)
    return np.minimum([at_zero, np.sqrt(far / (far + product))], LARGEST_SCALE)


def graded(lengths, ends, anchor, count):
    """Angles and weights of the graded rule between `ends`, shape (n, 2), about anchors (numbers of half turns)."""
    scale = np.where(anchor % 2 == 0, *scales(lengths))
    centre = anchor * np.pi
    low, high = np.arcsinh(np.tan(0.5 * (ends - centre[:, None])) / scale[:, None]).T
    nodes, weights = np.polynomial.legendre.leggauss(count)
    t = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * nodes
    tangent = scale[:, None] * np.sinh(t)
    weight = (high - low)[:, None] * weights * scale[:, None] * np.cosh(t) / (1 + tangent**2)
    return centre[:, None] + 2 * np.arctan(tangent), weight


def spread(values, weights):
    """Mean and standard deviation, shape (n,)."""
    mean = np.average(values, axis=1, weights=weights)
    return mean, np.sqrt(np.average((values - mean[:, None]) ** 2, axis=1, weights=weights))


def cv_of_stroke(lengths, ends, count):
    """Coefficient of variation over strokes, with `count` nodes each."""
    angles, weights = graded(lengths, ends, np.round(ends.mean(axis=1) / np.pi), count)
    mean, std = spread(velocity(lengths, angles), weights)
    return std / np.abs(mean)


def std_of_turn(lengths, count, *, equispaced):
    """Standard deviation over the turn with `count` nodes for each half."""
    if equispaced:
        angles = np.tile(np.pi * (np.arange(2 * count) + 0.5) / count, (len(lengths), 1))
        return spread(velocity(lengths, angles), np.ones_like(angles))[1]
    halves = []
    for anchor in (0, 1):
        ends = np.tile(np.pi * (anchor + np.array([-0.5, 0.5])), (len(lengths), 1))
        halves.append(graded(lengths, ends, np.full(len(lengths), anchor), count))
    angles, weights = (np.concatenate(parts, axis=1) for parts in zip(*halves, strict=True))
    return spread(velocity(lengths, angles), weights)[1]


def needed(statistic, exact, tolerance):
    """The smallest count from which on the relative error stays below the tolerance."""
    is_met = np.array([np.abs(statistic(count=count) / exact - 1) < tolerance for count in range(2, MOST)])
    return 2 + len(is_met) - np.argmin(np.append(is_met[::-1], np.zeros((1, is_met.shape[1]), bool), axis=0), axis=0)


def main():
    lengths = draw(1000, np.random.default_rng(1))
    designs = dict(zip(("crank", "coupler", "rocker", "ground"), lengths.T, strict=True))
    print("window  tolerance  needed  taken  ratio: median, 90 % (medians of 1,000 designs)")
    longer, shorter = strokes(lengths)
    for window, metric in (("drive", "rocker_velocity_cv"), ("return", "rocker_velocity_cv"),
                           ("cycle", "rocker_velocity_std")):  # fmt: skip
        for tolerance in TOLERANCES:
            # The other mean makes the design be sampled for both.
            metrics = [metric, "transmission_angle_mean"]
            run = explore.evaluate("crank-rocker", designs, metrics=metrics, window=window, tolerance=tolerance)
            taken = run["nodes"]
            if window == "cycle":
                exact = std_of_turn(lengths, 200, equispaced=True)
                rules = [partial(std_of_turn, lengths, equispaced=equispaced) for equispaced in (True, False)]
                fewest = 2 * np.minimum(*(needed(rule, exact, tolerance) for rule in rules))
            else:
                rule = partial(cv_of_stroke, lengths, longer if window == "drive" else shorter)
                fewest = needed(rule, rule(count=100), tolerance)
            ratio = taken / fewest
            print(f"{window:7s} {tolerance:9.0e} {np.median(fewest):7.0f} {taken.median():6.0f} "
                  f"{ratio.median():14.2f} {ratio.quantile(0.9):6.2f}")  # fmt: skip


if __name__ == "__main__":
    main()
