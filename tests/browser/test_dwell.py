"""The slider of a dwell on the page: its travel, drawing and files, as the library computes them."""

import io

import numpy as np
import pandas as pd
import pytest

import explore
from browser.chromium import silent_page
from browser.conftest import report_of
from browser.test_design import saved
from explore.figures.simulation import simulate_design

TASK = """task = "dwell"
[target]
dwell_angle = "90 deg"
stroke = "30 mm"
[search]
count = 2
"""
#: The points of the page's drawing at input angles.
PLACES = """angles => {
    const { motionOf, page, sum } = exploreReport, { model, shared } = page;
    const values = exploreReport.parametersOf(model, shared.chosen.row);
    const motion = motionOf(model.study.motion, values, model.study.drive);
    return angles.map((angle) => {
        const pose = exploreReport.poseAt(motion, angle);
        const points = Object.entries(motion.declared.drawing.points);
        return points.map(([name, vectors]) => [name, sum(vectors, pose)]);
    });
}"""


@pytest.fixture(scope="module")
def dwells(tmp_path_factory):
    """Linkages with their page beside the file."""
    folder = tmp_path_factory.mktemp("dwell")
    (folder / "task.toml").write_text(TASK)
    results = explore.synthesize(folder / "task.toml", folder / "dwells.h5")
    report_of(results.path)
    return results


@pytest.mark.parametrize("width", [1400, 390])
def test_the_slider_moves_as_in_the_figures(browser, dwells, width):
    angles = np.arange(0.0, 360.0, 7.5)
    with silent_page(browser, dwells.path.with_suffix(".html"), viewport={"width": width, "height": 900}) as page:
        design = page.evaluate("exploreReport.page.model.designs[exploreReport.page.shared.chosen.row]")
        simulated = simulate_design(dwells, int(design))
        expected = simulated.pose(angles).points(simulated.drawing)
        found = page.evaluate(PLACES, angles.tolist())
        assert {name for name, _ in found[0]} == set(expected)
        for at, places in enumerate(found):
            for name, place in places:
                # The same formulas: sine, arctangent and the order of operations differ.
                assert place == pytest.approx(expected[name][at], abs=1e-9 * simulated.slider.link), name
        assert page.locator("figure.curve").first.locator(".title").inner_text() == "travel of the slider [mm]"
        legend = page.locator("#design .legend").inner_text()
        assert "link of the slider" in legend
        assert f"dwell {simulated.slider.dwell[1] - simulated.slider.dwell[0]:.4g}°" in legend
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        motion = pd.read_csv(io.StringIO(saved(page, "motion (CSV)")))
        travel = simulated.pose(motion.iloc[:, 0].to_numpy()).lengths["slider_travel"]
        assert motion["slider_travel [mm]"].to_numpy() == pytest.approx(travel, abs=1e-9 * simulated.slider.link)


def test_the_dwell_is_shaded_on_its_curve(browser, dwells):
    """The colour behind the curve at the middle of the dwell is not that opposite to it."""
    options = {"reduced_motion": "reduce", "color_scheme": "light"}
    with silent_page(browser, dwells.path.with_suffix(".html"), **options) as page:
        design = page.evaluate("exploreReport.page.model.designs[exploreReport.page.shared.chosen.row]")
        start, stop = simulate_design(dwells, int(design)).slider.dwell
        shades = page.evaluate(
            """angles => {
                const canvas = document.querySelector("figure.curve canvas"), context = canvas.getContext("2d");
                const ratio = canvas.width / canvas.clientWidth, [left, right] = [42, 8].map((one) => one * ratio);
                const { width, height } = canvas, { data } = context.getImageData(0, 0, width, height);
                return angles.map((angle) => {
                    const x = Math.round(left + ((((angle % 360) + 360) % 360) / 360) * (width - left - right));
                    const counts = {};
                    for (let y = 10; y < 90; y++) {
                        const from = 4 * (Math.round(y * ratio) * width + x);
                        const colour = data.slice(from, from + 4).join();
                        counts[colour] = (counts[colour] ?? 0) + 1;
                    }
                    return Object.entries(counts).sort((a, b) => b[1] - a[1])[0][0];
                });
            }""",
            [start + 0.3 * (stop - start), start + 0.7 * (stop - start), start - 20.0, stop + 20.0],
        )
        assert shades[0] == shades[1] != shades[2] == shades[3]
