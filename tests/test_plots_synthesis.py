"""Figures of synthesis: cognates that draw one path, Burmester curves through known pivots."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from studies import sweep_text, synthesize_text

import explore
from explore.base.errors import RequestError
from explore.base.units.shown import read_shown_units
from explore.figures.charts.burmester import burmester_chart, burmester_figure
from explore.figures.charts.cognates import cognates_chart, cognates_figure
from explore.figures.charts.linkages import crank_angles
from explore.figures.charts.pareto import pareto_chart
from explore.figures.charts.style import BLUE, GREEN, ORANGE, save_figure
from explore.synthesis.cognates import cognate_angles, find_cognates
from explore.synthesis.linkages import FourBar
from explore.synthesis.poses import Dyad, Poses

STUDY = """mechanism = "{mechanism}"
[parameters]
{parameters}
[points]
{points}
"""
CRANK_ROCKER = "crank = 100\ncoupler = 280\nrocker = 260\nground = 220"
TURNING = FourBar(0, 4, 1, 3.5, 2.5, 0.6 + 0.7j)
TURNING_OTHERWISE = FourBar(10 + 20j, 100 + 50j, 30, 80, 70, 0.4 - 0.9j, -1)
ROCKING = FourBar(0, 100, 80, 50, 70, 0.5 + 0.6j)
#: Of the lengths 1, 4, 2 and 4.5 the ground is not the longest and crank and coupler swing to both sides apart.
TWO_ARCS = FourBar(0, 2, 4, 1, 4.5, 0.5 + 1j)


def drawn(line):
    """Points of a line of a chart, complex."""
    return np.asarray(line.get_xdata()) + 1j * np.asarray(line.get_ydata())


def distance_to_line(points, line):
    """Distances of points to a polyline, by all its segments; NaN breaks it."""
    start, stop = line[:-1], line[1:]
    whole = ~(np.isnan(start) | np.isnan(stop)) & (start != stop)
    start, along = start[whole], (stop - start)[whole]
    share = np.clip(((points[:, None] - start) / along).real, 0.0, 1.0)
    return np.abs(points[:, None] - start - share * along).min(axis=1)


@pytest.mark.parametrize("linkage", [TURNING, TURNING_OTHERWISE, ROCKING, TWO_ARCS])
def test_the_crank_angles_are_those_at_which_the_linkage_can_be_assembled(linkage):
    angles = crank_angles(linkage, 0.3)
    assert np.all(np.diff(angles) > 0.0)
    # a square root of the rounding of the limits
    inner = angles if linkage.is_crank_turning else angles[1:-1]
    assert np.isfinite(linkage.points(inner)).all()
    if linkage.is_crank_turning:
        assert angles[-1] - angles[0] == pytest.approx(2.0 * np.pi)
    else:
        step = 1e-6
        assert np.isnan(linkage.points(np.array([angles[0] - step, angles[-1] + step]))).all()


@pytest.mark.parametrize("linkage", [TURNING, TURNING_OTHERWISE, ROCKING])
def test_cognates_at_their_own_angles_are_at_the_point_of_the_linkage(linkage):
    angles = crank_angles(linkage)[5:-5:45]
    points = linkage.points(angles)
    own_angles = np.array(cognate_angles(linkage, angles))
    for k, angle in enumerate(angles):
        for cognate, own in zip(find_cognates(linkage, angle), own_angles[:, k : k + 1], strict=True):
            # 100 roundings of the longest length, over the square root at the ends of an arc
            assert abs(cognate.points(own)[0] - points[k]) < 1e-11 * max(linkage.lengths)


def test_the_dashes_of_the_path_are_computed_from_each_linkage(tmp_path):
    figure = cognates_figure(TURNING)
    (panel,) = figure.axes
    dashes = [line for line in panel.get_lines() if np.isnan(line.get_xdata()).any()]
    assert [to_hex(line.get_color()) for line in dashes] == [BLUE, ORANGE, GREEN]
    path = TURNING.points(crank_angles(TURNING))
    for line in dashes:
        own = drawn(line)
        assert 0.3 < np.isfinite(own).mean() < 0.4
        assert np.nanmax(np.abs(own - path)) < 1e-12  # 1,000 roundings of the longest link
    save_figure(figure, tmp_path / "cognates.svg")
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts[0] == "linkage: crank 1, coupler 3.5, rocker 2.5, ground 4 mm; its crank turns fully"
    assert texts[1].endswith("its crank does not turn fully")


def test_every_linkage_of_the_triple_is_drawn_with_its_lengths():
    (panel,) = cognates_figure(TURNING, angle=1.0).axes
    for cognate, colour in zip((TURNING, *find_cognates(TURNING, 1.0)), (BLUE, ORANGE, GREEN), strict=True):
        chains = [drawn(line) for line in panel.get_lines() if line.get_marker() == "o" and line.get_color() == colour]
        crank, body, rocker = (each for each in chains if len(each) > 1)
        lengths = [abs(crank[1] - crank[0]), abs(body[2] - body[0]), abs(rocker[1] - rocker[0])]
        assert lengths == pytest.approx(cognate.lengths[:3], rel=1e-12)


def sweep_one(folder, mechanism, parameters, points=""):
    text = STUDY.format(mechanism=mechanism, parameters=parameters, points=points)
    return sweep_text(folder, text, "one")


@pytest.mark.parametrize("branch", [1, -1])
def test_cognates_of_results_draw_the_path_of_the_design(tmp_path, branch):
    parameters = f"{CRANK_ROCKER}\nbranch = {branch}"
    results = sweep_one(tmp_path, "crank-rocker", parameters, "M = { along = 120, across = 90 }")
    figure = cognates_chart(results, design=0)
    lengths = {"crank": 100, "coupler": 280, "rocker": 260, "ground": 220, "branch": branch}
    motion = explore.simulate("crank-rocker", lengths, points={"M": (120, 90)}, angles=720)
    path = motion["M_x"].to_numpy() + 1j * motion["M_y"].to_numpy()
    dashes = [line for line in figure.axes[0].get_lines() if np.isnan(line.get_xdata()).any()]
    assert len(dashes) == 3
    for line in dashes:
        own = drawn(line)
        # the path between two of its points half a degree apart bends off their chord by less
        assert distance_to_line(own[np.isfinite(own)], np.append(path, path[0])).max() < 0.01
    assert figure.get_suptitle().replace("\n", " ").startswith("one, design\xa00:")
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts[0] == "linkage: crank 100, coupler 280, rocker 260, ground 220 mm; its crank turns fully"
    in_inches = cognates_chart(results.in_units(read_shown_units({"length": "in"})), design=0)
    assert in_inches.axes[0].get_xlabel() == "x [in]"
    assert "crank 3.937, coupler 11.024" in in_inches.legends[0].get_texts()[0].get_text()


@pytest.mark.parametrize(
    ("mechanism", "parameters", "points", "message"),
    [
        (
            "slider-crank",
            "crank = 50\nrod = 200",
            "M = { along = 120, across = 40 }",
            "a four-bar, which a slider-crank",
        ),
        ("crank-rocker", CRANK_ROCKER, "", "the study has none: name one in .points."),
        ("crank-rocker", CRANK_ROCKER, "M = { along = 280, across = 0 }", "the coupler point is a pin"),
    ],
)
def test_what_has_no_cognates_is_said(tmp_path, mechanism, parameters, points, message):
    results = sweep_one(tmp_path, mechanism, parameters, points)
    with pytest.raises(RequestError, match=message):
        cognates_chart(results, design=0)


def test_a_coupler_point_on_a_pin_has_no_cognates():
    with pytest.raises(RequestError, match="the coupler point is a pin"):
        cognates_figure(FourBar(0, 4, 1, 3.5, 2.5, 1.0))


def test_kinds_of_candidates_have_their_marks(tmp_path):
    results = synthesize_text(
        tmp_path, 'task = "dead-positions"\n[target]\nswing_angle = 40\ntime_ratio = 1.25\n[search]\ncount = 12\n'
    )
    table = results.to_pandas()
    feasible = table[table["feasible"].astype(bool)]
    (chart,) = pareto_chart(results).axes
    lines = {str(line.get_label()): line for line in chart.get_lines()}
    objectives = list(results.objectives)[:2]
    for code, label in ((1, "with rocker"), (-1, "against rocker")):
        own = feasible[feasible["family"] == code]
        line = lines[f"feasible, family {label}: {len(own)}"]
        assert {tuple(p) for p in np.column_stack(line.get_data())} == {
            tuple(p) for p in own[[o.split(":")[0] for o in objectives]].to_numpy()
        }
    assert len({lines[label].get_marker() for label in lines if label.startswith("feasible, family")}) == 2


def poses_of(linkage, degrees):
    angles = np.radians(degrees)
    pins, others = linkage.crank_pins(angles), linkage.rocker_pins(angles)
    dyads = [Dyad(linkage.crank_pivot, pins[0]), Dyad(linkage.rocker_pivot, others[0])]
    return Poses(linkage.points(angles), np.angle(others - pins)), dyads


@pytest.mark.parametrize(("linkage", "degrees"), [(TURNING, [20, 50, 85, 125]), (TURNING_OTHERWISE, [0, 60, 140, 250])])
def test_burmester_curves_pass_through_the_pivots_of_the_linkage_that_made_the_poses(linkage, degrees, tmp_path):
    poses, dyads = poses_of(linkage, degrees)
    figure = burmester_figure(poses, dyads=dyads)
    (panel,) = figure.axes
    fixed, moving = (drawn(line) for line in panel.get_lines()[:2])
    size = np.ptp(panel.get_ylim())
    for curve, pivots in ((fixed, [d.fixed for d in dyads]), (moving, [d.moving for d in dyads])):
        # a chord of a hundredth of the view lies below this from a curve that bends on a tenth of it
        assert distance_to_line(np.array(pivots), curve).max() < 2e-4 * size
    save_figure(figure, tmp_path / "burmester.png")


def test_burmester_curves_close_where_their_two_roots_meet():
    """In the view a curve ends nowhere: each break of a line lies outside or meets another end."""
    poses, dyads = poses_of(TURNING, [20, 50, 85, 125])
    (panel,) = burmester_figure(poses, dyads=dyads).axes
    (left, right), (low, high) = panel.get_xlim(), panel.get_ylim()
    for line in panel.get_lines()[:2]:
        points = drawn(line)
        is_there = np.isfinite(points)
        before, after = np.roll(is_there, 1), np.roll(is_there, -1)
        ends = points[is_there & (before ^ after)]  # a lone point is not drawn
        ends = ends[(ends.real > left) & (ends.real < right) & (ends.imag > low) & (ends.imag < high)]
        for k, end in enumerate(ends):
            assert np.abs(np.delete(ends, k) - end).min() < 1e-3 * (high - low)


def test_burmester_curves_of_a_task_show_its_poses_and_the_links_of_a_design(tmp_path):
    given = [[12.06, 13.06, 37.7], [10.46, 16.81, 29.3], [5.80, 18.66, 23.6], [-0.54, 16.74, 21.8]]
    results = synthesize_text(tmp_path, f'task = "motion"\n[target]\nposes = {given}\n[search]\ncount = 2\n')
    (panel,) = burmester_chart(results, design=1).axes
    fixed, moving = (drawn(line) for line in panel.get_lines()[:2])
    sides = [drawn(line) for line in panel.get_lines()[2:6]]
    for (x, y, degrees), side in zip(given, sides, strict=True):
        assert abs(side[1] - complex(x, y)) < 1e-9
        assert np.degrees(np.angle(side[2] - side[1])) == pytest.approx(degrees, abs=1e-8)
    design = results.design(1)
    links = [drawn(line) for line in panel.get_lines() if line.get_color() == GREEN]
    assert [abs(last - first) for first, last in links] == pytest.approx([design["crank"], design["rocker"]], rel=1e-9)
    assert links[0][0] == pytest.approx(complex(design["crank_pivot_x"], design["crank_pivot_y"]), abs=1e-9)
    for first, last in links:
        size = np.ptp(panel.get_ylim())
        assert distance_to_line(np.array([first]), fixed)[0] < 2e-4 * size
        assert distance_to_line(np.array([last]), moving)[0] < 2e-4 * size


def test_burmester_curves_need_four_poses():
    poses, _ = poses_of(TURNING, [20, 50, 85])
    with pytest.raises(RequestError, match="four poses have Burmester curves, not 3"):
        burmester_figure(poses)
