"""The target of a study on the page: the path against it and their distance, as the library computes them."""

import numpy as np
import pytest
from studies import sweep_text

import explore
from browser.chromium import silent_page
from browser.conftest import report_of
from explore.figures.charts.path import path_chart

STUDY = """mechanism = "crank-rocker"
[points]
M = { along = "-22.371 mm", across = "7.0966 mm" }
[target]
kind = "path"
points = [
    ["-27 mm", "1 mm"], ["-11.571 mm", "-11.642 mm"], ["3.857 mm", "-24.285 mm"], ["15 mm", "-29.9 mm"],
    ["27.2 mm", "-25 mm"], ["28 mm", "-10 mm"], ["15 mm", "10.6 mm"],
]
closed = true
[parameters]
crank = ["17 mm", "17.43 mm"]
coupler = "25.46 mm"
rocker = "64.57 mm"
ground = "65.87 mm"
crank_pivot_x = "-11.55 mm"
crank_pivot_y = "-20.14 mm"
ground_angle = [170.8, 165]
[units]
length = "in"
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Two designs with their page beside the file."""
    results = sweep_text(tmp_path_factory.mktemp("target"), STUDY, "path")
    report_of(results.path)
    return results


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_distance_to_the_target_agrees_with_the_figure(browser, results, scheme):
    path = results.path.with_suffix(".html")
    best = int(explore.rank(results).index[0])
    error = path_chart(results, design=best).axes[1]
    curve = error.get_lines()[0]
    with silent_page(browser, path, viewport={"width": 390, "height": 900}, color_scheme=scheme) as page:
        figure = page.locator("figure.curve").first
        assert figure.locator(".title").inner_text() == "distance to target [in]"
        assert "target" in page.locator("#design .legend").inner_text()
        slider = page.locator("#design input[type=range]")
        for degrees in (0, 47, 180, 301.5):
            slider.evaluate("(node, value) => { node.value = value; node.dispatchEvent(new Event('input')); }", degrees)
            shown = float(figure.locator(".value").inner_text())
            expected = float(np.interp(degrees, curve.get_xdata(), curve.get_ydata()))
            assert shown == pytest.approx(expected / 25.4, rel=1e-3)  # four digits are shown
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
