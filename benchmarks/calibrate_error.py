"""Measure LOG_CONSTANT_2 and LOG_CONSTANT_4, the constants of the error model in explore/quadrature/node_placement.py.

Over random crank-rockers of all kinds and double cranks, with the node counts for random tolerances: the natural
logarithm of the ratio of the true error of mean and variance, against the largest rule, to the model
((2N + 1)/h)^order rho^(-2N). The constant must exceed the 0.999 quantile of every line, and may be below the maximum by
at most ln 10. ``python benchmarks/calibrate_error.py [--designs 150000]``; about a minute.
"""

import argparse
import math
import sys
from pathlib import Path

import numpy as np
from numba import njit

from explore.mechanisms import four_bar
from explore.mechanisms.crank_rocker import columns
from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER
from explore.mechanisms.crank_rocker.kernel import pieces
from explore.model.status import Status
from explore.quadrature.loop import ROUNDING
from explore.quadrature.moments import mean_and_variance
from explore.quadrature.node_placement import LOG_CONSTANT_2, LOG_CONSTANT_4, map_panel, node_count, place_nodes
from explore.quadrature.rules import LARGEST_NODE_COUNT, gauss_legendre_rules

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "reference"))
from make_campaign import KINDS, draw, margin

ROWS = (
    *(four_bar.COUPLER_VELOCITY, four_bar.ROCKER_VELOCITY),
    *(four_bar.COUPLER_ACCELERATION, four_bar.ROCKER_ACCELERATION),
    *(four_bar.ROCKER_ANGLE, four_bar.TRANSMISSION_ANGLE),
)
ORDERS = (2, 2, 4, 4, 2, 2)
WINDOWS = {
    "cycle": columns.CYCLE,
    "drive": columns.DRIVE,
    "return": columns.RETURN,
    "clutch": columns.CLUTCH,
    "interval": columns.INTERVAL,
}
SHARES = {"general": 0.4, "extreme ratios": 0.15, "near kite": 0.15, "both ends singular": 0.1, "tiny crank": 0.2}


@njit(error_model="numpy")
def statistics(kernel, shapes, anchors, counts, panels, row_of, table, length, rest, work, out):
    """Mean and variance of every row with these node counts."""
    t, sine, cosine, weight, scratch = work[0], work[1], work[2], work[3], work[4:]
    total = 0
    for p in range(panels):
        place_nodes(shapes, p, anchors[p], counts[p], total, row_of, table, False, t, sine, cosine, weight)
        total += counts[p]
    four_bar.fill(kernel, sine, cosine, total, 7, scratch)
    for s in range(scratch.shape[0]):
        out[s, 0], out[s, 1] = mean_and_variance(scratch, s, weight, total, length, rest)


@njit(error_model="numpy")
def ratios(kernel, singular, noise, window, intervals, log_tolerance, size_of, row_of, table, order, rows, out):
    """Fill ln(true error/model) of the rows of one pole order, NaN where rounding dominates the error."""
    parts, shapes = np.zeros((4, 3)), np.zeros((3, 4))
    anchors, counts, most = np.zeros(3, np.int64), np.zeros(3, np.int64), np.full(3, LARGEST_NODE_COUNT)
    work = np.empty((4 + four_bar.SIGNAL_ROWS, 3 * LARGEST_NODE_COUNT))
    computed, exact = np.empty((four_bar.SIGNAL_ROWS, 2)), np.empty((four_bar.SIGNAL_ROWS, 2))
    for i in range(len(kernel)):
        panels = pieces(kernel[i], window, 0, intervals[i, 0], intervals[i, 1], parts)
        model = 0.0
        for p in range(panels):
            map_panel(parts, p, singular, i, shapes)
            anchors[p] = int(parts[p, 0])
            counts[p] = node_count(log_tolerance[i], shapes[p, 1], shapes[p, 3], order, size_of)
            half, rate = shapes[p, 1], shapes[p, 3]
            model += math.exp(order * math.log((2.0 * counts[p] + 1.0) / half) - 2.0 * counts[p] * rate)
        shape = shapes, anchors
        statistics(kernel[i], *shape, counts, panels, row_of, table, parts[3, 0], parts[3, 1], work, computed)
        statistics(kernel[i], *shape, most, panels, row_of, table, parts[3, 0], parts[3, 1], work, exact)
        largest = 0.0
        for s in range(4):
            largest = max(largest, math.hypot(exact[s, 0], math.sqrt(exact[s, 1])))
        for k, s in enumerate(rows):
            rms = math.hypot(exact[s, 0], math.sqrt(exact[s, 1]))
            error = max(abs(computed[s, 0] - exact[s, 0]) / rms, abs(computed[s, 1] - exact[s, 1]) / rms**2)
            floor = 30.0 * ROUNDING * (1.0 + noise[i] * 0.1 + 0.1 * largest / rms)
            out[i, k] = math.log(error / model) if floor < error < 0.1 else np.nan


def designs(count, rng):
    """Parameters of crank-rockers of all kinds, and of double cranks: a fifth of them with crank and ground swapped."""
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


def report(order, window, name, out, kinds, parameters):
    """One line of quantiles, and the worst design."""
    worst = np.nan_to_num(out, nan=-np.inf).max(axis=1)
    is_measured = np.isfinite(worst)
    if np.count_nonzero(is_measured) < 100:
        return
    quantiles = (*np.quantile(worst[is_measured], (0.5, 0.99, 0.999)), worst.max())
    by_kind = [worst[is_measured & (kinds == k)] for k in range(len(KINDS))]
    by_kind = [np.quantile(of, 0.999) if len(of) > 500 else np.nan for of in by_kind]
    numbers = "".join(f"{value:7.2f}" for value in (*quantiles, *by_kind))
    line = f"{order:<6d}{window:10s}{name:24s}{np.count_nonzero(is_measured):7d}{numbers}"
    print(line, " ", parameters[np.argmax(worst)].tolist())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--designs", type=int, default=150_000)
    rng = np.random.default_rng(1)
    parameters, kinds = designs(parser.parse_args().designs, rng)
    closed_form = CRANK_ROCKER.evaluate_closed_form(parameters)
    tables = gauss_legendre_rules()
    start = rng.uniform(-math.pi, math.pi, len(parameters))
    intervals = np.column_stack([start, start + rng.uniform(0.05, 2 * math.pi, len(parameters))])
    print(f"now: order 2 {LOG_CONSTANT_2}, order 4 {LOG_CONSTANT_4}; ln(true error / model):")
    print("order, window, class, measured designs; quantiles .5 .99 .999, largest; .999 by kind; the worst design")
    for order in (2, 4):
        rows = tuple(row for row, o in zip(ROWS, ORDERS, strict=True) if o == order)
        for window, code in WINDOWS.items():
            for name, status in (("crank-rocker", Status.OK), ("double crank", Status.NO_STROKE)):
                if name == "double crank" and window not in ("cycle", "interval"):
                    continue
                selected = np.flatnonzero(closed_form.status == status)
                out = np.full((len(selected), len(rows)), np.nan)
                tolerance = rng.uniform(math.log(1e-12), math.log(1e-2), len(selected))
                kernel, singular, noise = (
                    values[selected] for values in (closed_form.kernel, closed_form.singular, closed_form.noise)
                )
                ratios(kernel, singular, noise, code, intervals[selected], tolerance, *tables, order, rows, out)
                inputs = np.column_stack([parameters[selected], intervals[selected]])
                report(order, window, name + (" velocities" if order == 2 else ""), out[:, :2], kinds[selected], inputs)
                if order == 2 and name == "crank-rocker":  # the rocker of a double crank turns: its angle jumps
                    report(order, window, name + " angles", out[:, 2:], kinds[selected], inputs)


if __name__ == "__main__":
    main()
