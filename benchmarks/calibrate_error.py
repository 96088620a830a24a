"""Measure the constants of the error models, in explore/evaluation/quadrature/panels.py and equispaced.py.

Over random crank-rockers of all kinds and double cranks, with the node counts for random tolerances: the natural
logarithm of the ratio of the true error of mean and variance, against the largest rule, to the model
((2N + 1)/h)^order rho^(-2N), or (1 + N delta)^(order - 1) exp(-(N - 2) delta) of a turn with equispaced nodes, where
these are chosen. The constant must exceed the 0.999 quantile of every line, and may be below the maximum by
at most ln 10. ``python benchmarks/calibrate_error.py [--designs 150000]``; about a minute.
"""

import argparse
import math
import sys
from pathlib import Path

import numpy as np
from numba import njit

from explore.base.compiling import LANES
from explore.evaluation.quadrature import equispaced as equispaced_rule
from explore.evaluation.quadrature.bounds import ROUNDING
from explore.evaluation.quadrature.clutches import shorten_to_clutches
from explore.evaluation.quadrature.equispaced import choose_equispaced, place_equispaced
from explore.evaluation.quadrature.panels import (
    ANCHOR,
    COUNT,
    HALF,
    LENGTH,
    LOG_CONSTANT_2,
    LOG_CONSTANT_4,
    PANEL_CAPACITY,
    RATE,
    SCALE,
    SINGULAR,
    TARGET,
    count_nodes,
    map_panels,
)
from explore.evaluation.quadrature.rules import LARGEST_NODE_COUNT, gauss_legendre_rules
from explore.evaluation.quadrature.slots import CLUTCH, KIND, START, STOP
from explore.evaluation.quadrature.tiles import NODE_CAPACITY, SHAPE_SIZE, gather_shapes, place_nodes
from explore.evaluation.quadrature.windows import add_window
from explore.evaluation.quadrature.work_space import Sizes, make_work_space
from explore.evaluation.windows import specify_window
from explore.mechanisms import four_bar, rocking
from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER
from explore.model.status import Status

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "reference"))
from make_campaign import KINDS, draw, margin

ROWS = (
    *(four_bar.COUPLER_VELOCITY, four_bar.ROCKER_VELOCITY),
    *(four_bar.COUPLER_ACCELERATION, four_bar.ROCKER_ACCELERATION),
    *(four_bar.ROCKER_ANGLE, four_bar.TRANSMISSION_ANGLE),
)
ORDERS = (2, 2, 4, 4, 2, 2)
WINDOWS = ("cycle", "drive", "return", "clutch", "interval")
SHARES = {"general": 0.4, "extreme ratios": 0.15, "near kite": 0.15, "both ends singular": 0.1, "tiny crank": 0.2}


_ROWS, _CONSTANTS = four_bar.SIGNAL_ROWS, int(CRANK_ROCKER.n_constants)
_SINGULAR = np.array([row for row, _ in CRANK_ROCKER.singularities])
_ANCHORS = np.array([anchor for _, anchor in CRANK_ROCKER.singularities])


@njit(error_model="numpy")
def statistics(fill, tile, panels, count, length, rest, row_of, table, out):
    """Mean and variance of every row with the node counts of the panels."""
    shape, tangents, weights = np.zeros(SHAPE_SIZE), np.empty(NODE_CAPACITY * LANES), np.empty(NODE_CAPACITY * LANES)
    node, signals = np.empty(NODE_CAPACITY + LANES), np.empty(_ROWS * (NODE_CAPACITY + LANES))
    values, weight = np.empty((_ROWS, count * NODE_CAPACITY)), np.empty(count * NODE_CAPACITY)
    total = 0
    for p in range(count):
        nodes, anchor = int(panels[COUNT + p]), int(panels[ANCHOR + p])
        if panels[SCALE + p] == 0.0:
            place_equispaced(nodes, tangents, weights)
        else:
            gather_shapes(panels, np.full(LANES, p), False, shape)
            place_nodes(shape, nodes, False, row_of, table, tangents, weights)
        tiles = (nodes + LANES - 1) // LANES
        for j in range(tiles * LANES):  # here the lanes are nodes
            node[j] = tangents[min(j, nodes - 1) * LANES]
        fill(tile, node, anchor, 0, 0, tiles, 7, signals)
        for j in range(nodes):
            weight[total + j] = weights[j * LANES]
            for s in range(_ROWS):
                values[s, total + j] = signals[(j // LANES * _ROWS + s) * LANES + j % LANES]
        total += nodes
    for s in range(_ROWS):
        mean = np.sum(weight[:total] * values[s, :total]) / length
        out[s, 0] = mean
        out[s, 1] = (np.sum(weight[:total] * (values[s, :total] - mean) ** 2) + rest * mean * mean) / length


@njit(error_model="numpy")
def ratios(
    fill, sizes, constants, window, intervals, log_tolerance, size_of, row_of, table, order, equispaced, rows, out,
    work, lanes,
):  # fmt: skip
    """Fill ln(true error/model) of the rows of one pole order, NaN where rounding dominates the error."""
    # One chunk of one design, in all lanes.
    panels, tile, averaging, rest = work.panels, work.constants, work.averaging, work.rest
    no_breaks, anchors = np.empty(0), _ANCHORS.copy()
    work.owner[:] = 0
    computed, exact = np.empty((_ROWS, 2)), np.empty((_ROWS, 2))
    for i in range(constants.shape[1]):
        for k in range(_CONSTANTS):
            tile[k * LANES : (k + 1) * LANES] = constants[k, i]
        start, stop = intervals[i]
        if window[START] >= 0:
            start, stop = constants[window[START], i], constants[window[STOP], i]
        count = add_window(panels, 0, window[KIND], start, stop, no_breaks, 0)
        for k in range(len(_SINGULAR)):
            panels[SINGULAR + k * PANEL_CAPACITY : SINGULAR + k * PANEL_CAPACITY + count] = constants[_SINGULAR[k], i]
        map_panels(panels, count, anchors)
        averaging[0], rest[0] = np.sum(panels[LENGTH : LENGTH + count]), 0.0
        if window[CLUTCH]:
            shorten_to_clutches(fill, sizes, window, count, work, lanes)
            map_panels(panels, count, anchors)
        panels[TARGET : TARGET + count] = log_tolerance[i]
        count_nodes(panels, count, order)
        if equispaced:
            choose_equispaced(panels, 1, order, log_tolerance[i], False)
            if panels[SCALE] != 0.0:
                continue
        model = 0.0
        for p in range(1 if equispaced else count):
            nodes, half, rate = size_of[int(panels[COUNT + p])], panels[HALF + p], panels[RATE + p]
            panels[COUNT + p] = nodes
            if equispaced:
                model = math.exp((order - 1) * math.log(1.0 + nodes * rate) - (nodes - 2) * rate)
            else:
                model += math.exp(order * math.log((2.0 * nodes + 1.0) / half) - 2.0 * nodes * rate)
        statistics(fill, tile, panels, 1 if equispaced else count, averaging[0], rest[0], row_of, table, computed)
        if equispaced:
            map_panels(panels, count, anchors)
        panels[COUNT : COUNT + count] = LARGEST_NODE_COUNT
        statistics(fill, tile, panels, count, averaging[0], rest[0], row_of, table, exact)
        largest = 0.0
        for s in range(4):
            largest = max(largest, math.hypot(exact[s, 0], math.sqrt(exact[s, 1])))
        for k, s in enumerate(rows):
            rms = math.hypot(exact[s, 0], math.sqrt(exact[s, 1]))
            error = max(abs(computed[s, 0] - exact[s, 0]) / rms, abs(computed[s, 1] - exact[s, 1]) / rms**2)
            floor = 30.0 * ROUNDING * (1.0 + constants[rocking.NOISE, i] * 0.1 + 0.1 * largest / rms)
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
    status_of = CRANK_ROCKER.evaluate_closed_form(parameters.T).status
    constants = CRANK_ROCKER.constants(parameters.T)
    tables = gauss_legendre_rules()
    start = rng.uniform(-math.pi, math.pi, len(parameters))
    intervals = np.column_stack([start, start + rng.uniform(0.05, 2 * math.pi, len(parameters))])
    print(f"now: order 2 {LOG_CONSTANT_2}, others {LOG_CONSTANT_4}; of a turn with equispaced nodes")
    print(f"{equispaced_rule.LOG_CONSTANT_2}, {equispaced_rule.LOG_CONSTANT_4}; ln(true error / model):")
    sizes = Sizes(CRANK_ROCKER.record_rows, CRANK_ROCKER.first_parameter, _CONSTANTS, _CONSTANTS, _ROWS, -1, -1, 0)
    work, lanes, _ = make_work_space(sizes, 0)
    print("order, window, class, measured designs; quantiles .5 .99 .999, largest; .999 by kind; the worst design")
    for order in (2, 4):
        rows = np.array([row for row, o in zip(ROWS, ORDERS, strict=True) if o == order])
        for label in ("turn", *WINDOWS):
            window = "cycle" if label == "turn" else label
            columns = np.array(specify_window(CRANK_ROCKER, CRANK_ROCKER.window(window), "slow"))
            for name, status in (("crank-rocker", Status.OK), ("double crank", rocking.NO_STROKE)):
                if name == "double crank" and window not in ("cycle", "interval"):
                    continue
                selected = np.flatnonzero(status_of == status)
                out = np.full((len(selected), len(rows)), np.nan)
                tolerance = rng.uniform(math.log(1e-12), math.log(1e-2), len(selected))
                of_selected = np.ascontiguousarray(constants[:, selected])
                ratios(
                    CRANK_ROCKER.fill, sizes, of_selected, columns, intervals[selected], tolerance, *tables, order,
                    label == "turn", rows, out, work, lanes,
                )  # fmt: skip
                inputs = np.column_stack([parameters[selected], intervals[selected]])
                report(order, label, name + (" velocities" if order == 2 else ""), out[:, :2], kinds[selected], inputs)
                if order == 2 and name == "crank-rocker":  # the rocker of a double crank turns: its angle jumps
                    report(order, label, name + " angles", out[:, 2:], kinds[selected], inputs)


if __name__ == "__main__":
    main()
