"""Brushes, counts, table, CSV and the line for the command line: all say the same designs, and pandas agrees."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from browser.chromium import conditions, select, select_box, settle, shown_count


def meets(frame, found):
    """Which designs of the file meet the conditions that the page says."""
    mask = np.ones(len(frame), dtype=bool)
    for one in found:
        values = frame[one["column"]].to_numpy(float)
        mask &= (values >= float(one["low"])) & (values <= float(one["high"]))
    return frame[mask]


def designs(page):
    return page.evaluate("Array.from(exploreReport.page.rows(), row => exploreReport.page.model.designs[row])")


def brush_some(page):
    select_box(page, (0.05, 0.1), (0.7, 0.8))
    select(page, 1, 0.0, 0.6)
    select(page, 7, 0.2, 0.9)


def exported(page, tmp_path):
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Export CSV").click()
    path = tmp_path / waiting.value.suggested_filename
    waiting.value.save_as(path)
    # Python's own float reads each number exactly, whatever pandas' default is.
    read = pd.read_csv(path, dtype=str).set_index("design")
    read.index = read.index.astype(int)
    flags = read.pop("feasible").map({"True": True, "False": False}).astype(bool)
    read = read.map(float)
    read.insert(len(read.columns) - 1, "feasible", flags)
    return path, read


def test_all_columns_arrive_bit_for_bit(page, frame):
    for name in frame.columns:
        held = page.evaluate(
            "name => Array.from(exploreReport.page.model.byName.get(name).values, v => Number.isNaN(v) ? null : v)",
            name,
        )
        np.testing.assert_array_equal(np.array(held, float), frame[name].to_numpy(float), err_msg=name)
    assert page.evaluate("Array.from(exploreReport.page.model.designs)") == frame.index.tolist()


def test_kinds_are_those_of_the_ranking(page, study, frame):
    import explore

    front = explore.rank(study).index
    kinds = np.array(page.evaluate("Array.from(exploreReport.page.model.kinds)"))
    assert sorted(frame.index[kinds == 2]) == sorted(front)
    assert (kinds > 0).tolist() == frame["feasible"].tolist()


@pytest.mark.parametrize(("start", "stop"), [((0.1, 0.2), (0.5, 0.9)), ((0.3, 0.0), (1.0, 1.0))])
def test_a_box_selects_what_pandas_selects(page, frame, start, stop):
    assert shown_count(page) == len(frame)
    select_box(page, start, stop)
    found = conditions(page)
    assert [one["column"] for one in found] == ["cv", "swing_angle"]
    chosen = meets(frame, found)
    assert 0 < len(chosen) < len(frame)
    assert shown_count(page) == len(chosen)
    assert sorted(designs(page)) == chosen.index.tolist()
    assert page.locator(".grid").get_attribute("aria-rowcount") == str(len(chosen) + 1)


def test_brushes_together_select_what_meets_all(page, frame):
    counts = []
    for axis, span in [(0, (0.0, 0.5)), (4, (0.2, 1.0)), (6, (0.1, 0.8))]:
        select(page, axis, *span)
        counts.append(shown_count(page))
        assert counts[-1] == len(meets(frame, conditions(page)))
    select_box(page, (0.2, 0.2), (0.9, 0.9))
    found = conditions(page)
    assert len(found) == 5
    assert sorted(designs(page)) == meets(frame, found).index.tolist()
    assert len(frame) > counts[0] > counts[1] > counts[2] > shown_count(page) > 0
    page.get_by_role("button", name="Clear").click()
    settle(page)
    assert shown_count(page) == len(frame)
    assert page.locator("#parallel .brush .selection[width]").count() == 0


def test_only_some_kinds(page, frame):
    page.get_by_label("show").select_option("feasible")
    assert shown_count(page) == frame["feasible"].sum()
    page.get_by_label("show").select_option("Pareto-optimal")
    assert "0 infeasible" in page.locator(".total").inner_text()


def test_the_csv_is_the_selection(page, frame, tmp_path):
    brush_some(page)
    chosen = meets(frame, conditions(page))
    assert len(chosen) > 10
    path, read = exported(page, tmp_path)
    assert path.name == "small-selection.csv"
    assert read.index.tolist() == designs(page)
    assert read["feasible"].dtype == bool
    pd.testing.assert_frame_equal(read.sort_index(), chosen, check_dtype=False, check_exact=True)
    # Two programs that write the shortest digits write the same numbers.
    expected = [float(text) for text in chosen["cv"].map(repr)]
    assert read.sort_index()["cv"].tolist() == expected


def test_the_csv_of_everything_has_its_gaps(page, frame, tmp_path):
    _, read = exported(page, tmp_path)
    pd.testing.assert_frame_equal(read.sort_index(), frame, check_dtype=False, check_exact=True)
    assert read["cv"].isna().any()


def run(line, folder, *more):
    words = shlex.split(line)
    assert words[:2] == ["explore", "rank"]
    command = [sys.executable, "-m", "explore", *words[1:], *more]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True).stdout


def test_the_copied_line_selects_the_same_designs(browser, study, frame):
    from browser.chromium import silent_page

    options = {"permissions": ["clipboard-read", "clipboard-write"], "viewport": {"width": 1400, "height": 1800}}
    with silent_page(browser, study.path.with_suffix(".html"), **options) as page:
        brush_some(page)
        page.get_by_role("button", name="Copy").click()
        page.get_by_text("copied").wait_for()
        line = page.evaluate("navigator.clipboard.readText()")
        assert line == page.locator(".command").inner_text()
        chosen = meets(frame, conditions(page))
    feasible = chosen[chosen["feasible"]]
    assert len(feasible) > 10
    # With every front asked for, the ranking lists all feasible designs that meet the condition.
    ranked = json.loads(run(line, study.path.parent, "--fronts", "10000", "--json"))
    assert sorted(row["design"] for row in ranked) == feasible.index.tolist()


def test_typed_conditions_and_their_line(page, frame, study):
    page.get_by_label("where").select_option("time ratio")
    page.get_by_label("from", exact=True).fill("1.2")
    page.get_by_role("button", name="Add").click()
    page.get_by_label("where").select_option("status")
    page.get_by_label("to", exact=True).fill("1")
    page.keyboard.press("Enter")
    settle(page)
    assert shown_count(page) == ((frame["time_ratio"] >= 1.2) & (frame["status"] <= 1)).sum()
    line = page.locator(".command").inner_text()
    assert line == f'explore rank {study.path} --where "time_ratio >= 1.2 and status <= 1"'
    page.get_by_role("button", name="remove the condition on time ratio").click()
    assert shown_count(page) == (frame["status"] <= 1).sum()
    page.get_by_label("from", exact=True).fill("much")
    page.get_by_role("button", name="Add").click()
    assert page.get_by_label("from", exact=True).get_attribute("aria-invalid") == "true"
    assert shown_count(page) == (frame["status"] <= 1).sum()


def test_undefined_values_are_told(page, frame):
    page.get_by_label("x", exact=True).select_option("cv")
    page.get_by_label("y", exact=True).select_option("coupler [mm]")
    assert (
        f"{frame['cv'].isna().sum():,} designs in the left strip: cv is undefined"
        in page.locator("#scatter").inner_text()
    )
    page.get_by_label("y", exact=True).select_option("time ratio")
    both = (frame["cv"].isna() & frame["time_ratio"].isna()).sum()
    assert f"{both:,} without either value" in page.locator("#scatter").inner_text()


def test_a_logarithmic_axis(page, frame):
    page.get_by_label("log").first.check()
    select_box(page, (0.1, 0.1), (0.6, 0.9))
    found = conditions(page)
    assert shown_count(page) == len(meets(frame, found)) > 0
