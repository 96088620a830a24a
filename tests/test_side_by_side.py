"""`explore show` with several designs: their values, and the differences from the first."""

import csv
import json
import os
from unittest import mock

import numpy as np
import pytest
from command_line import call, run
from studies import swept

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = [100, 105, 150]
coupler = 1083.4236
rocker = 541.7118
ground = 691.7118
[constraints]
transmission_angle_min = { min = 15 }
"""
#: The first two designs move; the third is at a change point, where nothing is defined.
MOVING = ("0", "1")
results = swept(STUDY, "three")


def show(results, *options, **settings):
    return run("show", results.path, *options, cwd=results.path.parent, **settings)


def test_the_differences_are_those_of_the_columns(results):
    record = json.loads(show(results, "--design", 0, "--design", 1, "--json").stdout)
    frame = results.to_pandas()

    assert [design["design"] for design in record["designs"]] == [0, 1]
    alone = json.loads(show(results, "--design", 1, "--json").stdout)
    assert record["designs"][1] == alone, "a design is the same alone and beside another"
    (difference,) = record["differences"]
    assert (difference["design"], difference["from"]) == (1, 0)
    compared = [
        column.name
        for column in results.columns
        if column.role in ("parameter", "metric", "margin") and not column.labels
    ]
    assert list(difference["absolute"]) == list(difference["relative"]) == compared
    for name in compared:
        first, second = float(frame.loc[0, name]), float(frame.loc[1, name])
        if not np.isfinite(first):
            assert difference["absolute"][name] is difference["relative"][name] is None, "JSON has no NaN"
            continue
        assert difference["absolute"][name] == second - first, name
        if first == second == 0.0:  # the mean of a rate over a turn
            assert difference["relative"][name] == 0.0, name
            continue
        ratio = second / first
        # Two roundings on each road, of numbers no larger than the ratio and 1 together.
        tolerance = 4.5e-16 * (1.0 + abs(ratio))
        assert abs(difference["relative"][name] - np.sign(first) * (ratio - 1.0)) <= tolerance, name


def test_the_table_has_signs_percent_and_statuses_in_words(results):
    numbers = (option for design in (0, 1, 2) for option in ("--design", design))
    lines = show(results, *numbers).stdout.splitlines()
    cells = {line.split()[0]: line.split() for line in lines if line.strip()}

    assert cells["column"][-8:] == ["Δ", "1", "Δ%", "1", "2", "Δ", "2", "Δ%", "2"][-8:]
    assert cells["crank"] == ["crank", "mm", "100", "105", "+5", "+5", "150", "+50", "+50"]
    assert cells["coupler"] == ["coupler", "mm", "1083.42", "1083.42", "0", "0", "1083.42", "0", "0"]
    assert cells["swing_angle"][-3:] == ["–", "–", "–"], "undefined, so no difference either"
    assert cells["feasible"] == ["feasible", "yes", "yes", "no"]
    assert lines[-3].startswith("0: ok: ")
    assert lines[-1].startswith("2: change_point: ")


def test_a_narrow_terminal_leaves_differences_out_before_designs_and_units(results):
    with mock.patch.dict(os.environ, {"COLUMNS": "72", "NO_COLOR": "1"}):
        code, out, err = call("show", results.path, "--design", 0, "--design", 1)
    assert code == 0, err
    assert max(map(len, out.splitlines()[1:-4])) <= 72
    heading = next(line for line in out.splitlines() if line.startswith(" column"))
    assert heading.split() == ["column", "unit", "0", "1"]
    assert "2 columns left out: Δ 1, Δ% 1; -o FILE.csv writes all" in out


def test_a_terminal_that_narrows_leaves_out_differences_then_relative_ones_then_designs(results):
    """The unit goes last. What is less important and narrow may stay where something wide has no room."""
    order = ["Δ 2", "Δ 1", "Δ% 2", "Δ% 1", "2", "1", "unit"]
    numbers = [option for design in (0, 1, 2) for option in ("--design", design)]
    left_out = []
    for width in range(128, 26, -3):
        with mock.patch.dict(os.environ, {"COLUMNS": str(width), "NO_COLOR": "1"}):
            _, out, _ = call("show", results.path, *numbers)
        _, _, names = next((line for line in out.splitlines() if "left out: " in line), "").partition("left out: ")
        left_out.append(set(names.partition(";")[0].split(", ")) - {""})
    assert [left_out[0], left_out[-1]] == [set(), set(order)]
    assert all(set(order[:count]) in left_out for count in (2, 4, 6))


def test_a_written_table_has_all_digits(results, tmp_path):
    show(results, "--design", 0, "--design", 1, "-o", tmp_path / "two.csv")
    with (tmp_path / "two.csv").open(newline="") as file:
        rows = {row["column"]: row for row in csv.DictReader(file)}

    frame = results.to_pandas()
    assert rows["status"] == {
        "column": "status", "unit": "", "0": "ok", "1": "ok", "difference of 1": "", "relative difference of 1": "",
    }  # fmt: skip
    assert rows["crank"]["unit"] == "mm"
    for name in ("cv", "swing_angle", "transmission_angle_min_margin"):
        assert [float(rows[name][number]) for number in MOVING] == list(frame.loc[[0, 1], name])
        assert float(rows[name]["difference of 1"]) == np.diff(frame.loc[[0, 1], name])[0]


@pytest.mark.parametrize(
    ("options", "code", "sentence"),
    [
        (["--design", 1, "--design", 1], 2, "--design 1 is named twice"),
        (["--design", 1, "--design", 7], 1, "has no design 7"),
        (["-o", "all.csv"], 2, "there is no design to write"),
        (["--design", 1, "-o", "one.parquet"], 2, "must end in .csv, .json or .md"),
        (["--design", 1, "-o", "three.h5"], 2, "is the results file itself"),
    ],
)
def test_bad_requests_get_one_line(results, options, code, sentence):
    output = show(results, *options, code=code)
    assert sentence in output.stderr
    assert output.stderr.count("\n") == 1
