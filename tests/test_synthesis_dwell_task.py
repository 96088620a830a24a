"""Task "dwell": the rows' slider rests by simulation, and mistakes are refused."""

import numpy as np
import pytest

import explore
from explore.errors import ConfigError, RequestError
from explore.synthesis.linkages import FourBar
from explore.synthesis.tasks.task_files import parse_task, task_starter


def test_the_slider_rests(tmp_path):
    path = tmp_path / "task.toml"
    path.write_text(task_starter("dwell").replace("count = 5", "count = 1"), encoding="utf-8")
    results = explore.synthesize(path, tmp_path / "task.h5")
    assert results.objectives == ("dwell_error:min", "transmission_angle_worst:max", "footprint:min")
    assert results.senses["slider_pressure_angle_max"] == "min"
    row = explore.rank(results, objectives=["dwell_error", "slider_pressure_angle_max"]).iloc[0]
    assert row["crank"] == 20
    assert row["feasible"]
    assert row["slider_stroke"] >= 30
    assert row["slider_pressure_angle_max"] <= 50
    assert row["dwell_error"] < 2e-4 * row["slider_stroke"]
    point = complex(row["M_along"], row["M_across"]) / row["coupler"]
    linkage = FourBar(
        0j, complex(row["ground"]), row["crank"], row["coupler"], row["rocker"], point, int(row["branch"])
    )
    # The slider by its own triangle: on the guide through the rest, at the link's length from the point.
    dwell = np.radians(row["dwell_start"]) + np.linspace(0, np.pi / 2, 500)
    guide = np.exp(1j * np.radians(row["guide_angle"]))
    local = (linkage.points(dwell) - complex(row["rest_x"], row["rest_y"])) / guide
    assert np.abs(local) == pytest.approx(row["slider_link"], abs=row["dwell_error"])
    half = np.sqrt(row["slider_link"] ** 2 - local.imag**2)
    travel = min(np.ptp(local.real + half), np.ptp(local.real - half))
    assert travel == pytest.approx(row["dwell_error"], rel=1e-3)


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ("stroke = 30", "target.dwell_angle: is missing"),
        ("dwell_angle = 310\nstroke = 30", "dwell_angle: must be at least 1 and below 300 deg"),
        ("dwell_angle = 0\nstroke = 30", "dwell_angle: must be at least 1 and below 300 deg, got 0"),
        ("dwell_angle = 90\nstroke = -1", "stroke: must be above 0 mm"),
    ],
)
def test_dwells_that_are_refused(entries, message):
    with pytest.raises(ConfigError, match=message):
        parse_task(f'task = "dwell"\n[target]\n{entries}\n', "task.toml")


def test_what_comes_nearest_names_what_it_misses(tmp_path):
    path = tmp_path / "task.toml"
    path.write_text(
        'task = "dwell"\ntarget = { dwell_angle = 180, stroke = 80 }\nsearch = { count = 1 }\n'
        "bounds = { pressure_angle_max = 20, transmission_angle_min = 60, link_ratio_max = 6 }\n",
        encoding="utf-8",
    )
    row = explore.synthesize(path, tmp_path / "task.h5").to_pandas().iloc[0]
    assert not row["feasible"]
    assert row["slider_stroke_margin"] < 0 or row["slider_pressure_angle_max_margin"] < 0


def test_a_slider_out_of_reach_is_refused(tmp_path):
    text = 'task = "dwell"\ntarget = { dwell_angle = 180, stroke = 1000 }\nsearch = { count = 1 }\n'
    with pytest.raises(RequestError, match=r"of 8,000 crank-rockers, even those that come nearest .* ease stroke"):
        parse_task(text, "task.toml").task.find(None)
