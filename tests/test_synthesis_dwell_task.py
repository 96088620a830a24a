"""Task "dwell": the rows' slider rests by simulation, and mistakes are refused."""

import ezdxf
import numpy as np
import pytest
from command_line import run
from studies import synthesize_text

import explore
from explore import charts
from explore.base.errors import ConfigError, RequestError
from explore.synthesis.linkages import FourBar
from explore.synthesis.tasks.task_files import parse_task, task_starter


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """The results of the starter, one candidate."""
    folder = tmp_path_factory.mktemp("dwell")
    return synthesize_text(folder, task_starter("dwell").replace("count = 5", "count = 1"))


def test_the_slider_rests(results):
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


def test_the_slider_is_in_the_motion_and_rests_there(results, tmp_path):
    """By the places of the exported motion: on its guide, at the end of its link, at rest in the dwell."""
    import pandas as pd

    row = results.to_pandas().iloc[0]
    explore.export(results, tmp_path / "motion.csv", design=0)
    motion = pd.read_csv(tmp_path / "motion.csv")
    point, slider = (
        motion[f"{name} x [mm]"].to_numpy() + 1j * motion[f"{name} y [mm]"].to_numpy() for name in ("point M", "slider")
    )
    np.testing.assert_allclose(np.abs(point - slider), row["slider_link"], rtol=1e-12)
    along = (slider - complex(row["rest_x"], row["rest_y"])) * np.exp(-1j * np.radians(row["guide_angle"]))
    np.testing.assert_allclose(along.imag, 0, atol=1e-9)
    np.testing.assert_allclose(along.real, motion["slider_travel [mm]"], atol=1e-9)
    assert np.ptp(along.real) == pytest.approx(row["slider_stroke"], rel=1e-3)  # 360 angles of the turn
    in_dwell = (motion["crank_angle [deg]"] - row["dwell_start"]) % 360 <= row["dwell_angle"]
    assert in_dwell.sum() == pytest.approx(90, abs=1)
    assert np.ptp(along.real[in_dwell]) <= row["dwell_error"] * (1 + 1e-6)
    assert np.ptp(along.real[~in_dwell]) == pytest.approx(row["slider_stroke"], rel=1e-2)


def test_the_slider_is_drawn_with_its_dwell(results, tmp_path):
    figure = charts.dwell_chart(results)
    plane, travel = figure.axes
    assert {"path of the slider", "point M in the dwell"} <= set(plane.get_legend_handles_labels()[1])
    assert "dwell, 90°" in travel.get_legend_handles_labels()[1]
    motion = charts.motion_chart(results)
    assert motion.axes[0].get_ylabel() == "travel of the slider [mm]"
    assert "path of the slider" in charts.mechanism_chart(results).axes[0].get_legend_handles_labels()[1]
    explore.export(results, tmp_path / "a.dxf", design=0)
    drawn = ezdxf.readfile(tmp_path / "a.dxf").modelspace()
    assert any(text.dxf.text.startswith("slider at rest from ") for text in drawn.query("TEXT"))
    lengths = [(line.dxf.end - line.dxf.start).magnitude for line in drawn.query('LINE[layer=="links"]')]
    assert np.abs(np.array(lengths) - results.to_pandas()["slider_link"][0]).min() < 1e-9
    run("report", str(results.path), "-o", "page.html", cwd=tmp_path)
    assert '<img alt="Slider and its dwell of design 0"' in (tmp_path / "page.html").read_text(encoding="utf-8")


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
    text = (
        'task = "dwell"\ntarget = { dwell_angle = 180, stroke = 80 }\nsearch = { count = 1 }\n'
        "bounds = { pressure_angle_max = 20, transmission_angle_min = 60, link_ratio_max = 6 }\n"
    )
    row = synthesize_text(tmp_path, text).to_pandas().iloc[0]
    assert not row["feasible"]
    assert row["slider_stroke_margin"] < 0 or row["slider_pressure_angle_max_margin"] < 0


def test_a_slider_out_of_reach_is_refused(tmp_path):
    text = 'task = "dwell"\ntarget = { dwell_angle = 180, stroke = 1000 }\nsearch = { count = 1 }\n'
    with pytest.raises(RequestError, match=r"of 8,000 crank-rockers, even those that come nearest .* ease stroke"):
        parse_task(text, "task.toml").task.find(None)
