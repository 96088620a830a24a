"""The page of several results files: every design, the joint Pareto set, and what is told of each file."""

import contextlib
import shlex

import numpy as np
import pandas as pd
import pytest
from command_line import call, run
from studies import sweep_text

import explore
from browser.chromium import select, settle, shown_count, silent_page

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = {{ start = {start}, stop = 140, num = 7 }}
coupler = {{ start = 900, stop = 1300, num = 5 }}
rocker = {{ start = 450, stop = 660, num = 5 }}
ground = 700
{more}
[evaluate]
drive = "{drive}"
[constraints]
transmission_angle_min = {{ min = 30 }}
[rank]
metrics = ["cv", "swing_angle:max"]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with two results, of which the second has no column of speeds and another drive stroke."""
    folder = tmp_path_factory.mktemp("files")
    sweep_text(folder, STUDY.format(start=60, more="speed = 4", drive="slow"), "first_one")
    sweep_text(folder, STUDY.format(start=97, more="", drive="fast"), "second")
    run("report", "first_one.h5", "second.h5", "-o", "both.html", cwd=folder)
    return folder


@pytest.fixture(scope="module")
def frames(folder):
    return {name: explore.read_results(folder / f"{name}.h5") for name in ("first_one", "second")}


@pytest.fixture
def page(browser, folder):
    options = {"viewport": {"width": 1400, "height": 1800}, "color_scheme": "light", "reduced_motion": "reduce"}
    with silent_page(browser, folder / "both.html", **options) as page:
        yield page


def values(page, name):
    return np.array(page.evaluate(f"[...exploreReport.page.model.byName.get('{name}').values].map(String)"), float)


def test_the_page_holds_all_designs_of_all_files(page, frames):
    origins = values(page, "results")
    designs = np.array(page.evaluate("[...exploreReport.page.model.designs]"))
    assert page.evaluate("exploreReport.page.model.byName.get('results').labels") == {"0": "first_one", "1": "second"}
    for number, frame in enumerate(frames.values()):
        own = origins == number
        assert list(designs[own]) == list(frame.index)
        for name in ("crank", "cv", "transmission_angle_min_margin", "status"):
            np.testing.assert_array_equal(values(page, name)[own], frame[name].to_numpy(float))
    assert "speed" not in frames["second"]
    assert np.isnan(values(page, "speed")[origins == 1]).all()


def test_the_joint_front_is_that_of_rank(page, folder):
    with contextlib.chdir(folder), pytest.warns(RuntimeWarning, match="the drive stroke is"):
        joint = explore.rank(["first_one.h5", "second.h5"])
    names = {"first_one.h5": 0, "second.h5": 1}
    expected = {(names[file], design) for design, file in joint["results"].items()}
    kinds = np.array(page.evaluate("[...exploreReport.page.model.kinds]"))
    designs = page.evaluate("[...exploreReport.page.model.designs]")
    origins = values(page, "results")
    assert {(int(origins[row]), int(designs[row])) for row in np.flatnonzero(kinds == 2)} == expected
    chosen = page.evaluate("exploreReport.page.shared.chosen.row")
    assert (int(origins[chosen]), designs[chosen]) == (names[joint["results"].iloc[0]], joint.index[0])
    legend = page.locator("#scatter .legend").inner_text()
    for file in names:
        own = (joint["results"] == file).sum()
        assert f"{file.removesuffix('.h5')}: " in legend
        assert f"{own:,} of them jointly" in legend


def test_the_copied_command_ranks_the_files_and_names_no_column_of_the_page(page, folder):
    select(page, 0, 0.2, 0.8)
    page.evaluate("exploreReport.page.shared.selection.set('axis:results', [{column: 'results', low: 0, high: 0}])")
    settle(page)
    line = page.locator(".command").inner_text()
    words = shlex.split(line)
    assert words[:4] == ["explore", "rank", "first_one.h5", "second.h5"]
    assert "results >" not in words[-1]
    assert "results ==" not in words[-1]
    assert "the command line cannot name results" in page.locator(".rank .status").inner_text()
    with contextlib.chdir(folder):
        code, _, err = call(*words[1:])
    assert code == 0, err


def test_files_are_told_apart_and_named(page, frames):
    page.evaluate("exploreReport.page.shared.selection.set('axis:results', [{column: 'results', low: 1, high: 1}])")
    settle(page)
    assert shown_count(page) == len(frames["second"])
    chip = page.locator(".chip").inner_text()
    assert "second" in chip
    row = page.evaluate("exploreReport.page.rows()[0]")
    page.evaluate("row => exploreReport.page.shared.chosen.set(row)", row)
    settle(page)
    assert page.locator("#design h2").inner_text().strip().endswith("of second")
    headings = page.locator("#study-facts h3.file").all_inner_texts()
    assert headings == ["first_one", "second"]
    marks = page.locator("#scatter .legend .glyph path")
    assert len({marks.nth(k).get_attribute("d") for k in range(2)}) == 2


def test_the_motion_is_that_of_the_design_in_its_file(page, frames):
    """The second file has no speeds, so its designs turn at the default speed, and its drive stroke is the fast one."""
    frame = frames["second"]
    design = frame.index[frame["feasible"]][0]
    page.evaluate(
        """design => {
            const {model, shared} = exploreReport.page, origins = model.byName.get("results").values;
            shared.chosen.set(model.designs.findIndex((number, row) => number === design && origins[row] === 1));
        }""",
        int(design),
    )
    slider = page.get_by_label("crank angle in degrees")
    lengths = frame.loc[design, ["crank", "coupler", "rocker", "ground"]].to_dict()
    exact = explore.simulate("crank-rocker", lengths, angles=[90.0])["rocker_velocity"].iloc[0]
    slider.evaluate("node => { node.value = 90; node.dispatchEvent(new Event('input')); }")
    settle(page)
    titles = page.locator(".curve .title").all_inner_texts()
    curve = page.locator(".curve").nth(titles.index("angular velocity [rad/s]"))
    rocker = next(text for text in curve.locator(".value span").all_inner_texts() if text.startswith("rocker"))
    assert float(rocker.split()[-1].replace("−", "-")) == pytest.approx(exact, rel=1e-3), "four digits"


def test_the_name_of_the_page_is_of_all_files(folder):
    run("report", "first_one.h5", "second.h5", cwd=folder)
    assert (folder / "results/first_one+second-report.html").is_file()


def test_the_csv_of_several_files_has_the_file_of_each_design(page, frames, tmp_path):
    with page.expect_download() as download:
        page.get_by_role("button", name="Export CSV").click()
    download.value.save_as(tmp_path / "selection.csv")
    table = pd.read_csv(tmp_path / "selection.csv")
    assert table["results_label"].value_counts().to_dict() == {name: len(frame) for name, frame in frames.items()}
