"""The page in chosen units: its columns, its motion, its files and its command agree with the command line."""

import json

import numpy as np
import pytest
from command_line import succeed
from studies import sweep_text

import explore
from browser.chromium import silent_page
from browser.conftest import STUDY, report_of
from explore.base.units.shown import read_shown_units

CHOICES = ["--units", "length=in", "--units", "speed=rpm", "--units", "angle=rad"]
UNITS = read_shown_units({"length": "in", "speed": "rpm", "angle": "rad"})


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Designs with their page in inches, rpm and radians beside the file."""
    results = sweep_text(tmp_path_factory.mktemp("units"), STUDY, "inches")
    page = results.path.with_suffix(".html")
    succeed("report", results.path, *CHOICES, "-o", page, seconds=240)
    return results


def test_the_page_agrees_with_the_command_line(browser, results):
    shown = results.in_units(UNITS).to_pandas()
    with silent_page(browser, results.path.with_suffix(".html"), viewport={"width": 1400, "height": 1800}) as page:
        columns = page.evaluate(
            "exploreReport.page.model.columns.map(({name, unit, heading, values, declared}) =>"
            " [name, unit, heading, Array.from(values), Array.from(declared)])"
        )
        panels = page.evaluate("exploreReport.page.model.study.motion.panels")
        command = page.evaluate("exploreReport.page.model.study.command")
        missed = page.evaluate("exploreReport.page.model.study.missed")
        titles = page.locator(".curve .title").all_text_contents()
        reading = page.locator(".curve .value").nth(1).text_content()
        chosen = page.evaluate("exploreReport.page.model.study.chosen")
    declared = results.to_pandas()
    for name, _, heading, values, stored in columns:
        np.testing.assert_array_equal(np.array(stored, float), declared[name].to_numpy(float), err_msg=name)
        np.testing.assert_array_equal(np.array(values, float), shown[name].to_numpy(float), err_msg=name)
        unit, own = shown.attrs["units"][name], declared.attrs["units"][name]
        assert heading == (name if unit == own else f"{name} [{unit}]")
    assert {name: unit for name, unit, *_ in columns}["crank"] == "in"
    assert command.split()[-6:] == CHOICES
    assert titles[0] == "angle [rad]"
    factors = {panel["unit"]: (panel["factor"], panel["turn"]) for panel in panels}
    assert factors["rpm"] == (pytest.approx(30.0 / np.pi, rel=1e-15), 0.0)
    assert factors["rad"] == (pytest.approx(np.pi / 180.0, rel=1e-15), pytest.approx(2.0 * np.pi, rel=1e-15))
    low = {metric: low for metric, low, *_ in missed}["transmission_angle_min"]
    assert low == pytest.approx(np.pi / 6.0, rel=1e-15)
    # The cursor stands at the beginning of the drive stroke; the reading has four digits.
    row = declared.iloc[chosen]
    design = {name: float(row[name]) for name in ("crank", "coupler", "rocker", "ground", "speed")}
    motion = explore.simulate("crank-rocker", design, angles=7200)["transmission_angle"]
    assert np.abs(np.deg2rad(motion) - float(reading)).min() < 1e-3
    where = "4 <= crank <= 5 and 60 <= speed"
    out, _ = succeed("rank", results.path, *CHOICES, "--where", where, "--json", seconds=240)
    ranked = {record["design"] for record in json.loads(out)}
    assert ranked <= set(declared.index[(declared["crank"] >= 101.6) & (declared["crank"] <= 127.0)])
    assert ranked


#: Lengths and speeds whose conversion to declared units and back is off by rounding.
WRITTEN = """mechanism = "crank-rocker"
[parameters]
crank = ["0.7 in", "1.4 in", "2.1 in"]
coupler = { start = "36 in", stop = "40 in", num = 9 }
rocker = "20 in"
ground = "30 in"
speed = ["40 rpm", "60 rpm", "110 rpm"]
[units]
length = "in"
speed = "rpm"
"""


def test_values_are_shown_as_they_were_written(browser, tmp_path):
    """A condition selects the same designs as on the command line."""
    results = sweep_text(tmp_path, WRITTEN, "written")
    shown = results.in_units(read_shown_units({"length": "in", "speed": "rpm"})).to_pandas()
    conditions = '[{column: "crank", low: 0, high: 0.7}, {column: "speed", low: 60, high: Infinity}]'
    with silent_page(browser, report_of(results.path)) as page:
        values = page.evaluate("exploreReport.page.model.columns.map(({name, values}) => [name, Array.from(values)])")
        selected = page.evaluate(
            f"(() => {{const {{selection}} = exploreReport.page.shared; selection.set('x', {conditions});"
            " return selection.total;})()"
        )
    for name, column in values:
        np.testing.assert_array_equal(np.array(column, float), shown[name].to_numpy(float), err_msg=name)
    assert selected == ((shown["crank"] <= 0.7) & (shown["speed"] >= 60)).sum() == 18
