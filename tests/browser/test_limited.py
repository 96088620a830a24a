"""The page of a linkage whose crank has a range: its axes, its slider, and a motion to and fro."""

import numpy as np
import pytest
from studies import sweep_text
from test_linkage_range import LENGTHS, LIMITED, STUDY

import explore
from browser.chromium import settle, silent_page
from browser.conftest import report_of


@pytest.fixture(scope="module")
def limited(tmp_path_factory):
    results = sweep_text(tmp_path_factory.mktemp("limited"), STUDY, "limited")
    return report_of(results.path)


@pytest.fixture
def page(browser, limited):
    with silent_page(browser, limited, reduced_motion="reduce") as page:
        yield page


def test_the_page_moves_a_linkage_over_its_range(page):
    angles = np.linspace(-50.0, 50.0, 11)
    found = page.evaluate(
        """(angles) => {
            const lengths = {r1: 60, r2: 80, r3: 50, r4: 100, speed: 1};
            const motion = exploreReport.motionOf(exploreReport.page.model.study.motion, lengths, "none");
            return { span: motion.span, values: angles.map(angle => motion.at(angle).rocker_velocity) };
        }""",
        angles.tolist(),
    )
    assert found["span"] == [-50.0, 50.0]
    exact = explore.simulate(explore.Linkage(LIMITED), LENGTHS | {"r1": 60.0}, angles=angles)["rocker_velocity"]
    np.testing.assert_allclose(found["values"], exact, rtol=1e-12, atol=1e-13 * np.abs(exact).max())
    slider = page.locator("#design input[type=range]")
    assert (slider.get_attribute("min"), slider.get_attribute("max")) == ("-50", "50")
    assert "first −50.0°" in page.locator("#design").inner_text()


def test_play_goes_to_and_fro(page):
    """It turns back within the range, whatever the time between two pictures."""
    page.emulate_media(reduced_motion="no-preference")
    page.locator("#design .play").click()
    seen = page.evaluate(
        """async () => {
            const slider = document.querySelector("#design input[type=range]"), seen = [-50];
            do {
                await new Promise(requestAnimationFrame);
                seen.push(Number(slider.value));
            } while (seen.at(-1) >= seen.at(-2));
            return seen;
        }"""
    )
    assert len(seen) > 2
    assert all(-50.0 <= angle <= 50.0 for angle in seen)


def test_a_design_that_is_blocked_has_a_reason(page):
    page.evaluate("exploreReport.page.shared.chosen.set(exploreReport.page.model.designs.indexOf(1))")
    settle(page)
    text = page.locator("#design .message").inner_text()
    assert text.startswith("No motion over its range to draw: the crank cannot move over its range")
