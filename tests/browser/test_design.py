"""The chosen design: its animation, and the page's formulas compared with `explore.simulate`."""

import io
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from studies import LOCKED, TABLE, TARGET, sweep_text

import explore
from browser.chromium import settle, silent_page
from browser.conftest import report_of

SIGNALS = (
    "coupler_angle", "rocker_angle", "transmission_angle", "coupler_velocity", "rocker_velocity",
    "coupler_acceleration", "rocker_acceleration", "velocity_ratio",
)  # fmt: skip
DESIGNS = [
    {"crank": 100.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118, "speed": 4.2735},
    {"crank": 50.0, "coupler": 940.62, "rocker": 211.79, "ground": 869.44, "speed": 1.0},
    {"crank": 50.0, "coupler": 940.62, "rocker": 211.79, "ground": 869.44, "speed": 2.5, "branch": -1.0},
    {"crank": 150.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7128, "speed": 4.2735},
    {"crank": 150.0, "coupler": 1083.5, "rocker": 541.75, "ground": 691.75 + 2.0**-30, "speed": 1.0},
    {"crank": 30.0, "coupler": 400.0, "rocker": 401.0, "ground": 45.0, "speed": 3.0, "branch": -1.0},
    {"crank": 300.0, "coupler": 400.0, "rocker": 420.0, "ground": 100.0, "speed": 1.0},
]
ANGLES = np.concatenate([np.arange(0.0, 360.0, 7.5), [1e-7, 179.9999999, 180.0000001, 359.9999999, 725.0, -33.3]])


def page_motion(page, design, angles):
    return page.evaluate(
        """([values, angles]) => {
            const declared = exploreReport.page.model.study.motion;
            const motion = exploreReport.motionOf(declared, values, values.drive ?? "slow");
            const strokes = Object.keys(declared.strokes).concat("return");
            return motion && {
                signals: angles.map(angle => motion.at(angle)), stroke: motion.stroke, marks: motion.marks,
                strokes: Object.fromEntries(strokes.map(name => [name, exploreReport.strokeOf(motion, name)])),
            };
        }""",
        [design, list(map(float, angles))],
    )


@pytest.mark.parametrize("design", DESIGNS)
def test_the_motion_agrees_with_simulate(unchanged_page, design):
    exact = explore.simulate("crank-rocker", design, angles=ANGLES, method="closed-form")
    motion = page_motion(unchanged_page, design, ANGLES)
    for name in SIGNALS:
        values = np.array([state[name] for state in motion["signals"]])
        difference = values - exact[name].to_numpy()
        if name.endswith("angle"):
            difference = np.remainder(difference + 180.0, 360.0) - 180.0
            scale = 1.0
        else:
            scale = np.abs(exact[name]).max()
        # Both use the same formulas; sine, arctangent and the order of operations differ.
        assert np.abs(difference).max() <= 1e-9 * scale, name


@pytest.mark.parametrize("drive", ["slow", "fast", "overlapped_to_extended", "extended_to_overlapped"])
@pytest.mark.parametrize("design", DESIGNS)
def test_stroke_and_limit_positions_agree_with_the_library(unchanged_page, design, drive):
    from explore.running.motions import window_limits
    from explore.studies.request.names import find_mechanism

    columns = {name: np.array([value]) for name, value in design.items()}
    mechanism = find_mechanism("crank-rocker")
    motion = page_motion(unchanged_page, {**design, "drive": drive}, [0.0])
    stroke = window_limits(mechanism, columns, "drive", drive)
    if stroke is None:
        assert motion["stroke"] is None
        assert motion["marks"] == {}
        return
    for found, name in ((motion["stroke"], "drive"), *((ends, name) for name, ends in motion["strokes"].items())):
        start, stop = window_limits(mechanism, columns, name, drive)
        assert found[1] - found[0] == pytest.approx(stop - start, abs=1e-9)
        assert abs((found[0] - start + 180.0) % 360.0 - 180.0) <= 1e-9
    overlapped, extended = window_limits(mechanism, columns, "overlapped_to_extended", drive)
    for name, angle in (("overlapped", overlapped), ("extended", extended)):
        assert abs((motion["marks"][name] - angle + 180.0) % 360.0 - 180.0) <= 1e-9


@pytest.mark.parametrize("phases", [1, 2, 3, 5])
def test_the_output_through_clutches(unchanged_page, phases):
    """Its mean over the turn agrees with the window `clutch`, which the library integrates piece by piece."""
    design = {**DESIGNS[0], "phases": float(phases)}
    mean = unchanged_page.evaluate(
        """values => {
            const motion = exploreReport.motionOf(exploreReport.page.model.study.motion, values, "slow");
            let sum = 0;
            for (let k = 0; k < 7200; k++) sum += motion.at(k / 20).output_velocity;
            return sum / 7200;
        }""",
        design,
    )
    exact = explore.evaluate("crank-rocker", design, metrics=["output_velocity_mean"], window="clutch")
    # Equispaced samples of a function with corners have an error of about the step squared, (0.05 deg)² / 12.
    assert mean == pytest.approx(exact["output_velocity_mean"][0], rel=1e-6)


def test_a_linkage_without_a_full_turn_has_no_motion(unchanged_page):
    for lengths in [(150, 1083.4236, 541.7118, 691.7118), (200, 1083.4236, 541.7118, 691.7118), (1, 10, 2, 3)]:
        values = dict(zip(("crank", "coupler", "rocker", "ground"), lengths, strict=True))
        assert page_motion(unchanged_page, values, []) is None


@pytest.mark.parametrize("change", [{"phases": 13.0}, {"phases": 2.5}, {"branch": 0.5}, {"crank": -100.0}])
def test_a_value_that_a_parameter_cannot_take_has_no_motion(unchanged_page, change):
    """A file that was changed could otherwise make a loop as long as it likes."""
    assert page_motion(unchanged_page, DESIGNS[0], []) is not None
    assert page_motion(unchanged_page, {**DESIGNS[0], **change}, []) is None


def test_a_drive_named_like_a_part_of_every_object_is_none_of_the_strokes(unchanged_page):
    fast, odd = (
        page_motion(unchanged_page, {**DESIGNS[0], "drive": drive}, [0.0]) for drive in ("fast", "constructor")
    )
    assert odd["stroke"] == fast["stroke"] is not None


def picture(page):
    return page.evaluate("document.querySelector('canvas.picture').toDataURL()")


def test_a_click_on_a_design_animates_it(page):
    heading = page.locator("#design h2").inner_text()
    static = picture(page)
    page.wait_for_timeout(150)
    assert picture(page) == static
    box = page.locator("#scatter .plot").bounding_box()
    x, y = page.evaluate("exploreReport.page.whereIs(exploreReport.page.rows()[40])")
    page.mouse.click(box["x"] + x, box["y"] + y)
    settle(page)
    assert page.locator("#design h2").inner_text() != heading
    first = picture(page)
    page.wait_for_timeout(200)
    second = picture(page)
    assert len({static, first, second}) == 3
    page.get_by_role("button", name="Pause").click()
    paused = picture(page)
    page.wait_for_timeout(150)
    assert picture(page) == paused
    slider = page.get_by_label("crank angle in degrees")
    slider.focus()
    page.keyboard.press("ArrowRight")
    settle(page)
    assert picture(page) != paused
    slider.evaluate("(node) => { node.value = 90; node.dispatchEvent(new Event('input')); }")
    assert "crank angle 90.0°" in page.locator(".reading").inner_text()


def test_the_tooltip_of_a_design_shows_all_its_columns(page, frame):
    row = page.evaluate("exploreReport.page.rows()[40]")
    x, y = page.evaluate("row => exploreReport.page.whereIs(row)", row)
    box = page.locator("#scatter .plot").bounding_box()
    page.mouse.move(box["x"] + x, box["y"] + y)
    tip = page.locator("#tip")
    tip.wait_for()
    text = tip.inner_text()
    for name in frame.columns:
        assert name.replace("_", " ") in text
    assert "deg" in text
    assert "rad/s²" in text
    page.mouse.move(5, 5)
    tip.wait_for(state="hidden")


def test_a_design_that_cannot_turn_shows_its_status(page, frame):
    blocked = int(frame.index[frame["status"] == 3][0])
    page.evaluate(
        "design => { const {model, shared} = exploreReport.page; shared.chosen.set(model.designs.indexOf(design)); }",
        blocked,
    )
    text = page.locator("#design").inner_text()
    assert "No full turn to draw: the crank cannot turn fully: the linkage locks before a full turn." in text
    assert not page.locator("canvas.picture").is_visible()


def test_other_mechanisms_are_shown_in_numbers(browser, finished, tmp_path):
    path = tmp_path / "other.h5"
    path.write_bytes(finished.read_bytes())
    with silent_page(browser, report_of(path)) as page:
        assert "This page has no drawing of the mechanism" in page.locator("#design").inner_text()
        assert page.locator(".grid .body .row").count() > 5


RIG = """mechanism = "test-rig"
[parameters]
crank = [5, 37]
coupler = 460
rocker = 595
ground = 751
speed = 60
constant_torque = 25000
[evaluate]
metrics = ["swing_angle", "pin_force_peak", "velocity_thd"]
[rank]
metrics = ["swing_angle:max", "pin_force_peak:min"]
"""


def test_the_test_rig_is_drawn_without_strokes_and_clutches(browser, tmp_path):
    with silent_page(browser, report_of(sweep_text(tmp_path, RIG, "rig").path), reduced_motion="reduce") as page:
        static = picture(page)
        page.get_by_role("button", name="Play").click()
        page.wait_for_timeout(200)
        assert picture(page) != static
        titles = page.locator(".curve .title").all_inner_texts()
        assert titles == [
            "rocker angle [deg]", "transmission angle [deg]", "rocker velocity [rad/s]", "pin forces [kN]",
            "rocker acceleration [rad/s²]", "drive torque [N m]", "coupler force [kN]", "power [kW]",
        ]  # fmt: skip
        assert "drive stroke" not in page.locator("#design .legend").inner_text()
        ticks = page.locator("#scatter .y .tick text").all_text_contents()
        assert len(set(ticks)) == len(ticks) > 2


SLICER = """mechanism = "variable-crank"
[parameters]
rod = [300, 350]
slider_speed = 500
speed = 6
reversal_time = 0.06
[points]
knife = { along = 120, across = 40 }
tip = { along = 450, across = -60 }
[evaluate]
metrics = ["stroke"]
[rank]
metrics = ["stroke:max"]
"""


def test_groove_and_paths_of_points_differ_by_the_dashes_of_the_legend(browser, tmp_path):
    results = sweep_text(tmp_path, SLICER, "slicer")
    with silent_page(browser, report_of(results.path), reduced_motion="reduce") as page:
        drawn = page.evaluate(
            """() => {
                const dashes = new Set(), plain = CanvasRenderingContext2D.prototype.setLineDash;
                CanvasRenderingContext2D.prototype.setLineDash = function (each) {
                    if (this.canvas.className === "picture") dashes.add(each.join(" "));
                    plain.call(this, each);
                };
                document.querySelector(".player input").dispatchEvent(new Event("input"));
                return [...dashes];
            }"""
        )
        items = page.locator("#design .legend .item", has=page.locator("svg"))
        assert items.all_inner_texts() == ["groove", "path of knife", "path of tip"]
        dashes = [path.get_attribute("stroke-dasharray") for path in items.locator("path").all()]
        assert len(set(dashes)) == 3
        assert set(dashes) < set(drawn)


#: The smallest transmission angle at crank 100 is 18 deg.
STUDY = """mechanism = "crank-rocker"
[parameters]
crank = [90, 100]
coupler = 1083.4236
rocker = 541.7118
ground = 691.7118
[evaluate]
window = "{window}"
metrics = ["swing_angle", "transmission_angle_min", "rocker_velocity_max"]
[rank]
metrics = ["swing_angle:max"]
{constraints}
"""


def limit_line_rows(page, title):
    """Rows of a curve's canvas with pixels in the limits' colour: height, left end and right end, as fractions."""
    return page.evaluate(
        """title => {
            const figure = [...document.querySelectorAll(".curve")].find(f => f.textContent.startsWith(title));
            const canvas = figure.querySelector("canvas"), {width, height} = canvas;
            const {data} = canvas.getContext("2d").getImageData(0, 0, width, height);
            const rows = new Map();
            for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) {
                const i = 4 * (y * width + x);
                if (data[i + 3] > 60 && data[i] > 190 && data[i + 1] < 130 && data[i + 2] < 40)
                    rows.set(y, [Math.min(x, rows.get(y)?.[0] ?? x), Math.max(x, rows.get(y)?.[1] ?? x)]);
            }
            return [...rows].map(([y, [left, right]]) => [y / height, left / width, right / width]);
        }""",
        title,
    )


@pytest.mark.parametrize(
    ("window", "constraints", "lines"),
    [
        ("cycle", "", {}),
        ("cycle", "[constraints]\ntransmission_angle_min = { min = 25 }", {"transmission angle": (0.9, 1.0)}),
        ("drive", "[constraints]\nrocker_velocity_max = { max = 0.15 }", {"angular velocity": (0.4, 0.6)}),
    ],
)
def test_curves_show_the_limit_lines_and_strokes_of_the_study(browser, tmp_path, window, constraints, lines):
    results = sweep_text(tmp_path, STUDY.format(window=window, constraints=constraints), "turn")
    options = {"color_scheme": "light", "reduced_motion": "reduce", "device_scale_factor": 2}
    with silent_page(browser, report_of(results.path), **options) as page:
        titles = page.locator(".curve .title").all_inner_texts()
        assert len(titles) == (6 if window == "drive" else 4)
        legend = page.locator("#design .legend").inner_text()
        assert ("drive stroke" in legend) == (window == "drive")
        assert "extended" in legend
        for title in ("transmission angle", "angular velocity", "angular acceleration"):
            rows = limit_line_rows(page, title)
            assert bool(rows) == (title in lines), title
            if rows:
                # One line, as long as the part of the turn where the bound holds.
                assert max(row[0] for row in rows) - min(row[0] for row in rows) < 0.03
                length = max(row[2] for row in rows) - min(row[1] for row in rows)
                shortest, longest = lines[title]
                assert shortest - 0.2 < length < longest


def test_curves_end_where_friction_locks(browser, tmp_path):
    """No line joins what lies beside a gap, and a curve without values does not say that the output turns."""
    locked = sweep_text(tmp_path, LOCKED, "locked")
    with silent_page(browser, report_of(locked.path), viewport={"width": 1400, "height": 1800}) as page:
        coloured = page.evaluate(
            """() => {
                exploreReport.page.shared.chosen.set(0);
                const figures = [...document.querySelectorAll(".curve")];
                const canvas = figures.find(f => f.textContent.startsWith("drive torque")).querySelector("canvas");
                const { width, height } = canvas, { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
                const isColoured = (x, y) => {
                    const [r, g, b] = data.subarray(4 * (y * width + x));
                    return Math.max(r, g, b) - Math.min(r, g, b) > 60;
                };
                const rows = Array.from({ length: height }, (_, y) => y);
                const columns = Array.from({ length: width - 50 }, (_, x) => rows.some((y) => isColoured(x + 42, y)));
                return columns.filter(Boolean).length / columns.length;
            }"""
        )
        page.evaluate("exploreReport.page.shared.chosen.set(1)")
        label = page.locator(".curve", has_text="drive torque").locator("canvas").get_attribute("aria-label")
    linkage, design = explore.Linkage(locked.sections["linkage"]), {"r": 50.0, "l": 60.0, "mu": 0.9}
    torque = explore.simulate(linkage, design, angles=3600)["drive_torque"]
    assert coloured == pytest.approx(np.isfinite(torque).mean(), abs=0.05)
    assert label == "drive torque: no value at any input angle"


def saved(page, text):
    with page.expect_download() as told:
        page.click(f"#design .files button:text-is('{text}')")
    return told.value.path().read_text()


def test_the_chosen_design_of_a_table_with_a_target_is_saved(browser, tmp_path):
    results = sweep_text(tmp_path, TABLE + TARGET, "own")
    with silent_page(browser, report_of(results.path), accept_downloads=True) as page:
        design = page.evaluate("exploreReport.page.model.designs[exploreReport.page.shared.chosen.row]")
        again = sweep_text(tmp_path, saved(page, "study (TOML)"), "saved")
    assert (again.mechanism, again.target) == (results.mechanism, results.target)
    names = ["g", "r", "b", "c", "ground_angle"]
    assert again.to_pandas()[names].iloc[0].tolist() == results.to_pandas()[names].iloc[design].tolist()


def test_parameters_named_like_the_coordinates_of_a_point_are_saved(browser, tmp_path):
    """The clearance of a pin as docs/tolerance.md writes it; the page took the two for a section [points.play]."""
    text = TABLE.replace('B = "b"', 'B = ["b + play_along", "play_across"]') + "play_along = 0.5\nplay_across = 0.25\n"
    results = sweep_text(tmp_path, text, "play")
    with silent_page(browser, report_of(results.path), accept_downloads=True) as page:
        again = sweep_text(tmp_path, saved(page, "study (TOML)"), "saved")
    assert again.to_pandas()[["play_along", "play_across"]].iloc[0].tolist() == [0.5, 0.25]


def test_the_chosen_design_is_saved(page, frame, tmp_path):
    design = page.evaluate("exploreReport.page.model.designs[exploreReport.page.shared.chosen.row]")
    (tmp_path / "chosen.toml").write_text(saved(page, "study (TOML)"))
    study = explore.load_study(tmp_path / "chosen.toml")
    values = {name: column[0] for name, column in study.space.designs(0, 1).items()}
    assert study.space.n_designs == 1
    for name in ("crank", "coupler", "rocker", "ground", "speed"):
        assert values[name] == frame[name].iloc[design], name
    motion = pd.read_csv(io.StringIO(saved(page, "motion (CSV)")))
    assert motion.shape[0] == 360
    assert motion.iloc[:, 0].tolist() == list(range(360))
    lengths = {name: float(values[name]) for name in ("crank", "coupler", "rocker", "ground", "speed")}
    expected = explore.simulate("crank-rocker", lengths, angles=360)
    (heading,) = [name for name in motion if name.startswith("rocker_velocity ")]
    assert motion[heading].to_numpy() == pytest.approx(expected["rocker_velocity"].to_numpy(), rel=1e-9, abs=1e-9)
    drawing = ElementTree.fromstring(saved(page, "drawing (SVG)"))
    paths = drawing.findall("{http://www.w3.org/2000/svg}path")
    assert len(paths) > 5
    assert all("NaN" not in path.get("d") for path in paths)
