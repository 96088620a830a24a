"""The page as a whole: keyboard, themes, print, sizes, notices of what is left out, and hostile names."""

import json
import shlex

import numpy as np
import pytest
from store_files import ATTRIBUTES, COLUMNS, values
from studies import sweep_text

import explore
from browser.chromium import settle, shown_count, silent_page, slowness, wait_ready
from browser.conftest import report_of, sobol
from explore.model.columns import Column
from explore.results.store.all_designs_writer import AllDesignsWriter


def visible_texts(page, field):
    """Texts of a column of the table in the visible rows."""
    cells = page.locator(f".grid .body .row .cell:nth-child({field})")
    return [text.replace("−", "-").replace(",", "") for text in cells.all_inner_texts()]


def test_the_page_shows_the_facts_of_the_file(unchanged_page, study, frame):
    text = unchanged_page.locator("body").inner_text()
    assert unchanged_page.title() == "small: report"
    for label, count in study.counts.items():
        assert label.replace("_", " ") in text
        assert f"{count:,}" in text
    assert json.loads(study.attributes["status_sentences"])["crank_blocked"] in text
    assert str(study.attributes["request_sha256"]) in text
    missed = (frame["transmission_angle_min_margin"] < 0).sum()
    assert f"missed by {missed:,}" in text
    assert "small is better" in text


def chosen_title(page):
    return page.locator("#design h2").inner_text().strip()


def test_the_page_names_the_designs_nearest_to_feasible(browser, unchanged_page, tmp_path):
    assert "Nearest to feasible" not in unchanged_page.locator("body").inner_text()  # enough is feasible
    text = sobol(2000) + "swing_angle = { min = 60 }\ntime_ratio = { max = 1.001 }\n"
    results = sweep_text(tmp_path, text, "none")
    nearest = explore.nearest(results, 10)
    assert not explore.read_results(results.path)["feasible"].any()

    with silent_page(browser, report_of(results.path)) as own:
        facts = own.locator("body").inner_text()
        assert chosen_title(own) == f"Design {nearest.index[0]:,}"
        own.get_by_role("button", name=f"design {nearest.index[3]:,}", exact=True).click()
        assert chosen_title(own) == f"Design {nearest.index[3]:,}"
        bar, panel = (own.locator(name).bounding_box() for name in ("#selection", "#design"))
        assert bar["y"] + bar["height"] <= panel["y"] < own.viewport_size["height"]

    assert "Nearest to feasible" in facts
    for design, row in nearest.iterrows():
        (line,) = [line for line in facts.splitlines() if line.startswith(f"design {design:,}\t")]
        for metric in ("swing_angle", "time_ratio", "transmission_angle_min", "transmission_angle_max"):
            assert (f"{metric.replace('_', ' ')} by" in line) == (row[f"{metric}_margin"] < 0.0)
    combinations = nearest.attrs["combinations"]
    assert f"{combinations['swing_angle', 'time_ratio']:,}\tmiss swing angle, time ratio together" in facts
    assert f"alone by {combinations[('swing_angle',)]:,}" in facts


def test_a_click_on_a_heading_sorts(page, frame):
    heading = page.locator(".head .cell", has_text="time ratio")
    heading.locator("button").click()
    assert heading.get_attribute("aria-sort") == "ascending"
    column = frame.columns.get_loc("time_ratio") + 3
    smallest = frame["time_ratio"].nsmallest(8)
    assert [float(text) for text in visible_texts(page, column)[:8]] == pytest.approx(smallest.tolist(), rel=1e-5)
    heading.locator("button").click()
    assert heading.get_attribute("aria-sort") == "descending"
    largest = frame["time_ratio"].nlargest(8)
    assert [float(text) for text in visible_texts(page, column)[:8]] == pytest.approx(largest.tolist(), rel=1e-5)
    # Undefined values are last in both orders.
    page.locator(".grid").evaluate("grid => { grid.scrollTop = grid.scrollHeight; }")
    settle(page)
    assert visible_texts(page, column)[-1] == "–"


def test_of_an_objective_feasible_designs_are_first(page, frame):
    feasible = frame[frame["feasible"]]
    column = frame.columns.get_loc("cv") + 3
    best = feasible["cv"].nsmallest(8)
    assert [float(text) for text in visible_texts(page, column)[:8]] == pytest.approx(best.tolist(), rel=1e-5)
    button = page.locator(".head .cell", has_text="swing angle").locator("button")
    for _ in range(2):
        button.click()
    best = feasible["swing_angle"].nlargest(8)
    assert frame["swing_angle"].max() > best.max()
    column = frame.columns.get_loc("swing_angle") + 3
    assert [float(text) for text in visible_texts(page, column)[:8]] == pytest.approx(best.tolist(), rel=1e-5)
    kinds = page.evaluate("Array.from(exploreReport.page.rows(), row => exploreReport.page.model.kinds[row])")
    assert 0 not in kinds[: len(feasible)]


def test_the_keyboard_moves_through_the_table(page):
    grid = page.locator(".grid")
    grid.focus()
    assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none"
    for key in ("ArrowDown", "ArrowDown", "PageDown", "ArrowUp"):
        page.keyboard.press(key)
    active = page.locator(".row.active")
    place = int(active.get_attribute("id").removeprefix("row-"))
    assert place > 5
    page.keyboard.press("Enter")
    design = page.evaluate("place => exploreReport.page.model.designs[exploreReport.page.rows()[place]]", place)
    assert page.locator("#design h2").inner_text().split()[-1].replace(",", "") == str(int(design))
    assert active.get_attribute("aria-selected") == "true"
    page.keyboard.press("End")
    assert page.locator(".row.active").get_attribute("aria-rowindex") == grid.get_attribute("aria-rowcount")
    page.keyboard.press("Home")
    assert page.locator(".row.active").get_attribute("aria-rowindex") == "2"


def test_every_control_has_a_label_and_is_reached_by_tab(page):
    unlabelled = page.evaluate(
        """[...document.querySelectorAll("button, select, input, [tabindex='0']")].filter(node =>
            !(node.textContent.trim() || node.ariaLabel || node.closest("label"))).map(node => node.outerHTML)"""
    )
    assert unlabelled == []
    focused = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        focused.add(page.evaluate("document.activeElement.getAttribute('class') || document.activeElement.tagName"))
    assert {"grid", "command", "play", "export"} <= focused


def assert_colours_contrast_with_the_panel(page):
    style = "getComputedStyle(document.documentElement).getPropertyValue"
    panel, ramp = (page.evaluate(f"{style}('{name}')") for name in ("--panel", "--ramp"))
    luminances = [luminance(colour) for colour in ramp.split(", ")]
    assert luminances == sorted(luminances)
    for value in luminances:
        dark, bright = sorted([value, luminance(panel)])
        assert (bright + 0.05) / (dark + 0.05) >= 2.0


def luminance(colour: str) -> float:
    """Relative luminance of "#rrggbb" as in the Web Content Accessibility Guidelines."""
    components = [int(colour.strip()[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    linear = [value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4 for value in components]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_the_theme_follows_the_system_and_the_button(browser, study):
    path = study.path.with_suffix(".html")
    backgrounds = {}
    for scheme in ("light", "dark"):
        with silent_page(browser, path, color_scheme=scheme) as page:
            background = "getComputedStyle(document.body).backgroundColor"
            backgrounds[scheme] = page.evaluate(background)
            assert_colours_contrast_with_the_panel(page)
            images = [page.evaluate("document.querySelector('#scatter canvas').toDataURL()")]
            page.locator(".theme").click()
            settle(page)
            backgrounds[f"{scheme} changed"] = page.evaluate(background)
            images.append(page.evaluate("document.querySelector('#scatter canvas').toDataURL()"))
            assert images[0] != images[1]
    assert backgrounds["light"] == backgrounds["dark changed"] != backgrounds["dark"] == backgrounds["light changed"]


def test_the_page_is_printed_light_without_controls(browser, study):
    with silent_page(browser, study.path.with_suffix(".html"), color_scheme="dark") as page:
        page.emulate_media(media="print")
        settle(page)
        assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        assert not page.get_by_role("button", name="Export CSV").is_visible()
        assert page.locator(".grid .body .row").count() == 40
        assert page.pdf().startswith(b"%PDF")
        # Paper has another width and the page is not redrawn for it: the boxes are measured before a redraw.
        boxes = page.evaluate(
            """() => {
                const panels = ["scatter", "parallel"].map(name => document.getElementById(name));
                for (const panel of panels) panel.style.width = "500px";
                const box = node => (({left, width, height}) => [left, width, height])(node.getBoundingClientRect());
                return panels.map(panel => ["canvas", "svg"].map(tag => box(panel.querySelector(`.plot > ${tag}`))));
            }"""
        )
    for canvas, axes in boxes:
        assert canvas == pytest.approx(axes, abs=1.0)
        assert 400 < canvas[1] < 500


def test_the_counts_of_each_status_have_bars(unchanged_page, frame):
    rows = unchanged_page.locator("#study-facts table").first.locator("tr")
    assert rows.count() == frame["status"].nunique()
    for row in rows.all():
        bar, label = row.locator(".share i").bounding_box(), row.locator("th").bounding_box()
        assert bar["width"] >= 3.0
        assert 0.0 < bar["y"] - label["y"] < 15.0  # within the first line of the label


@pytest.mark.parametrize(("count", "megabytes", "seconds"), [(10_000, 3.0, 2.0), (100_000, 10.0, 5.0)])
def test_size_and_time_until_ready(browser, tmp_path, count, megabytes, seconds):
    """With all 29 default columns; where sorting takes longer than it should, the page may as well."""
    results = sweep_text(tmp_path, sobol(count), "sobol")
    path = report_of(results.path)
    assert path.stat().st_size <= megabytes * 1e6
    times = []
    # The best of three, because other processes use the machine too.
    while len(times) < 3 and (not times or min(times) > seconds):
        with silent_page(browser, path) as page:
            assert shown_count(page) == count
            times.append(wait_ready(page) / slowness(page))
    assert min(times) <= seconds


def test_a_page_of_more_designs_than_it_holds(browser, tmp_path):
    results = sweep_text(tmp_path, sobol(180_000), "sobol")
    front, frame = explore.rank(results), results.to_pandas()
    feasible = int(frame["feasible"].sum())
    with silent_page(browser, report_of(results.path)) as page:
        text = page.locator("#notices").inner_text()
        n_held = 40_000 + 10_000 + len(front)
        assert f"This page holds {n_held:,} of 180,000 designs: all {len(front):,} Pareto-optimal ones;" in text
        assert f"a uniform sample of 40,000 of {feasible - len(front):,} other feasible ones;" in text
        assert f"10,000 of {180_000 - feasible:,} infeasible ones" in text
        assert shown_count(page) == n_held
        designs = np.array(page.evaluate("Array.from(exploreReport.page.model.designs)"), dtype=int)
        kinds = np.array(page.evaluate("Array.from(exploreReport.page.model.kinds)"))
        assert sorted(designs[kinds == 2]) == sorted(front.index)
        assert (frame.loc[designs, "feasible"].to_numpy() == (kinds > 0)).all()
        check_density(page, frame[frame["feasible"]])


def check_density(page, feasible):
    """Compare the density of a pair of columns with numpy's histogram."""
    density = page.evaluate("exploreReport.page.model.study.density")
    x, y, counts = next(pair for pair in density["pairs"] if {*pair[:2]} == {"cv", "swing_angle"})
    cells, ranges = density["cells"], [density["columns"][name] for name in (x, y)]
    expected, *_ = np.histogram2d(feasible[x], feasible[y], cells, ranges)
    counts = np.array(counts).reshape(cells, cells).T
    assert counts.sum() == expected.sum()
    # Rounding may put a value on an edge into either cell.
    assert np.abs(counts - expected).sum() <= 4


def test_results_of_the_front_only_say_so(browser, tmp_path):
    (tmp_path / "front.toml").write_text(sobol(2000))
    study = explore.load_study(tmp_path / "front.toml")
    results = explore.sweep(study, tmp_path / "front.h5", keep="front")
    with silent_page(browser, report_of(results.path)) as page:
        text = page.locator("#notices").inner_text()
        assert f"Only the Pareto set was kept of this study: {results.n_designs} designs of 2,000." in text
        assert shown_count(page) == results.n_designs


def test_an_unfinished_sweep_says_so(browser, tmp_path):
    from store_files import fill

    path = fill(tmp_path / "part.h5", range(4))
    with silent_page(browser, report_of(path)) as page:
        text = page.locator("#notices").inner_text()
        assert "This sweep is not finished: 4,000 of 9,500 designs are computed." in text
        assert shown_count(page) == 4000


HOSTILE_TEXT = "</script><img src=x onerror=window.hurt=1><script>window.hurt=1</script>"
#: Names of columns have no slash.
HOSTILE_NAME = "<img src=x onerror=window.hurt=1>"


def test_hostile_names_are_inert(browser, tmp_path):
    path = tmp_path / "<img src=x onerror=alert(1)>\"'&amp;{{script}}.h5"
    columns = tuple(
        Column(
            f"{c.name}{HOSTILE_NAME}",
            HOSTILE_TEXT,
            HOSTILE_TEXT,
            c.role,
            c.dtype,
            dict.fromkeys(c.labels, HOSTILE_TEXT),
        )
        if c.role == "metric"
        else c
        for c in COLUMNS
    )
    attributes = ATTRIBUTES | {
        "config": HOSTILE_TEXT,
        "mechanism": HOSTILE_TEXT,
        "sampler": HOSTILE_TEXT,
        "kernel": "$(touch hurt) `touch hurt`",
    }
    with AllDesignsWriter(path, columns, 9500, 1000, attributes) as store:
        for number in range(10):
            block = values(number)
            store.commit(number, {c.name: block[c.name.removesuffix(HOSTILE_NAME)] for c in columns[1:]})
    with silent_page(browser, report_of(path)) as page:
        assert page.evaluate("window.hurt") is None
        assert page.locator("img").count() == 0
        text = page.locator("body").inner_text()
        assert text.count(HOSTILE_TEXT) > 3
        assert path.name.removesuffix(".h5") in text
        # The page names a column that the command line cannot name, and leaves it out of the command.
        page.get_by_label("where").select_option(index=1)
        page.get_by_label("from", exact=True).fill("3")
        page.get_by_role("button", name="Add").click()
        line = page.locator(".command").inner_text()
        assert line == f"explore rank {shlex.quote(str(path))}"
        assert "the command line cannot name" in page.locator(".status").inner_text()
        assert page.evaluate("window.hurt") is None


SOLVED = """mechanism = "crank-rocker"
[parameters]
crank = {{ solve = "swing_angle", value = {swing} }}
coupler = {{ start = 400, stop = 900, num = 6 }}
rocker = [500, 541]
ground = [650, 691]
[rank]
metrics = ["time_ratio:min", "cv"]
"""


def tick_labels(page, column):
    """Tick labels of a parallel axis."""
    place = page.locator("#parallel .heading").all_text_contents().index(column)
    return page.locator("#parallel g.dimension").nth(place).locator(".tick text").all_text_contents()


def test_values_that_differ_only_by_rounding_are_not_spread_over_the_axis(browser, tmp_path):
    """Solved lengths give a swing of 20 deg up to rounding, which must not fill the height of the axis."""
    results = sweep_text(tmp_path, SOLVED.format(swing=20), "solved")
    swings = results.to_pandas(["swing_angle"])["swing_angle"].dropna().unique()
    assert len(swings) > 1
    with silent_page(browser, report_of(results.path)) as page:
        texts = tick_labels(page, "swing angle deg")
    assert len(set(texts)) == len(texts) > 2
    assert "20" in texts


def test_an_axis_without_values_has_no_ticks(browser, tmp_path):
    results = sweep_text(tmp_path, SOLVED.format(swing=175), "unreachable")
    assert results.to_pandas(["swing_angle"])["swing_angle"].isna().all()
    with silent_page(browser, report_of(results.path)) as page:
        assert tick_labels(page, "swing angle deg") == []
        assert len(tick_labels(page, "coupler mm")) > 2
        assert page.locator("#scatter .tick").count() == 0


def test_no_rectangle_has_a_negative_size_in_a_narrow_window(browser, study):
    """The browser says so on its console, which fails the test as well."""
    drawn = []
    with silent_page(browser, study.path.with_suffix(".html"), viewport={"width": 60, "height": 800}) as page:
        for width in (60, 120, 200):
            page.set_viewport_size({"width": width, "height": 800})
            settle(page)
            sizes = page.evaluate(
                "Array.from(document.querySelectorAll('rect'),"
                " r => [r.getAttribute('width'), r.getAttribute('height')])"
            )
            assert [size for pair in sizes for size in pair if size is not None and float(size) < 0.0] == [], width
            drawn.append(page.evaluate("document.querySelector('#scatter svg').clientWidth"))
    assert 0 < drawn[0] < drawn[2]
