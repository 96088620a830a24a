"""`explore rank` as a user meets it, in the test's own process."""

import json

import pytest
from command_line import call

import explore

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = 50
coupler = { min = 50, max = 1000 }
rocker = { min = 50, max = 500 }
ground = { min = 50, max = 1000 }
[sampling]
method = "sobol"
count = 4096
[evaluate]
metrics = ["cv", "swing_angle", "time_ratio", "transmission_angle_min"]
[constraints]
transmission_angle_min = { min = 30 }
transmission_angle_max = { max = 150 }
time_ratio = { min = 1, max = 1.5 }
[rank]
metrics = ["cv", "swing_angle:max"]
"""


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A finished sweep of some thousand designs, not to be changed."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "study.toml").write_text(STUDY)
    explore.sweep(explore.load_study(folder / "study.toml"), folder / "all.h5")
    return folder


def records(*arguments):
    """What `explore rank --json` prints."""
    code, out, err = call("rank", *arguments, "--json", seconds=60)
    assert code == 0, err
    return json.loads(out)


def refused(*arguments, code=2):
    """The one line that a wrong command gets."""
    found, out, err = call("rank", *arguments, seconds=60)
    assert (found, out) == (code, ""), err
    assert err.startswith("error: ")
    assert err.count("\n") == 1, err
    return err


def test_fronts_are_counted_and_shown(swept):
    found = records(swept / "all.h5", "--fronts", 3)
    table = explore.rank(explore.read_results(swept / "all.h5"), fronts=3)

    assert [(r["design"], r["front"]) for r in found] == list(zip(table.index, table["front"], strict=True))
    assert {r["front"] for r in found} == {1, 2, 3}
    code, out, err = call("rank", swept / "all.h5", "--fronts", 2, "--top", 0)
    assert code == 0
    assert f"{(table['front'] == 2).sum()} more are in fronts 2 to 2" in err
    heading = next(line for line in out.splitlines() if "alike" in line)
    assert heading.split()[:3] == ["design", "alike", "front"]
    assert len([line for line in out.splitlines() if line.split()[:1] and line.split()[0].isdigit()]) == sum(
        table["front"] <= 2
    )
    assert "front" not in call("rank", swept / "all.h5")[1]
