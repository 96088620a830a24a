"""Exported drawings of linkages of a table: the names of dimensions; what is drawn as a circle, an arc or a line."""

import ezdxf
import numpy as np
import pytest

import explore
from explore.figures.exporting.chosen import DesignOfParameters
from explore.studies.config.study_file import linkage_starter

#: A press whose pivots are not at the origin, with a point that draws a curve. Of the distances of its pivots none is a
#: parameter: C is 20 mm to the right of E and `rise` higher, O 2 `base` to the left of C.
TABLE = """\
mechanism = "linkage"
[linkage]
driver = "crank"
output = "ram"
[linkage.frame]
O = [30, 20]
C = ["30 + 2 * base", 20]
E = ["10 + 2 * base", "20 - rise"]
[linkage.links]
crank = { O = 0, A = "r" }
coupler = { A = 0, B = "b", P = [40, 25] }
rocker = { C = 0, B = "c" }
r_2 = { B = 0, S = "2 * r" }
arm = { E = 0, D = 40 }
tie = { B = 0, D = "rise + 45" }
[linkage.slots]
ram = { pin = "S", link = "frame", along = [[0, 110], [1, 110]] }
[linkage.branch]
B = "left of A C"
D = "left of B E"
S = "far"
[parameters]
r = 25
base = 50
b = 90
c = 70
rise = 60
"""
DESIGN = {"r": 25.0, "base": 50.0, "b": 90.0, "c": 70.0, "rise": 60.0}


@pytest.fixture(scope="module")
def press(tmp_path_factory):
    path = tmp_path_factory.mktemp("press") / "press.toml"
    path.write_text(TABLE)
    return explore.load_linkage(path)


@pytest.fixture(scope="module")
def drawn(press, tmp_path_factory):
    """The entities of its drawing."""
    folder = tmp_path_factory.mktemp("drawing")
    explore.export(press, folder / "press.dxf", parameters=DESIGN)
    return ezdxf.readfile(folder / "press.dxf").modelspace()


def test_a_dimension_has_the_name_of_a_length_that_it_measures_only(drawn):
    """Not the parameter in a coordinate of a pivot, nor the coordinate of a slider that counts from another origin."""
    named = {
        each.dxf.text.removesuffix(" <>"): each.get_measurement() for each in drawn.query("DIMENSION")
        if each.dxf.text != "<>"
    }  # fmt: skip
    assert named == pytest.approx({"crank": 25.0, "rocker": 70.0, "r 2": 50.0, "arm": 40.0, "tie": 105.0}, abs=1e-9)


def test_a_linkage_without_a_drawing_says_why(tmp_path):
    (tmp_path / "press.toml").write_text(TABLE.replace("O = [30, 20]", 'O = ["hypot(r, 10)", 20]'))
    linkage = explore.load_linkage(tmp_path / "press.toml")
    with pytest.raises(explore.RequestError, match="this linkage has no drawing: a point of its frame is no sum of"):
        explore.export(linkage, tmp_path / "press.dxf", parameters=DESIGN)


def test_a_linkage_has_the_points_of_its_table(press):
    with pytest.raises(explore.RequestError, match="the points of this linkage are those of its table"):
        explore.simulate(press, DESIGN, points={"Q": (1, 2)})


def test_joints_about_pivots_and_sliders_are_drawn_as_circles_arcs_and_lines(press, drawn):
    paths = drawn.query('*[layer=="paths"]')
    (circle,) = paths.query("CIRCLE")
    assert (circle.dxf.radius, circle.dxf.center.x, circle.dxf.center.y) == pytest.approx((25.0, 30.0, 20.0), abs=1e-9)
    turn = explore.simulate(press, DESIGN, angles=3600)
    arcs = {round(each.dxf.radius, 9): each for each in paths.query("ARC")}
    assert set(arcs) == {40.0, 70.0}
    angles = np.rad2deg(np.arctan2(turn["B_y"] - 20.0, turn["B_x"] - 130.0)) % 360.0
    ends = [arcs[70.0].dxf.start_angle % 360.0, arcs[70.0].dxf.end_angle % 360.0]
    assert ends == pytest.approx([angles.min(), angles.max()], abs=1e-4)  # the samples are 0.1 deg apart
    (line,) = paths.query("LINE")
    assert sorted([line.dxf.start.x, line.dxf.end.x]) == pytest.approx([turn["S_x"].min(), turn["S_x"].max()], abs=1e-4)
    assert len(paths.query("SPLINE")) == 1, "of the free point"


#: A guide that swings with its parameter, and a claw that slides over a pin of the frame.
SLANTED = """\
mechanism = "linkage"
[linkage]
driver = "crank"
output = "bore"
[linkage.frame]
O = [0, 0]
C = [60, 5]
[linkage.links]
crank = { O = 0, A = "r" }
rod = { A = 0, S = 90 }
claw = { A = 0, P = [80, -12] }
[linkage.slots]
bore = { pin = "S", link = "frame", along = ["O", { radius = 1, angle = "90 + slant" }] }
guide = { pin = "C", link = "claw", along = ["A", [1, 0]] }
[linkage.branch]
S = "far"
guide = "positive"
[parameters]
r = 25
slant = 30
"""


@pytest.fixture(scope="module")
def slanted(tmp_path_factory):
    """The entities of the drawing of an engine whose bore has a direction of the design, here 120 deg."""
    folder = tmp_path_factory.mktemp("slanted")
    (folder / "engine.toml").write_text(SLANTED)
    linkage = explore.load_linkage(folder / "engine.toml")
    explore.export(linkage, folder / "engine.dxf", parameters={"r": 25.0, "slant": 30.0})
    return ezdxf.readfile(folder / "engine.dxf").modelspace()


def test_a_slot_whose_direction_is_that_of_a_design_has_a_guide_and_a_straight_path(slanted):
    (line,) = slanted.query('LINE[layer=="paths"]')
    ways = [np.array([each.dxf.end.x - each.dxf.start.x, each.dxf.end.y - each.dxf.start.y])
            for each in (line, *slanted.query('LINE[layer=="guides"]'))]  # fmt: skip
    assert np.hypot(*ways[0]) == pytest.approx(50.0, abs=1e-9)  # twice the crank
    assert len(ways) == 3
    for x, y in ways:
        assert np.rad2deg(np.arctan2(y, x)) % 180.0 == pytest.approx(120.0, abs=1e-9)


def test_a_pin_of_the_frame_that_a_link_slides_over_is_drawn_as_a_pivot(slanted):
    centres = {(round(each.dxf.center.x, 6), round(each.dxf.center.y, 6))
               for each in slanted.query('CIRCLE[layer=="pivots"]')}  # fmt: skip
    assert centres == {(0.0, 0.0), (60.0, 5.0)}


def test_a_yoke_reaches_to_its_slot_and_along_it_to_the_pin(tmp_path):
    """At a crank angle of 90 deg, where the slot leans to the pin by `slant` of its height."""
    (tmp_path / "yoke.toml").write_text(linkage_starter("scotch-yoke"))
    linkage = explore.load_linkage(tmp_path / "yoke.toml")
    assert {body.name: list(body.place_of) for body in linkage.table.links} == {"crank": ["O", "A"], "yoke": ["P"]}
    simulated = DesignOfParameters.read(linkage, {"r": 30.0, "slant": 0.5}, {}).simulated
    crank, yoke = simulated.drawing.links
    assert (crank.points, yoke.name) == (("O", "A"), "yoke")
    places = simulated.pose([90.0]).points(simulated.drawing)
    way = np.array([places[point][0] for point in yoke.points])
    assert way == pytest.approx(np.array([[105.0, 0.0], [-15.0, 0.0], [0.0, 30.0]]), abs=1e-12)
    assert [(guide.point, guide.angle) for guide in simulated.drawing.guides] == [("P", 0.0)]


def test_a_yoke_on_a_turning_link_reaches_to_its_slot_too():
    """An arm that turns about O carries the yoke, whose slot across the arm holds a pin of the frame."""
    linkage = explore.Linkage({
        "driver": "arm",
        "frame": {"O": [0, 0], "C": [60, "c"]},
        "links": {"arm": {"O": 0}, "yoke": {"P": [5, 0]}},
        "slides": {"yoke": {"link": "arm", "direction": [1, 0]}},
        "slots": {"guide": {"pin": "C", "link": "yoke", "along": [[-15, -10], [-15, 1]]}},
    })  # fmt: skip
    simulated = DesignOfParameters.read(linkage, {"c": 10.0}, {}).simulated
    (yoke,) = simulated.drawing.links
    places = simulated.pose([90.0]).points(simulated.drawing)
    way = np.array([places[point][0] for point in yoke.points])
    assert way == pytest.approx(np.array([[0.0, 30.0], [10.0, 10.0], [60.0, 10.0]]), abs=1e-12)
