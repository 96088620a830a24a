"""Every table of the Python interface has the unit of each of its columns."""

import pandas as pd
import pytest
from studies import FEW, sweep_text

import explore

DESIGN = {"crank": 100.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}


def test_evaluate():
    frame = explore.evaluate("crank-rocker", DESIGN, metrics=["cv", "variance"], constraints={"mean": {"min": 0.5}})
    assert list(frame.attrs["units"].items()) == [
        ("crank", "mm"), ("coupler", "mm"), ("rocker", "mm"), ("ground", "mm"), ("cv", "1"),
        ("variance", "rad^2/s^2"), ("mean_margin", "rad/s"), ("nodes", "1"), ("error", "1"), ("feasible", ""),
        ("status", ""),
    ]  # fmt: skip
    assert list(frame.columns) == list(frame.attrs["units"])


def test_codes_have_words(results):
    frame = explore.evaluate("crank-rocker", {**DESIGN, "crank": [100.0, 300.0]})
    assert [frame.attrs["labels"]["status"][code] for code in frame["status"]] == ["ok", "crank_blocked"]
    for table in (results.to_pandas(), explore.rank(results), explore.rank(results.to_pandas()), explore.rank(frame)):
        assert table.attrs["labels"]["status"][3] == "crank_blocked"
        assert "cv" not in table.attrs["labels"]
    assert "labels" in results.to_pandas(["cv"]).attrs
    assert "status" not in results.to_pandas(["cv"]).attrs["labels"]


def test_simulate():
    motion = explore.simulate("crank-rocker", DESIGN, angles=3)
    assert list(motion.columns) == list(motion.attrs["units"])
    units = {"rocker_angle": "deg", "rocker_velocity": "rad/s", "rocker_acceleration": "rad/s^2"}
    assert units.items() <= motion.attrs["units"].items()


def test_coverage():
    cover = explore.coverage([37.0], rocker=595.0, ground=751.0, coupler=(460.0, 1271.5))
    for table in (cover.table, cover.curves(3)):
        assert list(table.attrs["units"]) == list(table.columns)
    assert cover.table.attrs["units"] == {
        "crank": "mm", "coupler_min": "mm", "coupler_max": "mm", "swing_min": "deg", "swing_max": "deg",
        "overlap": "deg",
    }  # fmt: skip
    assert cover.curves(3).attrs["units"] == {"crank": "mm", "coupler": "mm", "swing_angle": "deg"}


@pytest.fixture
def results(tmp_path):
    return sweep_text(tmp_path, FEW, "few")


def test_rank(results):
    whole = results.to_pandas().attrs["units"]
    for source, added in ((results, {}), (results.to_pandas(), {}), ([results], {"results": ""})):
        front = explore.rank(source, quality=True)
        quality = {"front": "1", "knee": "1", "crowding": "1", "hypervolume_share": "1"}
        assert front.attrs["units"] == whole | quality | added
        assert set(front.attrs["units"]) == set(front.columns)


def test_rank_of_a_table_without_units():
    table = pd.DataFrame({"cost": [1.0, 2.0], "gain": [1.0, 2.0]})
    assert explore.rank(table, objectives=["cost:min"]).attrs["units"] == {"front": "1"}
    assert table.attrs == {}
