"""The results browser of a service in a real browser: counts are those of pandas, brushed, typed, zoomed, compared."""

import pytest
from served import serving

import explore
from browser.service_pages import accessibility_faults, service_page, watched

GRID = """mechanism = "crank-rocker"
[parameters]
crank = { start = 80, stop = 160, num = 81 }
coupler = { start = 900, stop = 1100, num = 9 }
rocker = 541.7118
ground = { start = 600, stop = 800, num = 9 }
[constraints]
swing_angle = { min = 20 }
[rank]
metrics = ["cv", "swing_angle:max", "crank:min"]
"""
SHORT = GRID.replace("stop = 160, num = 81", "stop = 140, num = 61")
#: Without the metrics of the others.
OTHER = SHORT.replace('metrics = ["cv", "swing_angle:max", "crank:min"]', 'metrics = ["time_ratio:max"]').replace(
    "[rank]", '[evaluate]\nmetrics = ["time_ratio", "swing_angle"]\n[rank]'
)
SLIDER = """mechanism = "slider-crank"
[parameters]
crank = { start = 40, stop = 80, num = 9 }
rod = 200
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    with serving(
        tmp_path_factory.mktemp("browsing") / "served", grid=GRID, short=SHORT, other=OTHER, slider=SLIDER
    ) as server:
        yield server


@pytest.fixture(scope="module")
def frame(served):
    return explore.read_results(served.folder / "results" / "grid.h5")


@pytest.fixture(scope="module")
def tab(browser, served):
    """A tab with the session of a link."""
    with browser.new_context(viewport={"width": 1280, "height": 900}) as context:
        tab = context.new_page()
        log_in(tab, served)
        yield tab


@pytest.fixture
def page(tab, served):
    """The results of the grid, counted, ranked, and with a design drawn."""
    with watched(tab, served):
        tab.goto(f"{served.url}/page/browse.html?results=grid")
        wait_shown(tab)
        yield tab


def log_in(page, served):
    page.goto(f"{served.url}/#token={served.new_link()}")
    page.wait_for_selector("#state:text-is('connected')")


def wait_shown(page):
    page.wait_for_selector("#ranking tbody tr", timeout=120_000)
    page.wait_for_selector("#design .picture", timeout=240_000)


def wait_total(page, text):
    """Wait until the counts of selected designs are these."""
    page.wait_for_function("text => document.getElementById('total').textContent === text", arg=text)


def wait_selected(page, count, everything):
    wait_total(page, f"{count:,} of {everything:,} designs")


def drag(page, selector, start, stop, height=(0.5, 0.5)):
    """Drag over an element, from and to shares of its width and height."""
    box = page.locator(selector).bounding_box()
    places = [
        (box["x"] + box["width"] * x, box["y"] + box["height"] * y) for x, y in zip((start, stop), height, strict=True)
    ]
    page.mouse.move(*places[0])
    page.mouse.down()
    page.mouse.move(*places[1], steps=8)
    page.mouse.up()


def end(page, side, name):
    return float(page.input_value(f"[aria-label='{side} {name}']"))


def test_the_constraints_of_the_study_are_the_first_conditions(page, frame):
    wait_selected(page, int(frame["feasible"].sum()), len(frame))
    page.click("text=All designs")
    wait_selected(page, len(frame), len(frame))
    page.click("text=Constraints of the study")
    wait_selected(page, int(frame["feasible"].sum()), len(frame))


def test_brushed_and_typed_ranges_select_what_pandas_selects(page, frame):
    drag(page, "[data-column=crank] canvas", 0.25, 0.6)
    low, high = end(page, "least", "crank"), end(page, "largest", "crank")
    assert 95 < low < 105
    assert 123 < high < 133
    inside = frame["feasible"] & frame["crank"].between(low, high)
    wait_selected(page, int(inside.sum()), len(frame))

    page.focus("[aria-label='largest crank']")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Shift+ArrowDown")
    assert end(page, "largest", "crank") == pytest.approx(high - 0.11 * 80, abs=0.01)
    inside = frame["feasible"] & frame["crank"].between(low, end(page, "largest", "crank"))
    wait_selected(page, int(inside.sum()), len(frame))

    page.fill("[aria-label='least swing angle']", "24.5")
    page.keyboard.press("Enter")
    inside &= frame["swing_angle"] >= 24.5
    wait_selected(page, int(inside.sum()), len(frame))
    best = frame[inside]["cv"].idxmin()
    page.wait_for_selector(f"#ranking tbody tr:first-child [aria-label='choose design {best}']")

    page.click("[aria-label^='remove crank']")
    inside = frame["swing_angle"] >= 24.5
    wait_selected(page, int(inside.sum()), len(frame))
    page.fill("[aria-label='least swing angle']", "abc")
    page.keyboard.press("Enter")
    assert page.get_attribute("[aria-label='least swing angle']", "aria-invalid") == "true"
    wait_selected(page, int(inside.sum()), len(frame))


def test_a_narrow_window_is_drawn_design_by_design(page, frame):
    page.focus("#cloud canvas")
    for _ in range(6):
        page.keyboard.press("+")
    page.wait_for_selector("#cloud .caption:has-text('drawn one by one; click one')")
    page.keyboard.press("0")
    page.wait_for_selector("#cloud .caption:has-text('darker where there are more')")
    drag(page, "#cloud canvas", 0.45, 0.5, (0.2, 0.8))
    page.wait_for_selector("#cloud .caption:has-text('drawn one by one; click one')")


def test_rings_that_are_not_of_all_pareto_optimal_designs_are_told(page):
    """A front of more designs than are asked for."""

    def answer(route):
        response = route.fetch()
        route.fulfill(response=response, json={**response.json(), "found": 5000})

    assert page.locator("#cloud .caption").text_content().endswith(" Rings are Pareto-optimal.")
    page.route("**/rank*", answer)
    page.reload()
    wait_shown(page)
    page.unroute("**/rank*")
    text = page.locator("#cloud .caption").text_content()
    assert text.endswith(" Rings are the best 23 of 5,000 Pareto-optimal designs.")


def test_few_selected_designs_are_drawn_one_by_one_without_a_zoom(page, frame):
    page.wait_for_selector("#cloud .caption:has-text('darker where there are more')")
    page.fill("[aria-label='largest crank']", "100")
    page.keyboard.press("Enter")
    few = (frame["feasible"] & (frame["crank"] <= 100)).sum()
    assert 0 < few < 2000
    page.wait_for_selector(f"#cloud .caption:has-text('{few:,} selected designs in this window, drawn one by one')")


def test_designs_are_chosen_and_pinned(page, frame):
    rows = page.locator("#ranking tbody button")
    first, last = rows.first.inner_text(), rows.last.inner_text()
    page.click("#design .pin-button")
    rows.last.click()
    page.wait_for_selector(f"#design h2:has-text('Design {last}')")
    assert page.locator("#design .compared").first.locator("th[scope=col]").all_inner_texts() == [first, last]
    number = int(last.replace(",", ""))
    crank = page.locator("#design .compared tr:has(th:text-is('crank [mm]')) td").last.inner_text()
    assert float(crank) == pytest.approx(frame["crank"].iloc[number], rel=1e-5)


def test_a_chosen_design_is_saved_and_linked(page, frame):
    last = page.locator("#ranking tbody button").last
    number = int(last.inner_text().replace(",", ""))
    last.click()
    page.wait_for_selector(f"#design h2:has-text('Design {number:,}')")
    with page.expect_download() as told:
        page.click(f"[aria-label='study (TOML) of design {number}']")
    assert told.value.suggested_filename == f"grid-{number}.toml"
    assert f"crank = {float(frame['crank'].iloc[number])}" in told.value.path().read_text()
    address = page.get_attribute("#design .files a:text-is('link to this design')", "href")
    page.goto("about:blank")
    page.goto(address)
    wait_shown(page)
    page.wait_for_selector(f"#design h2:has-text('Design {number:,}')")
    page.wait_for_selector("#design .badge:has-text('Pareto')")


def test_units_and_limits_are_shown_as_people_write_them(page):
    field = "[aria-label='least crank']"
    page.fill(field, "100.00000030900")
    page.keyboard.press("Tab")
    assert page.input_value(field) == "100"
    assert page.locator("#cloud .title").count() == 2
    overlaps = """() => {
        const axis = [...document.querySelectorAll('#cloud svg > g')].at(-1);
        const title = axis.querySelector('.title').getBoundingClientRect();
        return [...axis.querySelectorAll('.tick text')].some((tick) => tick.getBoundingClientRect().left < title.right);
    }"""
    assert not page.evaluate(overlaps)
    bars = page.eval_on_selector_all(
        ".histogram canvas", "all => all.map((one) => Math.round(one.getBoundingClientRect().bottom))"
    )
    assert len(set(bars[:4])) == 1, "in one line also beside a heading that is wrapped"


def test_several_results_are_shown_together(page, frame):
    page.select_option("#compare select", "short")
    page.wait_for_selector("h1:text-is('grid and short')")
    wait_shown(page)
    short = frame[frame["crank"] <= 140]
    counts = [f"{part['feasible'].sum():,} of {len(part):,} designs" for part in (frame, short)]
    wait_total(page, f"grid: {counts[0]} · short: {counts[1]}")
    assert {"grid", "short"} == set(page.locator("#ranking tbody tr td:first-child").all_inner_texts())
    cv = [float(text) for text in page.locator("#ranking tbody td:nth-child(3)").all_inner_texts()]
    assert cv == sorted(cv), "the best of both first"
    page.locator("#ranking tbody tr:has(td:text-is('short')) button").last.click()
    page.wait_for_selector("#design h2:has-text('of short')")


def test_results_are_compared_that_can_be(page, served, frame):
    offered = page.locator("#compare option").all_inner_texts()
    assert sorted(offered[1:]) == ["other", "short"], "results of one mechanism"
    page.goto(f"{served.url}/page/browse.html?results=grid&results=other")
    counts = [f"{part['feasible'].sum():,} of {len(part):,} designs" for part in (frame, frame[frame["crank"] <= 140])]
    page.wait_for_selector("#total:has-text('other')")
    wait_total(page, f"grid: {counts[0]} · other: {counts[1]}")
    page.wait_for_selector("#cloud .caption:has-text('selected designs in this window')")
    page.goto(f"{served.url}/page/browse.html?results=grid&results=slider")
    page.wait_for_selector(
        "#notice:has-text('grid is of crank-rocker, slider of slider-crank; results of one mechanism')"
    )


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_serious_fault_of_accessibility_is_found(browser, served, scheme):
    with service_page(browser, served, color_scheme=scheme) as page:
        log_in(page, served)
        assert accessibility_faults(page) == []
        page.click("[aria-label='browse the results of short']")
        wait_shown(page)
        assert accessibility_faults(page) == []


def test_the_page_is_no_wider_than_a_telephone(browser, served):
    with service_page(browser, served, viewport={"width": 390, "height": 800}) as page:
        log_in(page, served)
        page.goto(f"{served.url}/page/browse.html?results=short")
        wait_shown(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
