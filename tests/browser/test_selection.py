"""Brushes, counts, table, CSV and the copied command select the same designs as pandas."""

import json
import shlex

import numpy as np
import pandas as pd
import pytest
from command_line import run

from browser.chromium import conditions, select, select_box, settle, shown_count
from explore.mechanisms.registry import MECHANISMS


def matching(frame, brushes):
    """Rows of the designs that meet all conditions of the page."""
    mask = np.ones(len(frame), dtype=bool)
    for brush in brushes:
        values = frame[brush["column"]].to_numpy(float)
        mask &= (values >= float(brush["low"])) & (values <= float(brush["high"]))
    return frame[mask]


def listed_designs(page):
    return page.evaluate("Array.from(exploreReport.page.rows(), row => exploreReport.page.model.designs[row])")


def brush_three(page):
    select_box(page, (0.05, 0.1), (0.7, 0.8))
    select(page, 1, 0.0, 0.6)
    select(page, 7, 0.2, 1.0)


def export_csv(page, tmp_path):
    with page.expect_download() as download:
        page.get_by_role("button", name="Export CSV").click()
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    # float() rounds each number correctly; pandas' default parser may not.
    table = pd.read_csv(path, dtype=str).set_index("design")
    table.index = table.index.astype(int)
    flags = table.pop("feasible").map({"True": True, "False": False}).astype(bool)
    labels = {name: table.pop(name) for name in list(table.columns) if name.endswith("_label")}
    status_labels = MECHANISMS["crank-rocker"].status_labels
    assert labels["status_label"].tolist() == [status_labels[int(code)] for code in table["status"]]
    table = table.map(float)
    table.insert(len(table.columns) - 1, "feasible", flags)
    return path, table


def test_the_page_holds_all_columns_exactly(unchanged_page, frame):
    for name in frame.columns:
        column = unchanged_page.evaluate(
            "name => Array.from(exploreReport.page.model.byName.get(name).values, v => Number.isNaN(v) ? null : v)",
            name,
        )
        np.testing.assert_array_equal(np.array(column, float), frame[name].to_numpy(float), err_msg=name)
    assert unchanged_page.evaluate("Array.from(exploreReport.page.model.designs)") == frame.index.tolist()


def test_the_kinds_of_designs_agree_with_the_ranking(unchanged_page, study, frame):
    import explore

    front = explore.rank(study).index
    kinds = np.array(unchanged_page.evaluate("Array.from(exploreReport.page.model.kinds)"))
    assert sorted(frame.index[kinds == 2]) == sorted(front)
    assert (kinds > 0).tolist() == frame["feasible"].tolist()


@pytest.mark.parametrize(("start", "stop"), [((0.1, 0.2), (0.5, 0.9)), ((0.3, 0.0), (1.0, 1.0))])
def test_a_box_selects_what_pandas_selects(page, frame, start, stop):
    assert shown_count(page) == len(frame)
    select_box(page, start, stop)
    brushes = conditions(page)
    assert [brush["column"] for brush in brushes] == ["cv", "swing_angle"]
    selection = matching(frame, brushes)
    assert 0 < len(selection) < len(frame)
    assert shown_count(page) == len(selection)
    assert sorted(listed_designs(page)) == selection.index.tolist()
    assert page.locator(".grid").get_attribute("aria-rowcount") == str(len(selection) + 1)


def test_several_brushes_select_designs_that_meet_all(page, frame):
    counts = []
    for axis, span in [(0, (0.0, 0.5)), (4, (0.2, 1.0)), (6, (0.1, 0.8))]:
        select(page, axis, *span)
        counts.append(shown_count(page))
        assert counts[-1] == len(matching(frame, conditions(page)))
    select_box(page, (0.2, 0.2), (0.9, 0.9))
    brushes = conditions(page)
    assert len(brushes) == 5
    assert sorted(listed_designs(page)) == matching(frame, brushes).index.tolist()
    assert len(frame) > counts[0] > counts[1] > counts[2] > shown_count(page) > 0
    page.get_by_role("button", name="Clear").click()
    settle(page)
    assert shown_count(page) == len(frame)
    assert page.locator("#parallel .brush .selection[width]").count() == 0


def test_the_page_shows_only_the_chosen_kinds(page, frame):
    page.get_by_label("show", exact=True).select_option("feasible")
    assert shown_count(page) == frame["feasible"].sum()
    page.get_by_label("show", exact=True).select_option("Pareto-optimal")
    assert "0 infeasible" in page.locator(".total").inner_text()


def test_the_csv_contains_the_selection(page, frame, tmp_path):
    brush_three(page)
    selection = matching(frame, conditions(page))
    assert len(selection) > 10
    path, table = export_csv(page, tmp_path)
    assert path.name == "small-selection.csv"
    assert table.index.tolist() == listed_designs(page)
    assert table["feasible"].dtype == bool
    pd.testing.assert_frame_equal(table.sort_index(), selection, check_dtype=False, check_exact=True)
    # Both programs write the shortest digits that identify a double.
    expected = [float(text) for text in selection["cv"].map(repr)]
    assert table.sort_index()["cv"].tolist() == expected


def test_the_csv_of_all_designs_keeps_undefined_values(unchanged_page, frame, tmp_path):
    _, table = export_csv(unchanged_page, tmp_path)
    pd.testing.assert_frame_equal(table.sort_index(), frame, check_dtype=False, check_exact=True)
    assert table["cv"].isna().any()


def run_command(line, folder, *options):
    words = shlex.split(line)
    assert words[:2] == ["explore", "rank"]
    return run(*words[1:], *options, cwd=folder).stdout


def test_the_copied_command_selects_the_same_designs(browser, study, frame):
    from browser.chromium import silent_page

    options = {"permissions": ["clipboard-read", "clipboard-write"], "viewport": {"width": 1400, "height": 1800}}
    with silent_page(browser, study.path.with_suffix(".html"), **options) as page:
        brush_three(page)
        page.get_by_role("button", name="Copy").click()
        page.get_by_text("copied").wait_for()
        line = page.evaluate("navigator.clipboard.readText()")
        assert line == page.locator(".command").inner_text()
        selection = matching(frame, conditions(page))
    feasible = selection[selection["feasible"]]
    assert len(feasible) > 10
    # With all fronts the ranking lists every feasible design that meets the condition.
    ranking = json.loads(run_command(line, study.path.parent, "--fronts", "10000", "--json"))
    assert sorted(row["design"] for row in ranking) == feasible.index.tolist()


def test_typed_conditions_are_in_the_command(page, frame, study):
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


def test_a_wrong_bound_shows_the_reason(page, frame):
    low, high = (page.get_by_label(name, exact=True) for name in ("from", "to"))
    add, reason = page.get_by_role("button", name="Add"), page.locator("#selection").get_by_role("alert")
    page.get_by_label("where").select_option("time ratio")
    for texts, message, invalid in [
        (("much", "2"), "“much” is not a number; write it like 12.5 or 1e-3", (True, False)),
        (("1", "1,5"), "“1,5” is not a number; write it like 12.5 or 1e-3", (False, True)),
        (("3", "2"), "from 3 is above to 2", (True, True)),
    ]:
        low.fill(texts[0])
        high.fill(texts[1])
        add.click()
        assert reason.inner_text() == message
        for field, flag in ((low, invalid[0]), (high, invalid[1])):
            assert field.get_attribute("aria-invalid") == str(flag).lower()
            assert field.get_attribute("aria-describedby") == reason.get_attribute("id")
        assert shown_count(page) == len(frame)
    # The reason disappears while the number is corrected.
    low.fill("1.2")
    assert reason.inner_text() == ""
    assert low.get_attribute("aria-invalid") == "false"
    add.click()
    settle(page)
    assert shown_count(page) == frame["time_ratio"].between(1.2, 2.0).sum()


def test_the_caption_counts_undefined_values(page, frame):
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
    brushes = conditions(page)
    assert shown_count(page) == len(matching(frame, brushes)) > 0
