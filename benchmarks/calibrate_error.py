"""Measure the constants of the quadrature's error model, LOG_CONSTANT_2 and LOG_CONSTANT_4 of explore/quadrature.py.

Over random crank-rockers of all kinds and double cranks, with the node counts that random tolerances ask for: the
ratio of the true error of mean and variance, against the largest rule, to the model ((2N + 1)/h)^order rho^(-2N), as
a natural logarithm. The constant must exceed the 0.999 quantile of every line, and the maximum by no more than ln 10
less. ``python benchmarks/calibrate_error.py [--designs 150000]``; about a minute.
"""

import argparse
import math
import sys
from pathlib import Path

import numpy as np
from numba import njit

from explore import quadrature
from explore.mechanisms import crank_rocker, crank_rocker_kernel, four_bar
from explore.sampling import ROUNDING
from explore.statistics import moments
from explore.vocabulary import Status

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "reference"))
from make_campaign import KINDS, draw, margin

ROWS = (
    *(four_bar.COUPLER_VELOCITY, four_bar.ROCKER_VELOCITY),
    *(four_bar.COUPLER_ACCELERATION, four_bar.ROCKER_ACCELERATION),
    *(four_bar.ROCKER_ANGLE, four_bar.TRANSMISSION_ANGLE),
)
ORDERS = (2, 2, 4, 4, 2, 2)
WINDOWS = {
    "cycle": crank_rocker_kernel.CYCLE,
    "drive": crank_rocker_kernel.DRIVE,
    "return": crank_rocker_kernel.RETURN,
    "clutch": crank_rocker_kernel.CLUTCH,
    "interval": crank_rocker_kernel.INTERVAL,
}
SHARES = {"general": 0.4, "extreme ratios": 0.15, "near kite": 0.15, "both ends singular": 0.1, "tiny crank": 0.2}


@njit(error_model="numpy")
def statistics(kernel, shapes, anchors, counts, panels, row_of, table, length, rest, work, out):
    """Mean and variance of every row with these node counts."""
    t, sine, cosine, weight, scratch = work[0], work[1], work[2], work[3], work[4:]
    total = 0
    for p in range(panels):
        quadrature.place_nodes(shapes, p, anchors[p], counts[p], total, row_of, table, False, t, sine, cosine, weight)
        total += counts[p]
    four_bar.fill(kernel, sine, cosine, total, 7, scratch)
    for s in range(scratch.shape[0]):
        out[s, 0], out[s, 1] = moments(scratch, s, weight, total, length, rest)


@njit(error_model="numpy")
def ratios(kernel, singular, noise, window, intervals, log_tolerance, size_of, row_of, table, order, rows, out):
    """ln(true error/model) of the rows of one pole order, NaN where rounding hides it; the nodes used."""
    parts, shapes = np.zeros((4, 3)), np.zeros((3, 4))
    anchors, counts, most = np.zeros(3, np.int64), np.zeros(3, np.int64), np.full(3, quadrature.LARGEST)
    work = np.empty((4 + four_bar.SIGNAL_ROWS, 3 * quadrature.LARGEST))
    found, exact = np.empty((four_bar.SIGNAL_ROWS, 2)), np.empty((four_bar.SIGNAL_ROWS, 2))
    for i in range(len(kernel)):
        panels = crank_rocker_kernel.pieces(kernel[i], window, 0, intervals[i, 0], intervals[i, 1], parts)
        model = 0.0
        for p in range(panels):
            quadrature.panel(parts, p, singular, i, shapes)
            anchors[p] = int(parts[p, 0])
            counts[p] = quadrature.node_count(log_tolerance[i], shapes[p, 1], shapes[p, 3], order, size_of)
            half, rate = shapes[p, 1], shapes[p, 3]
            model += math.exp(order * math.log((2.0 * counts[p] + 1.0) / half) - 2.0 * counts[p] * rate)
        shape = shapes, anchors
        statistics(kernel[i], *shape, counts, panels, row_of, table, parts[3, 0], parts[3, 1], work, found)
        statistics(kernel[i], *shape, most, panels, row_of, table, parts[3, 0], parts[3, 1], work, exact)
        largest = 0.0
        for s in range(4):
            largest = max(largest, math.hypot(exact[s, 0], math.sqrt(exact[s, 1])))
        for k, s in enumerate(rows):
            rms = math.hypot(exact[s, 0], math.sqrt(exact[s, 1]))
            error = max(abs(found[s, 0] - exact[s, 0]) / rms, abs(found[s, 1] - exact[s, 1]) / rms**2)
            floor = 30.0 * ROUNDING * (1.0 + noise[i] * 0.1 + 0.1 * largest / rms)
            out[i, k] = math.log(error / model) if floor < error < 0.1 else np.nan


def designs(count, rng):
    """Parameters of crank-rockers of all kinds, a fifth more of them with crank and ground changed: double cranks."""
    lengths = []
    kinds = rng.choice(len(KINDS), count, p=[SHARES[kind] for kind in KINDS])
    for kind in kinds:
        while True:
            trial = draw(rng, KINDS[kind])
            if trial[0] < trial[1:].min() and margin(*trial) >= 1e-12:
                break
        lengths.append(trial)
    lengths = np.array(lengths)
    doubles = lengths[: count // 5][:, [3, 1, 2, 0]]
    both = np.concatenate([lengths, doubles])
    phases = rng.choice((2.0, 3.0, 4.0, 6.0), len(both))
    return np.column_stack([both, phases, rng.choice((1.0, -1.0), len(both))]), np.append(kinds, kinds[: count // 5])


def closed(parameters):
    """What the closed form gives: status, kernel rows, singularities, noise."""
    n = len(parameters)
    metrics, status = np.empty((len(crank_rocker.CRANK_ROCKER.metrics), n)), np.zeros(n, np.int8)
    kernel, singular, noise = np.zeros((n, crank_rocker.CRANK_ROCKER.kernel_size)), np.ones((n, 3)), np.ones(n)
    crank_rocker_kernel.closed_form(np.ascontiguousarray(parameters), metrics, status, kernel, singular, noise)
    return status, kernel, singular, noise


def report(order, window, name, out, kinds, parameters):
    """One line of quantiles, and the worst design."""
    worst = np.nan_to_num(out, nan=-np.inf).max(axis=1)
    seen = np.isfinite(worst)
    if np.count_nonzero(seen) < 100:
        return
    quantiles = (*np.quantile(worst[seen], (0.5, 0.99, 0.999)), worst.max())
    by_kind = [worst[seen & (kinds == k)] for k in range(len(KINDS))]
    by_kind = [np.quantile(of, 0.999) if len(of) > 500 else np.nan for of in by_kind]
    numbers = "".join(f"{value:7.2f}" for value in (*quantiles, *by_kind))
    line = f"{order:<6d}{window:10s}{name:24s}{np.count_nonzero(seen):7d}{numbers}"
    print(line, " ", parameters[np.argmax(worst)].tolist())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--designs", type=int, default=150_000)
    rng = np.random.default_rng(1)
    parameters, kinds = designs(parser.parse_args().designs, rng)
    status, kernel, singular, noise = closed(parameters)
    rules = quadrature.rules()
    start = rng.uniform(-math.pi, math.pi, len(parameters))
    intervals = np.column_stack([start, start + rng.uniform(0.05, 2 * math.pi, len(parameters))])
    print(f"now: order 2 {quadrature.LOG_CONSTANT_2}, order 4 {quadrature.LOG_CONSTANT_4}; ln(true error / model):")
    print("order, window, class, measured designs; quantiles .5 .99 .999, largest; .999 by kind; the worst design")
    for order in (2, 4):
        rows = tuple(row for row, o in zip(ROWS, ORDERS, strict=True) if o == order)
        for window, code in WINDOWS.items():
            for name, wanted in (("crank-rocker", Status.OK), ("double crank", Status.NO_STROKE)):
                if name == "double crank" and window not in ("cycle", "interval"):
                    continue
                pick = np.flatnonzero(status == wanted)
                out = np.full((len(pick), len(rows)), np.nan)
                tolerance = rng.uniform(math.log(1e-12), math.log(1e-2), len(pick))
                given = kernel[pick], singular[pick], noise[pick], code, intervals[pick], tolerance
                ratios(*given, *rules, order, rows, out)
                what = np.column_stack([parameters[pick], intervals[pick]])
                report(order, window, name + (" velocities" if order == 2 else ""), out[:, :2], kinds[pick], what)
                if order == 2 and name == "crank-rocker":  # the rocker of a double crank turns: its angle jumps
                    report(order, window, name + " angles", out[:, 2:], kinds[pick], what)


if __name__ == "__main__":
    main()
