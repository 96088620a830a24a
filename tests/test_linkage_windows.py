"""Statistics of linkages over parts of the turn, whose nodes follow from the distance of the nearest singularity."""

import numpy as np
import pytest
from linkage_cases import CASES, columns, linkage_of, scattered

from explore.base.lanes.designs import fill_motion_of_design
from explore.evaluation.evaluate import evaluate_columns
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
