"""Figures of a target: the path against it, the distances between them, and where the linkage lies."""

import numpy as np
import pytest
from studies import sweep_text

import explore
from explore.base.units.shown import read_shown_units
from explore.figures.charts.cognates import cognates_chart
from explore.figures.charts.mechanism import mechanism_chart
from explore.figures.charts.path import path_chart
from explore.figures.charts.style import save_figure

#: A path of Yu, Tang and Wang 2007 and linkages near theirs.
STUDY = """mechanism = "crank-rocker"
[points]
M = {{ along = {{ min = -24, max = -20 }}, across = {{ min = 5, max = 9 }} }}
[target]
kind = "path"
points = {points}
closed = {closed}
weights = {weights}
[parameters]
crank = {{ min = 16, max = 19 }}
coupler = 25.46
rocker = 64.57
ground = 65.87
crank_pivot_x = {{ min = -13, max = -10 }}
crank_pivot_y = -20.14
ground_angle = 170.8
[sampling]
method = "sobol"
count = 8
seed = 1
[constraints]
transmission_angle_min = {{ min = 20 }}
"""
POINTS = [[-27.0, 1.0], [-11.571, -11.642], [3.857, -24.285], [15.0, -29.9], [27.2, -25.0], [28.0, -10.0], [15.0, 10.6],
          [-10.0, 19.6], [-28.0, 11.0]]  # fmt: skip


@pytest.fixture(scope="module", params=["closed", "open"])
def results(request, tmp_path_factory):
    """Eight designs with a closed target, and with the first half of it."""
    folder, is_closed = tmp_path_factory.mktemp("path"), request.param == "closed"
    points = POINTS if is_closed else POINTS[:5]
    text = STUDY.format(points=points, closed=str(is_closed).lower(), weights=[1.0 + k for k in range(len(points))])
    return sweep_text(folder, text, "path")


def lines_of(panel):
    return {str(line.get_label()).split(",")[0]: line for line in panel.get_lines()}


def place_of(design, angles):
    """Where the point is in the plane at crank angles in deg, from the signals of the linkage, complex."""
    names = ("crank", "coupler", "rocker", "ground")
    motion = explore.simulate(
        "crank-rocker",
        {name: design[name] for name in names},
        points={"M": (design["M_along"], design["M_across"])},
        angles=angles,
    )
    own = motion["M_x"].to_numpy() + 1j * motion["M_y"].to_numpy()
    pivot = design["crank_pivot_x"] + 1j * design["crank_pivot_y"]
    return pivot + np.exp(1j * np.radians(design["ground_angle"])) * own


def test_distances_are_those_that_the_metrics_measure(results, tmp_path):
    figure = path_chart(results, design=3)
    design = results.design(3)
    plane, error, transmission = figure.axes
    given = lines_of(error)["given points to the path"]
    angles, distances = given.get_data()
    weights = 1.0 + np.arange(len(distances))
    assert np.sqrt(np.average(distances**2, weights=weights)) == pytest.approx(design["path_error_rms"], rel=1e-12)
    assert distances.max() == pytest.approx(design["path_error_max"], rel=1e-12)
    points = np.array(POINTS[: len(distances)]) @ [1.0, 1.0j]
    assert np.abs(place_of(design, angles) - points) == pytest.approx(distances, abs=1e-11)
    curve = lines_of(error)["path of M to the lines between the points"]
    shown = np.arange(0, len(curve.get_xdata()), 37)
    places = place_of(design, curve.get_xdata()[shown])
    corners = np.append(points, points[0]) if results.target.closed else points
    shares = np.linspace(0.0, 1.0, 20_001)[:, None]
    dense = (corners[:-1] + shares * np.diff(corners)).ravel()
    # 20,000 parts of a side of 40 mm: the nearest of them is at most half a part beside
    assert curve.get_ydata()[shown] == pytest.approx([np.abs(dense - place).min() for place in places], abs=1e-3)
    assert transmission.get_lines()[0].get_ydata().min() == pytest.approx(design["transmission_angle_min"], rel=1e-9)
    assert plane.get_aspect() == 1.0
    save_figure(figure, tmp_path / "path.svg")


def test_the_path_is_drawn_in_the_plane_of_the_target(results):
    design = results.design(3)
    path = np.column_stack(lines_of(path_chart(results, design=3).axes[0])["path of M"].get_data()) @ [1.0, 1.0j]
    angles = np.linspace(0.0, 360.0, 13)[:-1]
    nearest = np.abs(place_of(design, angles)[:, None] - path).min(axis=1)
    assert nearest.max() < 1e-10  # these angles are among those that are drawn
    for chart in (mechanism_chart, cognates_chart, path_chart):
        target = lines_of(chart(results, design=3).axes[0])["target"]
        assert np.column_stack(target.get_data()).tolist() == [list(p) for p in results.target.points]


def test_inches(results):
    error = path_chart(results.in_units(read_shown_units({"length": "in"})), design=3).axes[1]
    plain = path_chart(results, design=3).axes[1]
    assert error.get_ylabel() == "distance [in]"
    inches, given = (lines_of(panel)["given points to the path"].get_ydata() for panel in (error, plain))
    assert inches == pytest.approx(given / 25.4, rel=1e-12)


def test_points_at_other_crank_angles_lie_within_the_picture(tmp_path):
    """The path runs through all points, but at half of the given crank angles."""
    lengths = {"crank": 17.0, "coupler": 25.46, "rocker": 64.57, "ground": 65.87}
    motion = explore.simulate("crank-rocker", lengths, points={"M": (-22, 7)}, angles=np.arange(0.0, 360.0, 30.0))
    points = motion[["M_x", "M_y"]].to_numpy().tolist()
    target = f'[target]\nkind = "path"\npoint = "M"\npoints = {points}\nclosed = true\ncrank_angles = {{}}\n'
    parameters = "\n".join(f"{name} = {value}" for name, value in lengths.items())
    text = f'mechanism = "crank-rocker"\n[points.M]\nalong = -22\nacross = 7\n{target}[parameters]\n{parameters}\n'
    results = sweep_text(tmp_path, text.format([15.0 * k for k in range(12)]), "timed")
    panel = path_chart(results, design=0).axes[1]
    given = lines_of(panel)["given points to the path"].get_ydata()
    assert given.max() > 10.0 * lines_of(panel)["path of M to the lines between the points"].get_ydata().max()
    assert given.max() < panel.get_ylim()[1]
