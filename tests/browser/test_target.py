"""The target of a study on the page: the path against it and their distance, as the library computes them."""

import numpy as np
import pytest
from studies import TABLE, TARGET, sweep_text

import explore
from browser.chromium import silent_page
from browser.conftest import report_of
from explore.figures.charts.path import path_chart
from explore.studies.config.linkage import mechanism_of

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

#: Keeps the texts that are drawn in the first curve.
COLLECT_TEXTS = """() => {
    const { prototype } = CanvasRenderingContext2D, draw = prototype.fillText;
    window.texts = [];
    prototype.fillText = function (text, ...place) {
        if (this.canvas.closest("figure.curve") === document.querySelector("figure.curve")) window.texts.push(text);
        return draw.call(this, text, ...place);
    };
}"""


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


def test_distances_to_points_that_are_met_exactly_have_the_axis_of_the_turn(browser, tmp_path):
    """The points are of the path itself, so that the distance at them is rounding, 1e-14 mm."""
    design = {"crank": 100, "coupler": 250, "rocker": 250, "ground": 200}
    motion = explore.simulate("crank-rocker", design, points={"M": (200, 80)}, angles=[10, 50, 90, 130])
    places = motion[["M_x", "M_y"]].to_numpy().tolist()
    parameters = "".join(f"{name} = {value}\n" for name, value in design.items())
    text = f"""mechanism = "crank-rocker"
[points]
M = {{ along = 200, across = 80 }}
[target]
kind = "path"
points = {places}
[parameters]
{parameters}[evaluate]
metrics = ["path_error_max"]
"""
    results = sweep_text(tmp_path, text, "met")
    assert results.to_pandas()["path_error_max"].max() < 1e-9
    report_of(results.path)
    with silent_page(browser, results.path.with_suffix(".html")) as page:
        page.evaluate(COLLECT_TEXTS)
        page.set_viewport_size({"width": 900, "height": 900})  # draws the curves again
        page.wait_for_function("() => window.texts.length > 5")  # no text, which the policy of the page forbids
        ticks = [text for text in page.evaluate("window.texts") if "°" not in text]
        assert max(map(float, ticks)) > 10.0


#: Two four-bars of a table with a target, of which one turns and the other moves over the interval of the study alone.
BLOCKED = (
    (TABLE.replace("[20, 30]", "[20, 79]") + TARGET).replace("[[40, 40]", "[[60, 50]")
    + """
[evaluate]
window = { from = -40, to = 60 }
metrics = ["P_x_mean"]
"""
)


@pytest.fixture(scope="module")
def blocked(tmp_path_factory):
    results = sweep_text(tmp_path_factory.mktemp("blocked"), BLOCKED, "blocked")
    report_of(results.path)
    return results


def test_marks_of_a_design_that_does_not_turn_are_where_its_path_is_nearest(browser, blocked):
    with silent_page(browser, blocked.path.with_suffix(".html"), viewport={"width": 1400, "height": 1800}) as page:
        marks = page.evaluate(
            """() => {
                const { prototype } = CanvasRenderingContext2D, arc = prototype.arc, found = [];
                const { shared } = exploreReport.page;
                shared.chosen.set(0);
                prototype.arc = function (x, y, radius, ...rest) {
                    const share = (x - 42) / (this.canvas.clientWidth - 50);
                    if (radius === 2.4) found.push(-40 + 100 * share);
                    return arc.call(this, x, y, radius, ...rest);
                };
                shared.chosen.set(1);
                return found.slice(0, 3);
            }"""
        )
    angles, design = np.linspace(-40.0, 60.0, 2001), {"g": 100, "r": 79, "b": 90, "c": 80}
    motion = explore.simulate(mechanism_of(blocked).name, design, angles=angles)
    path = (motion["P_x"] + 1j * motion["P_y"]).to_numpy() * np.exp(1j * np.deg2rad(10.0))
    points = [complex(*point) for point in blocked.target.points]
    assert marks == pytest.approx([angles[np.abs(path - point).argmin()] for point in points], abs=0.06)


def test_a_design_that_does_not_turn_is_shown_within_its_motion_after_one_that_turns(browser, blocked):
    path = blocked.path.with_suffix(".html")
    with silent_page(browser, path, reduced_motion="reduce") as page:
        page.evaluate("const { shared } = exploreReport.page; shared.pins.toggle(0); shared.chosen.set(1);")
        slider = page.locator("#design input[type=range]")
        slider.evaluate("node => { node.value = 200; node.dispatchEvent(new Event('input')); }")
        page.evaluate("exploreReport.page.shared.pins.toggle(0)")
        assert page.locator("#design .reading").inner_text() == "crank angle −40.0°"
        assert "–" not in page.locator("figure.curve .value").first.inner_text()
