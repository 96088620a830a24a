"""Zoom in the report's scatter: wheel, fingers, buttons, keys; boxes select as without it."""

import pytest

from browser.chromium import select_box, settle, shown_count, silent_page


def ends(page):
    """The first and the last value on the axis of x."""
    texts = page.locator("#scatter .x .tick text").all_text_contents()
    values = [float(text.replace("−", "-")) for text in texts]
    return values[0], values[-1]


def span(page):
    low, high = ends(page)
    return high - low


def middle(page):
    box = page.locator("#scatter .brush .overlay").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def wheel(page, key, delta):
    page.mouse.move(*middle(page))
    if key:
        page.keyboard.down(key)
    page.mouse.wheel(0, delta)
    if key:
        page.keyboard.up(key)
    page.wait_for_timeout(100)
    settle(page)


def test_the_wheel_zooms_with_ctrl_and_scrolls_without(page):
    whole = span(page)
    x, _ = page.evaluate("exploreReport.page.whereIs(exploreReport.page.shared.chosen.row)")
    wheel(page, None, 100)
    assert span(page) == whole
    wheel(page, "Control", -300)
    assert span(page) < 0.7 * whole
    assert "zoom out" in page.locator("#scatter .caption").inner_text()
    wheel(page, "Control", 300)
    wheel(page, "Control", 300)
    assert span(page) == whole
    assert page.evaluate("exploreReport.page.whereIs(exploreReport.page.shared.chosen.row)")[0] == x


def test_buttons_zoom_to_a_box_and_back(page):
    whole = ends(page)
    buttons = {name: page.get_by_role("button", name=name, exact=True) for name in ("zoom in", "zoom out", "show all")}
    assert buttons["zoom out"].is_disabled()
    assert buttons["show all"].is_disabled()
    select_box(page, (0.2, 0.3), (0.5, 0.8))
    selected = shown_count(page)
    buttons["zoom in"].click()
    settle(page)
    box = page.locator("#scatter .brush .selection").bounding_box()
    plot = page.locator("#scatter .brush .overlay").bounding_box()
    # The box with a margin of a twenty-fifth on each side fills the plot; a line is a pixel wide.
    assert box["width"] == pytest.approx(plot["width"] / 1.08, abs=2.0)
    assert box["height"] == pytest.approx(plot["height"] / 1.08, abs=2.0)
    assert shown_count(page) == selected, "the selection stays"
    buttons["zoom out"].click()
    buttons["show all"].click()
    settle(page)
    assert ends(page) == whole
    assert shown_count(page) == selected


def test_a_box_in_a_zoomed_plot_selects_what_is_in_it(page, frame):
    page.get_by_role("button", name="zoom in", exact=True).click()
    page.get_by_role("button", name="zoom in", exact=True).click()
    select_box(page, (0.2, 0.2), (0.7, 0.7))
    (cv, swing) = page.evaluate("exploreReport.page.shared.selection.conditions()")
    expected = frame["cv"].between(cv["low"], cv["high"]) & frame["swing_angle"].between(swing["low"], swing["high"])
    assert shown_count(page) == expected.sum() > 0
    whole = frame.loc[frame["feasible"], "cv"]
    assert cv["high"] - cv["low"] < 0.3 * (whole.max() - whole.min()), "half of the plot is less than half of the axis"


def test_dragging_with_shift_moves_the_plot_and_selects_nothing(page):
    page.get_by_role("button", name="zoom in", exact=True).click()
    settle(page)
    row = page.evaluate("exploreReport.page.shared.chosen.row")
    count = shown_count(page)
    before = page.evaluate(
        "[...Array(exploreReport.page.model.size).keys()].map(exploreReport.page.whereIs).findIndex(([x]) => x > 400)"
    )
    x, y = page.evaluate("row => exploreReport.page.whereIs(row)", before)
    start = middle(page)
    page.mouse.move(*start)
    page.keyboard.down("Shift")
    page.mouse.down()
    page.mouse.move(start[0] - 60, start[1] + 5, steps=4)
    page.mouse.up()
    page.keyboard.up("Shift")
    settle(page)
    moved = page.evaluate("row => exploreReport.page.whereIs(row)", before)
    assert moved == pytest.approx([x - 60, y + 5], abs=0.01)
    assert shown_count(page) == count
    assert page.evaluate("exploreReport.page.shared.chosen.row") == row, "no click either"


def test_keys_zoom_move_and_reset(page):
    whole = ends(page)
    page.locator("#scatter .plot > svg").focus()
    page.keyboard.press("+")
    settle(page)
    zoomed = ends(page)
    assert zoomed[1] - zoomed[0] < whole[1] - whole[0]
    page.keyboard.press("ArrowRight")
    settle(page)
    assert ends(page)[1] > zoomed[1]
    page.keyboard.press("0")
    settle(page)
    assert ends(page) == whole


def test_other_axes_begin_without_zoom(page):
    page.get_by_role("button", name="zoom in", exact=True).click()
    page.locator("#scatter").get_by_label("x", exact=True).select_option("crank")
    settle(page)
    assert page.get_by_role("button", name="show all", exact=True).is_disabled()


def test_two_fingers_zoom_and_keep_the_box(browser, study):
    options = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    with silent_page(browser, study.path.with_suffix(".html"), reduced_motion="reduce", **options) as page:
        page.locator("#scatter .plot").scroll_into_view_if_needed()
        page.evaluate(
            "exploreReport.page.shared.selection.set('scatter', [{column: 'cv', low: 0, high: 1}, "
            "{column: 'swing_angle', low: 25, high: 35}])"
        )
        settle(page)
        whole, selected = span(page), shown_count(page)
        x, y = middle(page)
        session = page.context.new_cdp_session(page)

        def touch(kind, *offsets):
            points = [{"x": x + offset, "y": y, "id": k} for k, offset in enumerate(offsets)]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        touch("touchStart", -20)
        touch("touchStart", -20, 20)
        for step in range(1, 8):
            touch("touchMove", -20 - 6 * step, 20 + 6 * step)
        touch("touchEnd")
        page.wait_for_timeout(100)
        settle(page)
        assert span(page) < 0.6 * whole
        assert shown_count(page) == selected
