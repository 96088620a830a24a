"""Linkages whose crank does not turn fully: those with a range, and designs that move over an interval of a study."""

import csv
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from command_line import run
from linkage_cases import FOUR_BAR

import explore
from explore.base.errors import ConfigError, MotionError, RequestError
from explore.figures.charts.mechanism import mechanism_chart
from explore.figures.charts.motion import motion_chart
from explore.studies.linkages.content import content_of
from explore.studies.request.requests import make_request

#: Lengths of a four-bar but for its crank; with one of 55 mm and more it is blocked beyond some angles.
LENGTHS = {"r2": 80.0, "r3": 50.0, "r4": 100.0}
LIMITED = FOUR_BAR | {"range": [-50, 50]}
STUDY = """\
mechanism = "linkage"

[linkage]
driver = "crank"
output = "rocker"
range = [-50, 50]
[linkage.frame]
O = [0, 0]
C = ["r4", 0]
[linkage.links]
crank = { O = 0, A = "r1" }
coupler = { A = 0, B = "r2", P = "0.5 * r2" }
rocker = { C = 0, B = "r3" }
[linkage.branch]
B = "left of A C"

[parameters]
r1 = [60, 72]
r2 = 80
r3 = 50
r4 = 100
speed = "60 rpm"

[evaluate]
metrics = ["rocker_velocity_peak", "swing_angle"]

[constraints]
rocker_velocity_max = { max = 5 }

[rank]
metrics = ["rocker_velocity_peak"]
"""
STATISTICS = ("mean", "variance", "min", "max", "rms")


def metrics(window):
    signals = ("rocker_angle", "rocker_velocity", "B_velocity_x")
    return [f"{signal}_{statistic}{window}" for signal in signals for statistic in STATISTICS]


def test_a_range_is_the_interval_of_the_linkage_that_turns():
    """To the last bit, also for a crank that is blocked beyond the range."""
    design = LENGTHS | {"r1": [30.0, 40.0, 55.0, 60.0]}
    limited = explore.evaluate(explore.Linkage(LIMITED), design, metrics=metrics("_range"))
    turning = explore.evaluate(explore.Linkage(FOUR_BAR), design, metrics=metrics(""), window={"from": -50, "to": 50})
    for name in metrics(""):
        np.testing.assert_array_equal(limited[f"{name}_range"], turning[name])
    assert limited.attrs["labels"]["status"][1] == "ok"
    assert (limited["status"] == 1).all()


def test_what_is_over_an_interval_of_a_range_is_not_said_to_be_over_the_range():
    mechanism, window = explore.Linkage(LIMITED).mechanism, {"from": 0, "to": 20}
    request = make_request(mechanism, metrics=["transmission_angle_min_interval"], window=window)
    assert request.metrics[0].long_name.startswith("smallest transmission angle of all joints, or its supplement")


def test_a_part_of_a_range_is_an_interval_at_any_turn():
    linkage, design = explore.Linkage(LIMITED), LENGTHS | {"r1": [40.0, 72.0]}
    here, there = (
        explore.evaluate(linkage, design, metrics=metrics(""), window={"from": start, "to": start + 30})
        for start in (-40, 320)
    )
    np.testing.assert_array_equal(here.to_numpy(), there.to_numpy())
    motion = explore.simulate(linkage, LENGTHS | {"r1": 40.0}, angles=np.linspace(-40, -10, 3001))["rocker_angle"]
    assert here["rocker_angle_max"][0] == pytest.approx(motion.max(), rel=1e-12)
    row = explore.evaluate(
        linkage, LENGTHS | {"r1": 72.0}, metrics=["rocker_angle_max"], window={"from": -20, "to": 20}
    )
    assert row.attrs["labels"]["status"][row["status"][0]] == "crank_blocked_at_B"
    with pytest.raises(RequestError, match="from -20 to 60 deg leaves the range of the linkage, -50 to 50 deg"):
        explore.evaluate(linkage, design, metrics=["rocker_angle_max"], window={"from": -20, "to": 60})


def test_metrics_of_the_turn_are_those_of_the_range_and_none_is_of_strokes():
    linkage = explore.Linkage(LIMITED)
    row = explore.evaluate(linkage, LENGTHS | {"r1": 40.0}, metrics=["swing_angle", "transmission_angle_min"])
    motion = explore.simulate(linkage, LENGTHS | {"r1": 40.0}, angles=100_001)
    assert row["swing_angle"][0] == pytest.approx(np.ptp(motion["rocker_angle"]), rel=1e-9)
    assert row["transmission_angle_min"][0] == pytest.approx(motion["B_transmission_angle"].min(), rel=1e-9)
    for name in ("time_ratio", "assembly_intervals", "rocker_velocity_mean_drive"):
        with pytest.raises(RequestError):
            explore.evaluate(linkage, LENGTHS | {"r1": 40.0}, metrics=[name])


def test_a_motion_is_of_angles_of_the_range():
    linkage = explore.Linkage(LIMITED)
    motion = explore.simulate(linkage, LENGTHS | {"r1": 40.0}, angles=5)
    assert motion.index.tolist() == [-50.0, -25.0, 0.0, 25.0, 50.0]
    turned = explore.simulate(linkage, LENGTHS | {"r1": 40.0}, angles=[310.0, 335.0])
    np.testing.assert_array_equal(turned.to_numpy(), motion[:2].to_numpy())
    with pytest.raises(MotionError, match="60 deg is outside the range of the crank, -50 to 50 deg"):
        explore.simulate(linkage, LENGTHS | {"r1": 40.0}, angles=[0, 60])
    with pytest.raises(MotionError, match="no motion over its range to simulate: the crank cannot move over its range"):
        explore.simulate(linkage, LENGTHS | {"r1": 72.0})
    # A blocked crank has a motion at angles of the range at which the linkage assembles, its end too.
    assert np.isfinite(explore.simulate(linkage, LENGTHS | {"r1": 72.0}, angles=[50])["rocker_angle"]).all()


def test_a_range_is_in_the_table_and_what_it_is_written_as():
    table = explore.Linkage(LIMITED).table
    assert content_of(table)["range"] == [-50, 50]
    assert explore.Linkage(content_of(table)).table == table
    assert table.digest != explore.Linkage(FOUR_BAR).table.digest
    assert explore.Linkage(LIMITED | {"range": ["-50 deg", "1.5 rad"]}).table.limits == (-50.0, np.rad2deg(1.5))


@pytest.mark.parametrize(
    ("ends", "reason"),
    [
        ([0], "must be the first and the last crank angle, such as [-50, 50], got [0]"),
        (5, "must be the first and the last crank angle, such as [-50, 50], got 5"),
        (["x", 1], "'x' is not a number with a unit"),
        (["50 deg", -50], "the first crank angle, 50, must be below the last, -50"),
        ([0, 360], "spans 360 deg; leave it out for a driver that turns fully"),
        ([-400, -300], "begins a turn or more from 0; write [320, 420]"),
    ],
)
def test_a_range_that_is_none_has_a_line(ends, reason):
    with pytest.raises(ConfigError) as caught:
        explore.Linkage(FOUR_BAR | {"range": ends})
    assert [line.startswith(f"linkage.range: {reason}") for line in caught.value.problems] == [True]


def test_results_of_before_there_were_ranges_are_of_the_same_mechanism():
    """Their files name it by the hash of its table, which an edition without ranges made."""
    assert explore.Linkage(FOUR_BAR).mechanism.name == "linkage-63d0a0601071"


@pytest.fixture(scope="module", params=["range", "interval"])
def results(request, tmp_path_factory):
    """Designs over a range, and over the interval of a study beyond which they are blocked."""
    folder = tmp_path_factory.mktemp("limited")
    text = (
        STUDY
        if request.param == "range"
        else STUDY.replace("range = [-50, 50]\n", "").replace(
            'metrics = ["rocker_velocity_peak", "swing_angle"]',
            'metrics = ["rocker_velocity_peak"]\nwindow = { from = -50, to = 50 }',
        )
    )
    (folder / "study.toml").write_text(text)
    run("sweep", folder / "study.toml", "-o", folder / "study.h5", cwd=folder)
    return folder / "study.h5"


def exported(results, ending):
    path = results.with_suffix(f".{ending}")
    run("export", results, "--design", "0", "-o", path, cwd=results.parent)
    return path


def test_charts_show_the_motion_between_its_ends(results):
    chart = motion_chart(results, design=0).axes[0]
    assert chart.get_xlim() == (-50.0, 50.0)
    assert [text.get_text() for text in chart.texts] == ["first -50.0°", "last 50.0°"]
    labels = [text.get_text() for text in mechanism_chart(results, design=0).legends[0].get_texts()]
    assert labels[-2:] == ["first position, crank angle -50.0°", "last position, crank angle 50.0°"]
    with pytest.raises(MotionError):
        motion_chart(results, design=1)


def test_a_bound_is_drawn_where_the_motion_is(results):
    charts = motion_chart(results, design=0).axes
    chart = next(each for each in charts if each.get_ylabel().startswith("rocker velocity"))
    lines = [line.get_xdata() for line in chart.get_lines() if line.get_linestyle() == "-."]
    assert sorted(np.concatenate(lines).tolist()) in ([-50.0, 0.0, 0.0, 50.0], [-50.0, 50.0])


def test_exports_are_of_the_motion_between_its_ends(results):
    with exported(results, "csv").open() as file:
        angles = [float(row[0]) for row in list(csv.reader(file))[1:]]
    assert (angles[0], angles[-1], len(angles)) == (-50.0, 50.0, 360)
    paths = [each for each in ET.parse(exported(results, "svg")).iter() if each.tag.endswith("path")]
    titled = [each.get("d") for each in paths if any(child.tag.endswith("title") for child in each)]
    assert titled
    assert not any(data.endswith("Z") for data in titled)


def test_the_path_of_an_export_ends_where_the_point_does(results):
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.readfile(exported(results, "dxf"))
    assert not document.audit().errors
    (path,) = document.modelspace().query("SPLINE")
    assert not path.closed
    ends = np.array([path.control_points[0][:2], path.control_points[-1][:2]])
    with_range = explore.Linkage(LIMITED)
    motion = explore.simulate(with_range, LENGTHS | {"r1": 60.0}, angles=[-50, 50])
    middle = 0.5 * (motion[["A_x", "A_y"]].to_numpy() + motion[["B_x", "B_y"]].to_numpy())
    np.testing.assert_allclose(ends, middle, atol=1e-9)


def test_an_animation_goes_to_and_fro(results):
    text = exported(results, "animated.svg").read_text()
    places = re.search(r'attributeName="cy"[^>]*values="([^"]*)"', text).group(1).split(";")
    assert len(places) == 181
    assert places == places[::-1]
    assert places[0] != places[90]


def test_a_length_is_solved_for_where_a_blocked_crank_moves_over_the_interval(tmp_path):
    """The end of an interval of assembly, a metric without statistics, is prescribed to a study over an interval."""
    window = {"from": 20, "to": 40}
    names = ["assembles_to_1", "rocker_velocity_peak"]
    study = STUDY.replace("range = [-50, 50]\n", "")
    linkage = explore.Linkage(FOUR_BAR)
    row = explore.evaluate(linkage, LENGTHS | {"r1": 60.0, "speed": 2.0 * np.pi}, metrics=names, window=window)
    assert row.attrs["labels"]["status"][row["status"][0]] == "ok"
    solved = f'{{ solve = "assembles_to_1", value = {float(row["assembles_to_1"][0])!r}, min = 55, max = 70 }}'
    study = study.replace("[60, 72]", solved).replace("r2 = 80", "r2 = [80, 81]")
    study = study.replace(
        'metrics = ["rocker_velocity_peak", "swing_angle"]', f"metrics = {names}\nwindow = {{ from = 20, to = 40 }}"
    )
    path = tmp_path / "study.toml"
    path.write_text(study.replace("'", '"'))
    table = explore.sweep(explore.load_study(path), tmp_path / "study.h5").designs([0, 1])
    assert table["r1"][0] == pytest.approx(60.0, rel=1e-12)
    assert table["assembles_to_1"][0] == pytest.approx(row["assembles_to_1"][0], rel=1e-12)


@pytest.mark.parametrize("names", [["assembles_to_1"], ["assembles_to_1", "rocker_velocity_peak"]])
def test_metrics_without_statistics_are_asked_about_over_the_interval(names):
    """A blocked crank moves over an interval that it reaches, with a statistic beside its ends of assembly or not."""
    linkage, design = explore.Linkage(FOUR_BAR), LENGTHS | {"r1": 60.0, "speed": 1.0}
    for window, label in (({"from": 20, "to": 40}, "ok"), ({"from": 20, "to": 200}, "crank_blocked_at_B")):
        row = explore.evaluate(linkage, design, metrics=names, window=window)
        assert row.attrs["labels"]["status"][row["status"][0]] == label
    asked = {"parameter": "r1", "metric": names[0], "window": {"from": 20, "to": 40}, "also": names[1:]}
    tuning = explore.tune(linkage, design, **asked, low=row[names[0]][0] - 1.0, high=row[names[0]][0] + 1.0)
    assert any(part.start.parameter < 60.0 < part.stop.parameter for part in tuning.intervals)


@pytest.mark.parametrize("names", [["assembles_to_1"], ["assembles_to_1", "rocker_velocity_peak"]])
def test_ends_of_assembly_are_certified_beside_an_interval(names, tmp_path):
    pytest.importorskip("flint")
    parameters = LENGTHS | {"r1": [40.0, 60.0], "speed": 1.0}
    window = {"from": 20, "to": 40}
    study = explore.Study(mechanism=explore.Linkage(FOUR_BAR), parameters=parameters, metrics=names, window=window)
    certified = explore.certify(explore.sweep(study, tmp_path / "study.h5"), [0, 1])
    assert certified["verdict"].to_list() == ["proved", "proved"]
