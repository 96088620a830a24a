"""Statistics of linkages over parts of the turn, whose nodes follow from the distance of the nearest singularity."""

import numpy as np
import pytest
from linkage_cases import CASES, columns, linkage_of, scattered

from explore import Linkage
from explore.base.lanes.designs import fill_motion_of_design
from explore.evaluation.evaluate import evaluate_columns
from explore.evaluation.quadrature.ellipses import bound_rates_by_ellipse
from explore.evaluation.quadrature.panels import (
    ANCHOR,
    CENTRE,
    FIRST,
    HALF,
    LAST,
    PANEL_CAPACITY,
    PANELS_SIZE,
    RATE,
    SCALE,
    SINGULAR,
    SPREAD,
    bound_rates,
    map_panels,
)
from explore.evaluation.quadrature.windows import add_interval
from explore.evaluation.windows import window_ends
from explore.studies.request.requests import make_request


def _exact(kernel, designs, window, pieces=64):
    """Mean, variance, least and largest sample of all rows by Gauss-Legendre rules on pieces, each (n, rows)."""
    abscissae, weights = np.polynomial.legendre.leggauss(16)
    constants, result = kernel.constants(columns(kernel, designs)), []
    for design, (start, stop) in zip(constants.T, window_ends(kernel, constants, window, "slow"), strict=True):
        edges = np.linspace(start, stop, pieces + 1)
        angles = (0.5 * (edges[:-1] + edges[1:])[:, None] + 0.5 * (edges[1] - edges[0]) * abscissae).ravel()
        half_turns, signals = np.round(angles / np.pi), np.zeros((kernel.signal_rows, len(angles)))
        tangents, anchors = np.tan(0.5 * (angles - half_turns * np.pi)), (half_turns % 2).astype(np.int64)
        laws = np.zeros(len(angles), np.int64)
        fill_motion_of_design(
            kernel.fill, np.ascontiguousarray(design), anchors, laws, tangents, 0, 1, kernel.signal_rows, signals
        )
        shares = np.tile(0.5 * weights / pieces, pieces)
        mean = signals @ shares
        result.append((mean, (signals - mean[:, None]) ** 2 @ shares, signals.min(axis=1), signals.max(axis=1)))
    return [np.array(parts) for parts in zip(*result, strict=True)]


@pytest.mark.parametrize("window", ["drive", "return", {"from": 20, "to": 110}, {"from": 200, "to": 201}])
@pytest.mark.parametrize("name", ["crank-shaper", "watt-2"])
def test_bounds_hold_over_parts_of_a_turn(name, window):
    """With at most half of the 288 nodes with which halved panels begin."""
    linkage, count = linkage_of(CASES[name]), 24
    output = {"crank-shaper": "ram", "watt-2": "output"}[name]
    signals, word = [f"{output}_velocity", f"{output}_acceleration"], window if isinstance(window, str) else "interval"
    metrics = [f"{signal}_{statistic}_{word}" for signal in signals for statistic in ("mean", "variance", "max")]
    options = {} if isinstance(window, str) else {"window": window}
    request = make_request(linkage.mechanism, metrics=metrics, tolerance=1e-9, drive="slow", **options)
    designs = scattered(CASES[name], count, np.random.default_rng(5), 0.1)
    found = evaluate_columns(request, designs).columns
    over = next(metric.window for metric in request.metrics)
    means, variances, least, largest = _exact(request.kernel, designs, over)
    assert (found["status"] == 1).all()
    assert np.median(found["nodes"]) <= 144
    for signal in signals:
        row = request.kernel.signal(signal).row
        mean, variance = means[:, row], variances[:, row]
        square, peak = mean**2 + variance, np.maximum(np.abs(least[:, row]), np.abs(largest[:, row]))
        bound = found["error"] + 4e-15
        assert (np.abs(found[f"{signal}_mean_{word}"] - mean) <= bound * np.sqrt(square)).all()
        assert (np.abs(found[f"{signal}_variance_{word}"] - variance) <= bound * square).all()
        assert (largest[:, row] - found[f"{signal}_max_{word}"] <= bound * peak).all()


@pytest.mark.parametrize(("first", "last"), [(-1.0, 1.0), (-0.6, 0.9), (0.2, 0.5), (-0.05, 0.02), (1.0, 3.0)])
@pytest.mark.parametrize("distance", [0.05, 0.3, 1.0, 3.0])
def test_the_ellipse_of_a_panel_has_no_singularity_at_the_distance_in_it(first, last, distance):
    """The sums of the distances of all points of the line from the ends of the panel exceed the axis of the ellipse."""
    panels = np.zeros(PANELS_SIZE)
    panels[ANCHOR], panels[FIRST], panels[LAST], panels[SPREAD] = 0.0, first, last, last - first
    panels[SINGULAR] = np.tanh(0.5 * distance)
    panels[SINGULAR + PANEL_CAPACITY] = panels[SINGULAR + 2 * PANEL_CAPACITY] = 1.0
    map_panels(panels, 1, np.full(3, -1))
    bound_rates(panels, 1)
    line = np.linspace(-np.pi, np.pi, 20_001)[1:-1] + 1j * distance
    x = (np.arcsinh(np.tan(0.5 * line) / panels[SCALE]) - panels[CENTRE]) / panels[HALF]
    axis = 0.5 * (np.abs(x - 1.0) + np.abs(x + 1.0))
    assert 0.0 < panels[RATE] <= np.arccosh(axis.min())
    assert panels[RATE] >= 0.5 * np.arccosh(axis.min())


#: Share by which parameters are scattered, so that some cranks are blocked in a range and others are not.
SHARES = {"watt-2": 0.3, "crank-shaper": 0.4, "jansen": 0.2, "klann": 0.2, "slider-crank": 0.6, "stephenson-3": 0.25,
          "toggle-press": 0.25, "whitworth": 0.3, "wiper": 0.2}  # fmt: skip


def _ranges():
    for name in SHARES:
        yield pytest.param(name, 200, marks=() if name in ("watt-2", "crank-shaper") else pytest.mark.slow)
        yield pytest.param(name, 1200, marks=pytest.mark.slow)


@pytest.mark.parametrize(("name", "count"), [*_ranges()])
def test_bounds_hold_over_ranges_and_their_parts(name, count):
    """Of means and variances by dense rules, at three tolerances; 20,000 designs in the long form.

    Median and mean are 18 and 34 nodes, where halved panels take 296 and 333.
    """
    rng, content, taken = np.random.default_rng(count), linkage_of(CASES[name]).content, []
    for tolerance in (1e-6, 1e-9, 1e-12):
        start, length = float(rng.integers(-180, 180)), float(rng.choice([20, 60, 120, 330]))
        linkage = Linkage({**content, "range": [start, start + length]})
        names = [s.name for s in linkage.mechanism.signals if s.name.endswith(("_velocity", "_acceleration"))]
        names = [each for each in names if not linkage.mechanism.signal(each).is_magnitude][:4]
        designs = scattered(CASES[name], count // 3, rng, SHARES[name])
        first = start + 0.3 * length * rng.uniform()
        for window in ("range", {"from": first, "to": first + 0.6 * length * 10.0 ** rng.uniform(-1.3, 0.0)}):
            metrics = [f"{each}_{statistic}" for each in names for statistic in ("mean", "variance")]
            request = make_request(linkage.mechanism, metrics=metrics, tolerance=tolerance, window=window)
            found = evaluate_columns(request, designs).columns
            ok = np.isin(found["status"], (1, 7))
            moving = {key: column[ok] for key, column in designs.items()}
            fine, coarse = (_exact(request.kernel, moving, request.window, pieces) for pieces in (32, 16))
            taken.append(found["nodes"][ok])
            for each in names:
                row = request.kernel.signal(each).row
                square = fine[0][:, row] ** 2 + fine[1][:, row]
                for k, (statistic, scale) in enumerate((("mean", np.sqrt(square)), ("variance", square))):
                    bound = found["error"][ok]
                    sure = np.abs(fine[k][:, row] - coarse[k][:, row]) < (0.1 * bound + 1e-15) * scale
                    error = np.abs(found[f"{each}_{statistic}"][ok] - fine[k][:, row])
                    assert (error <= (bound + 2e-14) * scale)[sure].all(), (start, length, window, each, statistic)
    taken = np.concatenate(taken)
    assert len(taken) > 0.3 * count
    assert np.median(taken) <= 48
    assert taken.mean() <= 160


@pytest.mark.parametrize("growth", [1.08, 1.5, 4.0])
@pytest.mark.parametrize("length", [0.1, 1.5, 5.0])
@pytest.mark.parametrize("share", [0.03, 0.4, 1.0])
def test_the_ellipse_of_a_panel_is_in_that_of_the_interval(growth, length, share):
    """By 20,001 points of the boundary of that; and its rate is at least 0.95 of the largest."""
    start, major, minor = -0.7 * length, 0.5 * (growth + 1.0 / growth), 0.5 * (growth - 1.0 / growth)
    phases = np.linspace(0.0, np.pi, 20_001)
    for place in (0.0, 0.2, 0.5, 1.0):
        first, part = start + place * (1.0 - share) * length, share * length
        panels, half_turns = np.zeros(PANELS_SIZE), round(first / np.pi)
        count = add_interval(panels, 0, half_turns % 2.0, first - half_turns * np.pi, part, np.zeros(0), 0)
        panels[SINGULAR : SINGULAR + count] = -(growth - 1.0) / (growth + 1.0)
        panels[SINGULAR + PANEL_CAPACITY : SINGULAR + PANEL_CAPACITY + count] = start + 0.5 * length
        panels[SINGULAR + 2 * PANEL_CAPACITY : SINGULAR + 2 * PANEL_CAPACITY + count] = 0.5 * length
        map_panels(panels, count, np.full(3, -1))
        bound_rates_by_ellipse(panels, count)
        for k in range(count):
            middle = start + 0.5 * length - np.pi * panels[ANCHOR + k]
            of_panel = np.arctan(panels[FIRST + k]) + np.arctan(panels[LAST + k])
            middle -= 2.0 * np.pi * np.round((middle - of_panel) / (2.0 * np.pi))
            boundary = middle + 0.5 * length * (major * np.cos(phases) + 1j * minor * np.sin(phases))
            boundary = boundary[np.abs(boundary.real) < np.pi]
            x = (np.arcsinh(np.tan(0.5 * boundary) / panels[SCALE + k]) - panels[CENTRE + k]) / panels[HALF + k]
            axis = 0.5 * (np.abs(x - 1.0) + np.abs(x + 1.0)).min(initial=np.inf)
            largest = np.arccosh(min(axis, np.sqrt(1.0 + (0.5 * np.pi / panels[HALF + k]) ** 2)))
            assert 0.95 * largest <= panels[RATE + k] <= largest
