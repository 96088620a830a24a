"""Designs pinned in the report: their overlay, curves and values, by mouse and keyboard."""

import numpy as np
import pytest

import explore
from browser.chromium import settle, silent_page

#: Colours of the looks on a light page: of the first two pins, and of the chosen design.
BLUE, ORANGE, GREEN = (0, 114, 178), (230, 159, 0), (0, 158, 115)


def pin(page, *designs, chosen):
    page.evaluate(
        """([designs, chosen]) => {
            const {model, shared} = exploreReport.page;
            for (const design of designs) shared.pins.toggle(model.designs.indexOf(design));
            shared.chosen.set(model.designs.indexOf(chosen));
        }""",
        [[int(design) for design in designs], int(chosen)],
    )
    settle(page)


def set_angle(page, degrees):
    slider = page.get_by_label("crank angle in degrees")
    slider.evaluate(f"node => {{ node.value = {degrees}; node.dispatchEvent(new Event('input')); }}")
    settle(page)


def pixels(page, selector, colour):
    """Rows and columns of a canvas with this colour, in CSS pixels, shape (n, 2)."""
    return np.array(
        page.evaluate(
            """([selector, colour]) => {
                const canvas = document.querySelector(selector), {width, height} = canvas;
                // Reading a canvas itself again and again makes the browser complain.
                const copy = new OffscreenCanvas(width, height).getContext("2d", {willReadFrequently: true});
                copy.drawImage(canvas, 0, 0);
                const {data} = copy.getImageData(0, 0, width, height), found = [];
                for (let i = 0; i < data.length; i += 4)
                    if (data[i + 3] > 250 && colour.every((part, k) => Math.abs(data[i + k] - part) < 6))
                        found.push([Math.floor(i / 4 / width) / devicePixelRatio, (i / 4 % width) / devicePixelRatio]);
                return found;
            }""",
            [selector, list(colour)],
        )
    ).reshape(-1, 2)


@pytest.fixture
def moving(frame):
    """Numbers of designs that move, apart from each other."""
    return frame.index[frame["status"] == 1].to_numpy()[::37]


@pytest.fixture
def still_page(page):
    page.emulate_media(color_scheme="light", reduced_motion="reduce")
    yield page
    page.emulate_media(color_scheme="null", reduced_motion="null")


def test_the_mechanisms_are_drawn_to_one_scale(still_page, frame):
    """Of each colour, the fullest row of pixels is that of the lines under the two pivots, a ground's length apart."""
    moves = frame[frame["status"] == 1]
    short, long = (
        moves.index[moves["ground"] == ground][0] for ground in (moves["ground"].min(), moves["ground"].max())
    )
    pin(still_page, short, chosen=long)
    set_angle(still_page, 90)
    ends = {}
    for colour in (BLUE, GREEN):
        found = pixels(still_page, "canvas.picture", colour)
        rows, counts = np.unique(found[:, 0], return_counts=True)
        ends[colour] = found[found[:, 0] == rows[counts.argmax()], 1]
    # The chosen design is drawn last, over the crank's pivot, which both have.
    origin = ends[GREEN][ends[GREEN] < ends[GREEN].mean()].max()
    lengths = [ends[colour].max() - origin for colour in (BLUE, GREEN)]
    expected = frame.loc[short, "ground"] / frame.loc[long, "ground"]
    assert lengths[0] / lengths[1] == pytest.approx(expected, abs=2.0 / lengths[1]), "a pixel at each end"
    assert expected < 0.95, "the designs differ enough to tell one scale from two"


def test_curves_of_all_pinned_designs_have_one_cursor(still_page, frame, moving):
    pin(still_page, *moving[:2], chosen=moving[2])
    set_angle(still_page, 137)
    titles = still_page.locator(".curve .title").all_inner_texts()
    assert "angle: coupler [deg]" in titles
    assert "angle: rocker [deg]" in titles
    names = {"angular velocity: rocker [rad/s]": "rocker_velocity", "transmission angle [deg]": "transmission_angle"}
    for title, signal in names.items():
        texts = still_page.locator(".curve").nth(titles.index(title)).locator(".value span").all_inner_texts()
        shown = [float(text.replace("−", "-")) for text in texts]
        parameters = ["crank", "coupler", "rocker", "ground", "speed"]
        exact = [
            explore.simulate("crank-rocker", frame.loc[design, parameters].to_dict(), angles=[137.0])[signal].iloc[0]
            for design in moving[:3]
        ]
        assert shown == pytest.approx(exact, rel=1e-3), "four digits"
        selector = f".curve:nth-child({titles.index(title) + 1}) canvas"
        for colour in (BLUE, ORANGE, GREEN):
            assert len(pixels(still_page, selector, colour)) > 30, (title, colour)


def test_pinned_designs_differ_by_dash_and_marker_too(still_page, moving):
    pin(still_page, *moving[:4], chosen=moving[4])
    samples = still_page.locator(".pins .sample")
    looks = [
        (
            samples.nth(k).locator("path").nth(0).get_attribute("stroke-dasharray"),
            samples.nth(k).locator("path").nth(1).get_attribute("d"),
        )
        for k in range(samples.count())
    ]
    assert len(looks) == 5
    assert len({dash for dash, _ in looks}) == 5
    assert len({shape for _, shape in looks}) == 5
    assert still_page.locator("#scatter .focus [class^=hue]").count() == 4
    lines = [line.get_attribute("points") for line in still_page.locator(".pinned-line").all()]
    assert all(lines)
    assert len(set(lines)) == 4


def test_all_pinned_mechanisms_move_together(still_page, moving):
    pin(still_page, *moving[:2], chosen=moving[2])
    set_angle(still_page, 20)
    before = [pixels(still_page, "canvas.picture", colour) for colour in (BLUE, ORANGE, GREEN)]
    still_page.get_by_role("button", name="Play").click()
    still_page.wait_for_timeout(400)
    still_page.get_by_role("button", name="Pause").click()
    after = [pixels(still_page, "canvas.picture", colour) for colour in (BLUE, ORANGE, GREEN)]
    assert not any(np.array_equal(*pair) for pair in zip(before, after, strict=True))


def test_pinning_by_keyboard(still_page):
    grid = still_page.locator(".grid")
    grid.focus()
    for _ in range(5):
        still_page.keyboard.press("ArrowDown")
        still_page.keyboard.press("p")
    settle(still_page)
    pinned = still_page.evaluate("exploreReport.page.shared.pins.rows")
    assert pinned == still_page.evaluate("[...exploreReport.page.rows()].slice(1, 5)"), "four at most"
    button = still_page.locator(".pin-button")
    assert button.is_disabled()
    remove = still_page.locator(".pins").get_by_role("button", name="unpin").nth(1)
    remove.focus()
    still_page.keyboard.press("Enter")
    left = [pinned[0], pinned[2], pinned[3]]
    assert still_page.evaluate("exploreReport.page.shared.pins.rows") == left
    assert still_page.locator("#design [role=status]").inner_text().endswith("unpinned, 3 of 4")
    assert still_page.evaluate("document.activeElement.className") == "pin-button", "the focus is not lost"
    still_page.keyboard.press("Enter")
    assert still_page.evaluate("exploreReport.page.shared.pins.rows.length") == 4
    assert button.inner_text() == "Unpin"


def test_the_values_stand_side_by_side(still_page, frame, moving):
    pin(still_page, *moving[:2], chosen=moving[2])
    table = still_page.locator("#design table.compared").first
    header = [text.replace(",", "") for text in table.locator("tr").first.locator("th").all_inner_texts()]
    assert header == [str(design) for design in moving[:3]]
    row = table.locator("tr", has=still_page.get_by_role("rowheader", name="crank [mm]", exact=True))
    assert [float(text) for text in row.locator("td").all_inner_texts()] == list(frame.loc[moving[:3], "crank"])


def test_a_pinned_design_without_a_motion_is_shown_in_numbers(still_page, frame, moving):
    blocked = frame.index[frame["status"] == 3][0]
    pin(still_page, blocked, chosen=moving[0])
    assert len(pixels(still_page, "canvas.picture", GREEN)) > 30
    assert still_page.locator("#design table.compared").count() == 2
    pin(still_page, chosen=blocked)
    assert "No full turn to draw" in still_page.locator("#design .message").inner_text()
    assert not still_page.locator("canvas.picture").is_visible()


def test_a_narrow_page_does_not_scroll_sideways(browser, study, moving):
    options = {"viewport": {"width": 390, "height": 844}, "reduced_motion": "reduce"}
    with silent_page(browser, study.path.with_suffix(".html"), **options) as page:
        pin(page, *moving[:4], chosen=moving[4])
        assert page.evaluate("document.documentElement.scrollWidth") == 390
