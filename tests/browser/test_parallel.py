"""Parallel axes: their order, colours and headings, and the opacity of their lines."""

import pytest
from studies import sweep_text

from browser.chromium import conditions, drag, select, settle, silent_page
from browser.conftest import STUDY, report_of


def headings(page):
    """Names of the axes from left to right, which is also their order for the tabulator key."""
    boxes = page.locator("#parallel .heading").evaluate_all(
        "nodes => nodes.map(node => [node.firstChild.textContent, node.getBoundingClientRect().left])"
    )
    assert boxes == sorted(boxes, key=lambda box: box[1])
    return [name for name, _ in boxes]


def heading(page, name):
    return page.locator("#parallel .heading").filter(has=page.get_by_text(name, exact=True))


def canvas_image(page):
    return page.evaluate("document.querySelector('#parallel canvas').toDataURL()")


def test_headings_of_objectives_show_the_better_direction(unchanged_page):
    texts = {text.split("\n")[0]: text for text in unchanged_page.locator("#parallel .heading").all_inner_texts()}
    better = {name: text.split("\n")[-1] for name, text in texts.items() if "better" in text}
    assert better == {"cv": "▼ better", "swing angle": "▲ better"}
    assert "small is better" in heading(unchanged_page, "cv").get_attribute("aria-label")


def test_arrow_keys_move_an_axis_and_its_brush(page):
    before = headings(page)
    select(page, 1, 0.0, 0.5)
    heading(page, before[1]).focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    settle(page)
    after = [before[0], before[2], before[3], before[1], *before[4:]]
    assert headings(page) == after
    assert page.evaluate("document.activeElement.firstChild.textContent") == before[1]
    assert f"axis 4 of {len(before)}" in heading(page, before[1]).get_attribute("aria-label")
    assert page.locator("#parallel [role=status]").inner_text() == f"{before[1]} is axis 4 of {len(before)}"
    assert [condition["column"] for condition in conditions(page)] == [before[1].replace(" ", "_")]
    assert page.locator("#parallel g.dimension").nth(3).locator(".selection[width]").count() == 1
    # The next brush applies to the axis that is now at that place.
    select(page, 1, 0.1, 0.6)
    assert conditions(page)[1]["column"] == before[2].replace(" ", "_")
    heading(page, before[1]).focus()
    for _ in range(9):
        page.keyboard.press("ArrowLeft")
    assert headings(page)[0] == before[1]


def test_dragging_a_heading_moves_its_axis(page):
    before, static = headings(page), canvas_image(page)
    start, stop = (heading(page, before[k]).bounding_box() for k in (6, 1))
    middle = [(box["x"] + box["width"] / 2, start["y"] + start["height"] / 2) for box in (start, stop)]
    drag(page, *middle)
    assert headings(page) == [before[0], before[6], *before[1:6], *before[7:]]
    assert canvas_image(page) != static
    assert page.locator("#parallel .dragged").count() == 0
    # A click without a drag moves no axis.
    heading(page, before[0]).click()
    assert headings(page)[0] == before[0]


def test_a_column_colours_the_lines(page, frame):
    kind_colours = canvas_image(page)
    assert page.locator("#parallel .ramp").count() == 0
    page.locator("#parallel").get_by_label("colour").select_option("time ratio")
    settle(page)
    assert canvas_image(page) != kind_colours
    front = page.evaluate("Array.from(exploreReport.page.model.kinds, (kind, row) => kind === 2 ? row : -1)")
    ratios = frame["time_ratio"].iloc[[row for row in front if row >= 0]]
    legend = page.locator("#parallel .legend").inner_text()
    assert legend.split("\n")[0].startswith(f"{ratios.min():.4g}")
    assert f"{ratios.max():.4g} time ratio" in legend.replace("\n", " ")
    page.locator("#parallel").get_by_label("colour").select_option("kind of design")
    settle(page)
    assert canvas_image(page) == kind_colours


def test_opacity_falls_with_the_number_of_lines_and_is_lowest_for_infeasible_ones(unchanged_page):
    opacity = "([kind, lines]) => exploreReport.opacity(kind, lines)"
    for kind in (0, 1, 2):
        few, some, many = (unchanged_page.evaluate(opacity, [kind, lines]) for lines in (3, 200, 825))
        assert few > some > many or (kind < 2 and few > some >= many)
    # 825 lines of 1.3 pixels on 250 pixels: four lines cover a pixel, and half of the background shows.
    assert (1.0 - unchanged_page.evaluate(opacity, [2, 825])) ** 4 > 0.5
    for lines in (1, 30, 400):
        infeasible, feasible, front = (unchanged_page.evaluate(opacity, [kind, lines]) for kind in (0, 1, 2))
        assert infeasible < feasible <= front


@pytest.fixture(scope="module")
def many_infeasible(tmp_path_factory):
    """A page whose constraint needs samples: such do not screen, and screened designs have no values to show."""
    text = STUDY.replace("rocker_velocity_mean = { min = 0.8, max = 1.2 }", "rocker_velocity_max = { max = 0.9 }")
    return report_of(sweep_text(tmp_path_factory.mktemp("pale"), text, "pale").path)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_crosses_in_the_scatter_are_pale(browser, many_infeasible, scheme):
    """Most orange pixels, which are those of infeasible designs, have an opacity below one half."""
    with silent_page(browser, many_infeasible, color_scheme=scheme) as page:
        n_pixels, median_alpha = page.evaluate(
            """() => {
                const canvas = document.querySelector("#scatter canvas");
                const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
                const alphas = [];
                for (let i = 0; i < data.length; i += 4)
                    if (data[i + 3] > 20 && data[i] > data[i + 2] + 80) alphas.push(data[i + 3]);
                alphas.sort((a, b) => a - b);
                return [alphas.length, alphas[Math.floor(alphas.length / 2)]];
            }"""
        )
    assert n_pixels > 100
    assert median_alpha < 128


def test_no_title_is_clipped_on_a_phone(browser, study):
    with silent_page(browser, study.path.with_suffix(".html"), viewport={"width": 390, "height": 844}) as page:
        frame = page.locator("#parallel .sideways").bounding_box()
        clipped = page.locator("#parallel .heading").evaluate_all(
            "nodes => nodes.filter(n => n.scrollWidth > n.clientWidth || n.scrollHeight > n.clientHeight).length"
        )
        boxes = [box.bounding_box() for box in page.locator("#parallel .heading").all()]
        assert len(boxes) > 5
        assert clipped == 0
        assert min(box["y"] for box in boxes) >= frame["y"]
        right = frame["x"] + frame["width"]
        visible = [box for box in boxes if box["x"] < right - 1.0]
        assert len(visible) >= 3
        assert max(box["x"] + box["width"] for box in visible) <= right + 1.0
        # The last ones are reached by scrolling.
        page.locator("#parallel .sideways").evaluate("node => { node.scrollLeft = node.scrollWidth; }")
        last = page.locator("#parallel .heading").last.bounding_box()
        assert last["x"] + last["width"] <= right + 1.0
