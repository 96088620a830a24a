"""The results browser over HTTP: its routes count what pandas counts on the loaded file."""

import os

import numpy as np
import pytest
from served import Served, build_index, serving, submit_and_wait
from studies import FEW, crank_rockers

from explore.service.results_views import open_shown

LONG_AXIS = "{ start = 900, stop = 1100, num = 500_000 }"
STUDY = """mechanism = "crank-rocker"
[parameters]
crank = { start = 80, stop = 260, num = 200 }
coupler = { start = 900, stop = 1100, num = 11 }
rocker = 541.7118
ground = { start = 600, stop = 800, num = 41 }
[constraints]
swing_angle = { min = 20 }
[units]
length = "in"
[rank]
metrics = ["cv:min"]
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("browsing") / "served", grid=STUDY) as server:
        yield server


@pytest.fixture
def indexed(client):
    """A client of results with an index."""
    build_index(client, "grid")
    return client


@pytest.fixture(scope="module")
def frame(served):
    """The file in the shown units."""
    path = served.folder / "results" / "grid.h5"
    return open_shown(path).to_pandas().reset_index()


def get(client, route, **query):
    answer = client.get(f"/api/results/grid/{route}", params=query)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_browsing_says_what_a_page_needs(indexed, frame):
    told = get(indexed, "browsing")
    assert told["index"] == {"state": "ready", "share": 1.0, "designs": len(frame)}
    columns = {column["name"]: column for column in told["columns"]}
    crank = columns["crank"]
    assert (crank["kind"], crank["unit"], crank["distinct"]) == ("parameter", "in", 200)
    assert (crank["low"], crank["high"]) == (frame["crank"].min(), frame["crank"].max())
    assert columns["cv"]["kind"] == "metric"
    assert columns["swing_angle_margin"]["kind"] == "margin"
    assert {"metric": "swing_angle", "kind": "min", "limit": 20.0, "unit": "deg"} in told["constraints"]
    assert "cv" in told["rank_metrics"]


def test_histograms_leave_out_the_conditions_on_their_own_column(indexed, frame):
    told = get(indexed, "histograms", columns="crank,cv", where=["crank < 5 in", "cv < 0.8"], bins=20)
    short, smooth = frame["crank"] < 5, frame["cv"] < 0.8
    assert (told["designs"], told["selected"]) == (len(frame), (short & smooth).sum())
    for column, others in zip(told["columns"], (smooth, short), strict=True):
        values = frame[column["name"]]
        finite = values[np.isfinite(values)]
        reach = (finite.min(), finite.max())
        assert (column["low"], column["high"]) == reach
        assert column["missing"] == len(values) - len(finite)
        assert sum(column["all"]) == len(finite)
        assert sum(column["selected"]) == (others & np.isfinite(values)).sum()
        assert column["selected"] == np.histogram(values[others], bins=20, range=reach)[0].tolist()


def test_bins_fit_the_values_unless_their_number_is_given(indexed, frame):
    told = get(indexed, "histograms", columns="crank,ground,cv", where="cv < 0.8")["columns"]
    assert [(len(column["all"]), column["values_per_bin"]) for column in told] == [(50, 4), (41, 1), (64, None)]
    smooth = frame["cv"] < 0.8
    for column, per_bin in zip(told[:2], (4, 1), strict=True):
        order = np.unique(frame[column["name"]], return_inverse=True)[1] // per_bin
        assert column["all"] == np.bincount(order).tolist()
        assert column["selected"] == np.bincount(order[smooth], minlength=len(column["all"])).tolist()
    ground = np.unique(frame["ground"])
    step = ground[1] - ground[0]
    assert (told[1]["low"], told[1]["high"]) == pytest.approx((ground[0] - step / 2, ground[-1] + step / 2), rel=1e-12)
    assert told[2]["all"] == np.histogram(frame["cv"].dropna(), bins=64)[0].tolist()
    assert get(indexed, "histograms", columns="ground", bins=64)["columns"][0]["values_per_bin"] is None


def test_bins_of_a_whole_axis_fit_its_values(indexed, frame):
    told = get(indexed, "density", x="crank", y="ground")
    assert (told["bins_x"], told["bins_y"]) == (200, 41)
    table = frame.groupby(["ground", "crank"]).size().unstack().to_numpy()
    assert np.array_equal(np.reshape(told["counts"], table.shape), table)
    told = get(indexed, "density", x="crank", y="cv", where="cv < 0.8")
    assert (told["bins_x"], told["bins_y"], told["y"]["low"]) == (200, 120, frame["cv"].min())
    smooth = frame[frame["cv"] < 0.8]
    columns = np.unique(frame["crank"], return_inverse=True)[1][frame["cv"] < 0.8]
    rows = np.histogram_bin_edges(frame["cv"].dropna(), 120)
    expected = np.histogram2d(smooth["cv"], columns, bins=(rows, np.arange(201) - 0.5))[0]
    assert np.array_equal(np.reshape(told["counts"], expected.shape), expected)
    told = get(indexed, "density", x="crank", y="cv", x_low=4)
    assert (told["bins_x"], told["bins_y"], told["x"]["low"]) == (160, 120, 4)


def test_density_counts_within_a_window(indexed, frame):
    told = get(
        indexed, "density", x="crank", y="cv", where="ground > 28", bins_x=16, bins_y=9, x_low=4, x_high=6.1, y_high=0.9
    )
    is_long = frame["ground"] > 28
    window = [(0.0 + frame["cv"].min(), 0.9), (4, 6.1)]
    assert told["selected"] == is_long.sum()
    for key, rows in (("counts", is_long), ("all", is_long | True)):
        chosen = frame[rows & np.isfinite(frame["cv"])]
        expected = np.histogram2d(chosen["cv"], chosen["crank"], bins=(9, 16), range=window)[0]
        assert np.array_equal(np.reshape(told[key], (9, 16)), expected)
    assert told["shown"] == sum(told["counts"])


def test_the_ends_of_a_column_as_they_are_told_hold_all_of_its_designs(client):
    """Whichever way their last digits are rounded: a page that compares results asks for them."""
    drawn = crank_rockers((80, 110), (900, 1100))
    drawn += '[sampling]\nmethod = "random"\ncount = 50\n[units]\nlength = "in"\n'
    submit_and_wait(client, "drawn", drawn)
    build_index(client, "drawn")
    told = client.get("/api/results/drawn/browsing").json()["columns"]
    ends = {f"{axis}_{end}": c[end] for axis, c in zip("xy", told, strict=False) for end in ("low", "high")}
    query = {"x": told[0]["name"], "y": told[1]["name"], **ends}
    assert client.get("/api/results/drawn/density", params=query).json()["shown"] == 50


def test_points_are_sent_if_they_are_few(indexed, frame):
    smooth = float(frame.loc[frame["feasible"], "cv"].quantile(0.01))
    query = {"x": "crank", "y": "cv", "where": "feasible == 1", "y_high": smooth}
    rows = frame[frame["feasible"] & (frame["cv"] <= smooth)]
    told = get(indexed, "points", **query, limit=20_000)
    assert told["count"] == len(rows) > 10
    assert told["points"] == rows[["design", "crank", "cv"]].to_numpy().tolist()
    assert get(indexed, "points", **query, limit=10) == {"count": len(rows), "points": None}


def test_a_design_comes_with_its_motion(indexed, frame):
    design = int(frame.loc[frame["feasible"], "design"].iloc[0])
    told = get(indexed, f"design/{design}/motion")
    values = {column["name"]: column["declared"][0] for column in told["columns"]}
    assert values["crank"] == pytest.approx(25.4 * frame["crank"][design], rel=1e-15)
    assert told["motion"]["drawing"]
    assert (told["designs"], told["kinds"]) == ([design], [1])
    script = indexed.get("/api/results/grid/motion.js")
    assert script.headers["content-type"] == "text/javascript; charset=utf-8"
    assert script.text.startswith("globalThis.exploreMechanism = ")


@pytest.mark.parametrize(
    ("route", "query", "reason"),
    [
        ("histograms", {"columns": "crnk"}, "did you mean 'crank'?"),
        ("histograms", {"columns": "crank", "where": "cv <"}, "where: "),
        ("density", {"x": "crank", "y": "cv", "x_low": 6, "x_high": 5}, "crank: the window begins at 6"),
    ],
)
def test_what_is_wrong_is_said(indexed, route, query, reason):
    answer = indexed.get(f"/api/results/grid/{route}", params=query)
    assert answer.status_code == 400
    assert reason in answer.json()["detail"]


def test_an_index_goes_with_its_job(client, served):
    submit_and_wait(client, "gone", FEW)
    answer = client.get("/api/results/gone/histograms", params={"columns": "crank"})
    assert answer.status_code == 409
    assert answer.json()["detail"] == "the index of gone is not ready; ask for index?build=true"
    build_index(client, "gone")
    folder = served.folder / "index" / "gone"
    assert (folder / "facts.json").exists()
    os.utime(served.folder / "results" / "gone.h5")
    assert client.get("/api/results/gone/index").json()["state"] == "none", "it is of another state of the file"
    assert client.delete("/api/jobs/gone").status_code == 204
    assert not folder.exists()
    assert client.get("/api/results/gone/index").status_code == 404


def flip(folder, kind):
    """Flip a bit in all files of a kind of an index."""
    for file in folder.glob(f"*.{kind}"):
        content = file.read_bytes()
        file.write_bytes(bytes([content[0] ^ 1]) + content[1:])


def test_a_damaged_index_is_made_anew_and_never_shown(tmp_path):
    """Found while it is read, and when it is opened; both are in the log."""
    folder, question = tmp_path / "served", {"columns": "crank,cv", "bins": 20, "where": "cv < 0.8"}
    with serving(folder, grid=FEW) as server, server.client() as client:
        build_index(client, "grid")
        flip(folder / "index" / "grid", "cells")
        answer = client.get("/api/results/grid/histograms", params=question)
        assert answer.status_code == 409
        assert answer.json()["detail"] == "the index of grid was damaged and is made anew; load the page again"
        build_index(client, "grid")
        right = get(client, "histograms", **question)
        assert right["selected"] > 0
    flip(folder / "index" / "grid", "ranges")
    with Served(folder) as server, server.client() as client:
        build_index(client, "grid")
        assert get(client, "histograms", **question) == right
        assert server.stop() == 0
    log = (folder / "log" / "grid.jsonl").read_text()
    assert log.count("index made anew") == 2


def test_results_that_are_still_swept_are_not_browsed(client):
    client.post("/api/studies", json={"name": "long", "study": FEW.replace("1083.4236", LONG_AXIS)}).raise_for_status()
    answer = client.get("/api/results/long/browsing")
    assert answer.status_code == 409
    assert "its results can be browsed when the sweep has ended" in answer.json()["detail"]
    client.post("/api/jobs/long/cancel").raise_for_status()


@pytest.mark.parametrize(
    ("route", "query"),
    [
        ("histograms", {"columns": "crank", "bins": 513}),
        ("histograms", {"columns": "crank", "where": ["cv < 1"] * 41}),
        ("histograms", {"columns": "crank", "where": "c" * 1001}),
        ("density", {"x": "crank", "y": "cv", "x_low": "nan"}),
        ("density", {"x": "crank", "y": "cv", "y_high": "1e999"}),
        ("points", {"x": "crank", "y": "cv", "limit": 20_001}),
    ],
)
def test_requests_beyond_the_limits_are_refused(indexed, route, query):
    assert indexed.get(f"/api/results/grid/{route}", params=query).status_code == 422
