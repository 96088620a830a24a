"""`explore report` without a browser: the page's file, the bundled script and its licences, and errors."""

import hashlib
import json
import re
import shlex
from pathlib import Path

import h5py
import numpy as np
import pytest
from command_line import assert_refused, call, succeed
from stopping import interrupt
from store_files import fill
from studies import FEW, TABLE, TARGET, sweep_text

import explore
from explore.figures.reporting import contents, rows
from explore.figures.reporting.packing import ColumnPacker

ROOT = Path(__file__).parent.parent
PAGE = Path(explore.__file__).parent / "figures/reporting/page"
SOBOL = """mechanism = "crank-rocker"
[parameters]
crank = { min = 50, max = 140 }
coupler = 1083.4236
rocker = { min = 500, max = 600 }
ground = 691.7118
[sampling]
method = "sobol"
count = 500
"""
BUNDLED = ("report.js", "THIRD_PARTY.txt", "sources.sha256")


def test_the_bundle_is_built_from_the_sources():
    """On failure run explore/figures/reporting/page/build.sh, which bundles the changed script."""
    recorded_hashes = dict(
        reversed(line.split(maxsplit=1)) for line in (PAGE / "bundle/sources.sha256").read_text().splitlines()
    )
    browser = "../../../service/page/src"
    files = ["build.sh", "package.json", "package-lock.json", "page.css"]
    files += [f"{folder}/{path.name}" for folder in ("src", browser) for path in (PAGE / folder).glob("*")]
    assert recorded_hashes == {name: hashlib.sha256((PAGE / name).read_bytes()).hexdigest() for name in files}


def test_versions_are_pinned_and_licences_shipped():
    package = json.loads((PAGE / "package.json").read_text())
    for version in (*package["dependencies"].values(), *package["devDependencies"].values()):
        assert re.fullmatch(r"\d+\.\d+\.\d+", version)
    text = (PAGE / "bundle/THIRD_PARTY.txt").read_text()
    locked = json.loads((PAGE / "package-lock.json").read_text())["packages"]
    for name in package["dependencies"]:
        assert f"{name} {locked[f'node_modules/{name}']['version']}\n" in text
    shipped = set(re.findall(r"^([a-z0-9-]+) \d+\.\d+\.\d+$", text, re.MULTILINE))
    assert shipped <= {name.removeprefix("node_modules/") for name in locked}
    # All are under the ISC licence except d3-ease, which contains Penner's easing equations.
    assert text.count("Permission to use, copy, modify") == len(shipped) - 1
    assert "Copyright 2001 Robert Penner" in text
    assert text.count("Redistributions in binary form must reproduce the above copyright notice") == 1


def test_the_bundle_can_be_embedded_in_html():
    script = (PAGE / "bundle/report.js").read_text(encoding="ascii")
    assert "</script" not in script.lower()
    assert "<!--" not in script
    assert all(len(path.read_text().splitlines()) < 300 for path in PAGE.glob("src/*.js"))


def test_the_same_results_give_the_same_page(in_results):
    code, out, err = call("report")
    assert (code, out) == (0, "results/small-report.html\n")
    assert re.fullmatch(r"0\.\d MB; open it in a browser, no server or network is needed\n", err)
    first = (in_results / out.strip()).read_bytes()
    assert call("report", "results/small.h5", "-o", "other.html")[:2] == (0, "other.html\n")
    assert (in_results / "other.html").read_bytes() == first


def test_the_page_makes_no_network_requests(in_results):
    call("report")
    page = (in_results / "results/small-report.html").read_text(encoding="utf-8")
    assert re.findall(r"<(?:link|img|iframe|object|embed|base)\b", page) == []
    assert re.findall(r"""\b(?:src|href|action|srcset)=["'](?!#)""", page) == []
    assert "default-src 'none'" in page
    # The policy allows the mechanism's functions, one script and one style, by their hashes.
    assert page.count("'sha256-") == 3
    assert "unsafe" not in page


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "front.pdf"], "-o front.pdf: the name must end in .html"),
        (["-o", "folder.html"], "-o folder.html: it is a folder; name another file"),
        (["other.h5"], "other.h5"),
        (["study.toml"], "study.toml"),
        (["damaged.h5"], "damaged.h5 is damaged and cannot be read: attribute determines"),
        (["empty.h5"], "empty.h5 holds no designs yet, so there is nothing to report"),
    ],
)
def test_bad_input_gives_an_error_of_one_line(in_results, arguments, message):
    (in_results / "folder.html").mkdir()
    (in_results / "study.toml").write_text(FEW)
    (in_results / "damaged.h5").write_bytes((in_results / "results/small.h5").read_bytes())
    with h5py.File(in_results / "damaged.h5", "r+") as file:
        length = file.attrs["determines"].dtype.itemsize
        file.attrs["determines"] = np.bytes_(b'{"evaluate": [1]}'.ljust(length))
    fill(in_results / "empty.h5", [])
    before = sorted(in_results.rglob("*"))
    assert_refused(call("report", *arguments), (1, 2), f"error: {message}")
    assert sorted(in_results.rglob("*")) == before


def test_an_interrupted_report_keeps_the_previous_page(in_results, monkeypatch):
    call("report", "-o", "page.html")
    before = (in_results / "page.html").read_bytes()

    monkeypatch.setattr("explore.figures.reporting.pages.data_elements", interrupt)
    assert call("report", "-o", "page.html")[0] == 130
    assert (in_results / "page.html").read_bytes() == before
    assert sorted(path.name for path in in_results.iterdir()) == ["page.html", "results"]


@pytest.mark.parametrize(
    "name", ["bad\udcff", "new\nline", "-dash", "$HOME `id`", "esc\x1b[31m", "</title>", "{{data}}"]
)
def test_any_file_name_is_accepted(in_results, name):
    path = in_results / f"{name.replace('/', '')}.h5"
    path.write_bytes((in_results / "results/small.h5").read_bytes())
    out, _ = succeed("report", "--", path.name)
    assert "\x1b" not in out
    page = (in_results / f"results/{path.stem}-report.html").read_text(encoding="utf-8")
    assert page.count("<title>") == page.count("</title>") == 1
    study = json.loads(re.search(r'id="study">(.*?)</script>', page)[1])
    assert study["name"] == path.stem
    # A shell reads the file's name in the command as one word, and not as an option.
    words = shlex.split(study["command"])
    assert words[:2] == ["explore", "rank"]
    assert len(words) == 3
    assert not words[2].startswith("-")
    assert Path(words[2]).samefile(path)


@pytest.mark.parametrize("end", ["", TARGET])
def test_the_head_of_a_saved_study_says_which_linkage_and_which_target_it_is_of(tmp_path, end):
    results = sweep_text(tmp_path, TABLE + end, "own")
    succeed("report", results.path, "-o", tmp_path / "own.html")
    study = json.loads(re.search(r'id="study">(.*?)</script>', (tmp_path / "own.html").read_text())[1])
    values = "g = 100\nr = 20\nb = 90\nc = 80\n" + "ground_angle = 10\n" * bool(end)
    saved = sweep_text(tmp_path, f"{study['head']}\n[parameters]\n{values}", "saved")
    assert (saved.mechanism, saved.target) == (results.mechanism, results.target)


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ([1.5, np.nan, -0.0, np.inf], "f8"),
        ([True, False], "u1"),
        ([-1, 5], "i1"),
        ([-128, 127], "i1"),
        ([0, 255], "u1"),
        ([0, 256], "i4"),
        ([-(2**31), 2**31 - 1], "i4"),
        ([0, 70_000], "i4"),
        ([0, 2**40], "f8"),
    ],
)
def test_a_column_has_the_smallest_type_that_holds_its_values(values, kind):
    assert ColumnPacker().add(np.array(values))["type"] == kind


def test_infinite_values_are_kept():
    packer = ColumnPacker()
    assert "defined" not in packer.add(np.array([np.inf, 1.0, -np.inf]))
    assert "defined" in packer.add(np.array([np.inf, np.nan]))


def test_equal_columns_are_stored_once():
    packer = ColumnPacker()
    column = np.array([1.0, np.nan, 3.0])
    first, second = packer.add(column), packer.add(column.copy())
    other = packer.add(np.array([2.0, np.nan, 4.0]))
    assert first == second
    assert other["defined"] == first["defined"]
    assert len(packer.texts) == 3


def test_densities_count_all_feasible_designs_of_the_file(tmp_path, monkeypatch):
    """Designs that the page leaves out count too; here it holds ten feasible ones besides the Pareto set."""
    results = sweep_text(tmp_path, SOBOL, "sobol")
    monkeypatch.setattr(rows, "MAX_DESIGNS", 10)
    monkeypatch.setattr(rows, "MAX_FEASIBLE", 10)
    monkeypatch.setattr(contents.ColumnPacker, "add", lambda self, values: values)
    study = contents.collect_contents(results, None, "", lambda _: None).study
    density = study["density"]
    assert np.count_nonzero(study["kinds"] == rows.FEASIBLE) == 10
    table = results.to_pandas().query("feasible")

    assert len(density["pairs"]) >= 3
    for x, y, counts in density["pairs"]:
        ranges = [density["columns"][y], density["columns"][x]]
        expected, _, _ = np.histogram2d(table[y], table[x], density["cells"], ranges)
        assert 10 < expected.sum() < len(table)
        np.testing.assert_array_equal(counts.reshape(expected.shape), expected, err_msg=f"{x} {y}")


def test_a_sample_of_the_designs_has_those_nearest_to_feasible(tmp_path, monkeypatch):
    """Of 500 infeasible designs the page holds one by chance, and shows the nearest of ten first."""
    results = sweep_text(tmp_path, SOBOL + "[constraints]\ntime_ratio = { max = 0.9 }\n", "none")
    monkeypatch.setattr(rows, "MAX_DESIGNS", 10)
    monkeypatch.setattr(rows, "MAX_INFEASIBLE", 1)
    monkeypatch.setattr(contents.ColumnPacker, "add", lambda self, values: values)
    study = contents.collect_contents(results, None, "", lambda _: None).study
    nearest = explore.nearest(results, 10).index

    assert len(study["designs"]) == len(study["kinds"]) <= 11
    assert set(nearest) <= set(study["designs"])
    assert study["designs"][study["chosen"]] == nearest[0]
