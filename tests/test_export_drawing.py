"""Exported drawings in other readers: lengths and dimensions beside the parameters, splines beside the motion."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import ezdxf
import numpy as np
import pytest
from ezdxf import bbox, units

import explore
from explore.figures.exporting.chosen import DesignOfParameters
from explore.figures.exporting.dimensions import dimensions
from explore.figures.exporting.dxf import _add, write_dxf
from explore.figures.exporting.movement import move
from explore.figures.exporting.shapes import Arc, Distance, Text, bounds
from explore.figures.exporting.sheet import draw_sheet
from explore.figures.exporting.svg import document as svg_document
from explore.figures.exporting.svg import element, path_data, write_svg
from explore.figures.simulation import SimulatedDesign
from explore.model.drawing import Vector

DESIGNS = {
    "crank-rocker": {"crank": 40.0, "coupler": 170.0, "rocker": 60.0, "ground": 180.0},
    "test-rig": {"crank": 30.0, "coupler": 500.0, "rocker": 200.0, "ground": 480.0},
    "slider-crank": {"crank": 60.0, "rod": 200.0, "offset": 25.0},
    "variable-crank": {"rod": 150.0, "slider_speed": 300.0, "speed": 6.0, "reversal_time": 0.15},
    "gears": {"growth": 1.44, "centre_distance": 140.0},
}
#: Links that are lines, and parameters that are dimensions, of each.
LENGTHS = {
    "crank-rocker": (["crank", "coupler", "rocker"], ["crank", "coupler", "rocker", "ground"]),
    "test-rig": (["crank", "coupler", "rocker"], ["crank", "coupler", "rocker", "ground"]),
    "slider-crank": (["crank", "rod"], ["crank", "rod", "offset"]),
    "variable-crank": (["rod"], ["rod"]),
    "gears": ([], ["centre_distance"]),
}
#: Closed-form metrics that are dimensions: how far the output goes.
WAYS = {
    "crank-rocker": "swing_angle",
    "test-rig": "swing_angle",
    "slider-crank": "stroke",
    "variable-crank": "stroke",
}
SVG = "{http://www.w3.org/2000/svg}"
#: mm and deg. Sums of lengths below 1000 mm round to 1e-13 mm, cosines of an arc's ends to 1e-14 rad; the extremes of
#: the output are found on grids, the last of 1e-5 deg, whose square is the error.
ROUNDING = 1e-9


@pytest.fixture(scope="module", params=DESIGNS)
def drawing(request, tmp_path_factory):
    """A design's name and the folder of its drawings."""
    folder = tmp_path_factory.mktemp("drawing")
    explore.export(request.param, [folder / "a.dxf", folder / "a.svg"], parameters=DESIGNS[request.param])
    return request.param, folder


def layer(document, name, kind="*"):
    return document.modelspace().query(f'{kind}[layer=="{name}"]')


def test_dxf_is_sound_in_millimetres_with_layers(drawing):
    name, folder = drawing
    document = ezdxf.readfile(folder / "a.dxf")
    auditor = document.audit()
    assert (auditor.errors, auditor.fixes) == ([], [])
    assert (document.dxfversion, document.units) == ("AC1024", units.MM)
    assert document.header["$MEASUREMENT"] == 1
    used = {entity.dxf.layer for entity in document.modelspace()}
    expected = {"paths", "pivots", "dimensions", "text"}
    expected |= {"profiles"} if name == "gears" else {"links", "limit positions"}
    expected |= {"guides"} if name in ("slider-crank", "variable-crank") else set()
    assert used == expected
    assert used <= {each.dxf.name for each in document.layers}
    assert document.layers.get("limit positions").dxf.linetype == "DIVIDE"


def test_dxf_says_where_in_its_plane_the_lines_are(drawing):
    """Programs zoom to that: texts and dimensions stand around the lines."""
    document = ezdxf.readfile(drawing[1] / "a.dxf")
    low, high = (np.array(document.header[key]) for key in ("$EXTMIN", "$EXTMAX"))
    lines = bbox.extents(each for each in document.modelspace() if each.dxf.layer not in ("dimensions", "text"))
    size = lines.size.magnitude
    slack = np.array([1e-3 * size, 1e-3 * size, 0])
    assert (low - slack <= lines.extmin).all()
    assert (high + slack >= lines.extmax).all()
    assert low[2] == high[2] == 0
    assert (high - low).max() <= 2 * size


def test_links_and_dimensions_have_the_lengths_of_the_parameters(drawing):
    name, folder = drawing
    document, design = ezdxf.readfile(folder / "a.dxf"), DESIGNS[drawing[0]]
    links, dimensions = LENGTHS[name]
    lines = [line.dxf.start.distance(line.dxf.end) for line in layer(document, "links", "LINE")]
    for link in links:
        assert min(abs(length - design[link]) for length in lines) < ROUNDING, link
    entities = layer(document, "dimensions", "DIMENSION")
    measured = [dimension.get_measurement() for dimension in entities]
    for parameter in dimensions:
        assert min(abs(value - design[parameter]) for value in measured) < ROUNDING, parameter
    if way := WAYS.get(name):
        expected = explore.evaluate(name, design, metrics=[way])[way].iloc[0]
        assert min(abs(value - expected) for value in measured) < ROUNDING, way
    for dimension, value in zip(entities, measured, strict=True):
        (text,) = dimension.get_geometry_block().query("MTEXT")
        # four decimals
        assert float(numbers(text.text)[-1]) == pytest.approx(value, abs=0.5001e-4), "what is drawn is what is measured"


def test_paths_are_circles_and_arcs_where_they_are(tmp_path):
    """Of a crank-rocker, whose joints go round the pivots."""
    simulated = DesignOfParameters.read("crank-rocker", DESIGNS["crank-rocker"], {}).simulated
    sheet = draw_sheet(simulated)
    circle, arc = (shape for shape in sheet.shapes if shape.layer == "paths")
    assert (circle.radius, circle.centre.tolist()) == (40.0, [0.0, 0.0])
    assert (arc.radius, arc.centre.tolist()) == (60.0, [180.0, 0.0])
    angles = explore.simulate("crank-rocker", DESIGNS["crank-rocker"], angles=3600)["rocker_angle"]
    assert arc.start <= angles.min() < arc.start + 1e-4  # the grid misses the extreme by the square of 0.05 deg
    assert arc.stop - 1e-4 < angles.max() <= arc.stop
    write_dxf(sheet, tmp_path / "a.dxf")
    (drawn,) = layer(ezdxf.readfile(tmp_path / "a.dxf"), "paths", "ARC")
    assert (drawn.dxf.start_angle, drawn.dxf.end_angle) == pytest.approx((arc.start, arc.stop), abs=ROUNDING)


@pytest.mark.parametrize(("stop", "is_large"), [(60.0, 0), (120.0, 0), (179.0, 0), (181.0, 1), (300.0, 1)])
def test_arcs_of_svg_go_the_shorter_or_the_longer_way(stop, is_large):
    data = path_data(Arc("paths", np.zeros(2), 2.0, 0.0, stop))
    assert numbers(data).tolist()[2:7] == [2.0, 2.0, 0.0, is_large, 0.0]


def test_texts_and_titles_of_svg_are_escaped():
    words = "<a> & 'b' \"c\""
    text = element(Text("text", np.zeros(2), words), 1.0)
    root = ET.fromstring(svg_document(words, np.zeros(2), np.ones(2), 1.0, text).encode())
    assert [root.find(f"{SVG}{tag}").text for tag in ("title", "text")] == [words, words]


def test_texts_of_dxf_have_carets():
    space = ezdxf.new().modelspace()
    _add(space, Text("text", np.zeros(2), "gravity 9.81 m/s^2"), 1.0)
    assert [text.plain_text() for text in space] == ["gravity 9.81 m/s^2"]


def exact_groove(angles):
    crank = explore.simulate("variable-crank", DESIGNS["variable-crank"], angles=angles)["crank"].to_numpy()
    return crank * np.exp(1j * np.deg2rad(angles))


def exact_driver(angles):
    radius = explore.simulate("gears", DESIGNS["gears"], angles=angles)["driver_radius"].to_numpy()
    return radius * np.exp(-1j * np.deg2rad(angles))


def exact_driven(angles):
    motion = explore.simulate("gears", DESIGNS["gears"], angles=angles)
    turned = np.exp(1j * np.deg2rad(motion["driven_angle"].to_numpy()))
    return DESIGNS["gears"]["centre_distance"] - motion["driven_radius"].to_numpy() * turned


def exact_knife(angles):
    motion = explore.simulate("crank-rocker", DESIGNS["crank-rocker"], points={"knife": (120.0, 40.0)}, angles=angles)
    return motion["knife_x"].to_numpy() + 1j * motion["knife_y"].to_numpy()


@pytest.mark.parametrize(
    ("name", "number", "exact", "points"),
    [
        ("variable-crank", 0, exact_groove, {}),
        ("gears", 0, exact_driver, {}),
        ("gears", 1, exact_driven, {}),
        ("crank-rocker", 0, exact_knife, {"knife": (120.0, 40.0)}),
    ],
)
def test_splines_are_closed_smooth_and_within_a_micrometre(name, number, exact, points, tmp_path):
    """The spline as ezdxf evaluates it; its parameter is the input angle, at which the motion gives the exact point."""
    explore.export(name, tmp_path / "a.dxf", parameters=DESIGNS[name], points=points)
    document = ezdxf.readfile(tmp_path / "a.dxf")
    spline = document.modelspace().query("SPLINE")[number]
    assert spline.closed
    assert spline.control_points[0].tolist() == spline.control_points[-1].tolist()
    curve = spline.construction_tool()
    angles = np.linspace(spline.knots[0], spline.knots[-1], 5000)
    drawn = np.array([complex(point.x, point.y) for point in curve.points(angles)])
    deviation = np.abs(drawn - exact(angles)).max()
    assert deviation < 1e-3
    notes = [text.dxf.text for text in layer(document, "text", "TEXT")]
    (stated,) = [
        re.fullmatch(r"splines within (\S+) mm of the exact curves", note) for note in notes if "spline" in note
    ]
    # Stated are the largest deviations at the quarters between points, rounded to a digit, of all splines.
    assert deviation < 1.2 * float(stated[1])
    turns = np.abs(np.diff(np.unwrap(np.angle(np.diff(np.append(drawn, drawn[1]))))))
    assert turns.max() < 0.05, "a corner"


def numbers(text):
    return np.array(re.findall(r"-?\d+(?:\.\d+)?", text), dtype=float)


def test_svg_is_to_scale_with_a_group_for_each_layer(drawing):
    name, folder = drawing
    root = ET.parse(folder / "a.svg").getroot()
    _, _, width, height = numbers(root.get("viewBox"))
    assert [float(root.get(side).removesuffix("mm")) for side in ("width", "height")] == [width, height]
    groups = {group.get("id"): group for group in root.iter(f"{SVG}g")}
    document = ezdxf.readfile(folder / "a.dxf")
    assert set(groups) == {entity.dxf.layer.replace(" ", "-") for entity in document.modelspace()}
    if name == "gears":
        return
    lines = [numbers(path.get("d")) for path in groups["links"].iter(f"{SVG}path")]
    lengths = [np.hypot(line[2] - line[0], line[3] - line[1]) for line in lines if len(line) == 4]
    for link in LENGTHS[name][0]:
        # coordinates have six decimals
        assert min(abs(length - DESIGNS[name][link]) for length in lengths) < 2e-6, link


def test_the_svg_of_a_small_linkage_keeps_its_figures(tmp_path):
    small = {name: length * 1.2345e-6 for name, length in DESIGNS["crank-rocker"].items()}
    explore.export("crank-rocker", [tmp_path / "a.svg", tmp_path / "a.dxf"], parameters=small)
    root = ET.parse(tmp_path / "a.svg").getroot()
    (paths,) = [group for group in root.iter(f"{SVG}g") if group.get("id") == "paths"]
    assert float(next(paths.iter(f"{SVG}circle")).get("r")) == pytest.approx(small["crank"], rel=1e-6)
    assert f"crank {small['crank']:.6g}" in {text.text for text in root.iter(f"{SVG}text")}
    assert ezdxf.readfile(tmp_path / "a.dxf").dimstyles.get("explore").dxf.dimdec == 8


def test_svg_and_dxf_have_the_same_splines(tmp_path):
    explore.export("gears", [tmp_path / "a.dxf", tmp_path / "a.svg"], parameters=DESIGNS["gears"])
    splines = ezdxf.readfile(tmp_path / "a.dxf").modelspace().query("SPLINE")
    root = ET.parse(tmp_path / "a.svg").getroot()
    (group,) = [group for group in root.iter(f"{SVG}g") if group.get("id") == "profiles"]
    for spline, path in zip(splines, group.iter(f"{SVG}path"), strict=True):
        data = numbers(path.get("d")).reshape(-1, 2) * [1.0, -1.0]
        starts, (first, second, ends) = data[:-1:3], (data[1::3], data[2::3], data[3::3])
        middles = (starts + 3.0 * first + 3.0 * second + ends) / 8.0
        knots = np.unique(spline.knots)
        assert len(middles) == len(knots) - 1
        expected = [point.vec2 for point in spline.construction_tool().points(0.5 * (knots[1:] + knots[:-1]))]
        assert middles == pytest.approx(np.array([(point.x, point.y) for point in expected]), abs=2e-6)


#: Designs whose texts are looked at, by a name: mechanism, parameters, points, and place in the plane.
CRANK_ROCKER, SLIDER_CRANK = DESIGNS["crank-rocker"], DESIGNS["slider-crank"]
KNIFE = {"crank": 30.0, "coupler": 60.0, "rocker": 100.0, "ground": 100.0}
SHOWN = {
    **{name: (name, design, {}, (0.0, 0.0, 0.0)) for name, design in DESIGNS.items()},
    "other branch": ("crank-rocker", CRANK_ROCKER | {"branch": -1.0}, {}, (0.0, 0.0, 0.0)),
    "very short crank": ("crank-rocker", CRANK_ROCKER | {"crank": 2.0}, {}, (0.0, 0.0, 0.0)),
    "shortest crank": ("crank-rocker", CRANK_ROCKER | {"crank": 0.05}, {}, (0.0, 0.0, 0.0)),
    "long rocker": (
        "crank-rocker", {"crank": 10.0, "coupler": 100.0, "rocker": 300.0, "ground": 310.0}, {}, (0.0, 0.0, 0.0)
    ),
    "double crank": (
        "crank-rocker", {"crank": 100.0, "coupler": 110.0, "rocker": 90.0, "ground": 40.0}, {}, (0.0, 0.0, 0.0)
    ),
    "knife": ("crank-rocker", KNIFE, {"knife": (80.0, 40.0)}, (0.0, 0.0, 0.0)),
    "turned knife": ("crank-rocker", KNIFE, {"knife": (80.0, 40.0)}, (50.0, -20.0, 200.0)),
    "short rig": (
        "test-rig", {"crank": 5.0, "coupler": 700.0, "rocker": 595.0, "ground": 751.0}, {}, (0.0, 0.0, 0.0)
    ),
    "no offset": ("slider-crank", {"crank": 60.0, "rod": 200.0}, {}, (0.0, 0.0, 0.0)),
    "small offset": ("slider-crank", SLIDER_CRANK | {"offset": 1.0}, {}, (0.0, 0.0, 0.0)),
    "offset below": ("slider-crank", {"crank": 3.0, "rod": 200.0, "offset": -60.0}, {}, (0.0, 0.0, 0.0)),
    **{
        f"{name} at {degrees:g} deg": (name, DESIGNS[name], {}, (70.0, -30.0, degrees))
        for name in ("crank-rocker", "slider-crank") for degrees in (25.0, 90.0, 145.0, 180.0, 270.0)
    },
}  # fmt: skip


def corners(middle, width, height, degrees):
    turn = np.exp(1j * np.radians(degrees))
    return complex(*middle) + turn * np.array([-width - 1j * height, width - 1j * height, width + 1j * height,
                                               -width + 1j * height]) / 2.0  # fmt: skip


def are_apart(first, second):
    """Whether a line along a side of either box separates them."""
    sides = [box[k + 1] - box[k] for box in (first, second) for k in (0, 1)]
    places = [[(box * np.conj(side)).real for box in (first, second)] for side in sides]
    return any(a.max() <= b.min() or b.max() <= a.min() for a, b in places)


@pytest.mark.parametrize("name", SHOWN)
def test_texts_are_upright_clear_of_each_other_and_name_each_length_once(name, tmp_path, monkeypatch):
    """In the DXF as ezdxf reads it, and in the SVG; letters are at most 0.75 of their height wide on average."""
    mechanism, design, points, place = SHOWN[name]
    simulated = DesignOfParameters.read(mechanism, design, points).simulated
    drawing = simulated.drawing.placed(*place) if any(place) else simulated.drawing
    monkeypatch.setattr(SimulatedDesign, "drawing", drawing)
    sheet = draw_sheet(simulated)
    write_dxf(sheet, tmp_path / "a.dxf")
    write_svg(sheet, tmp_path / "a.svg")
    document, height = ezdxf.readfile(tmp_path / "a.dxf"), sheet.height
    in_dxf = [
        (text.dxf.text, text.dxf.insert.x, text.dxf.insert.y, 0.0, "start") for text in layer(document, "text", "TEXT")
    ]
    for dimension in layer(document, "dimensions", "DIMENSION"):
        (text,) = dimension.get_geometry_block().query("MTEXT")
        assert text.dxf.attachment_point == 5, "about its middle"
        degrees = (text.get_rotation() + 180.0) % 360.0 - 180.0
        in_dxf.append((text.text, text.dxf.insert.x, text.dxf.insert.y, degrees, "centre"))
    in_svg = []
    for text in ET.parse(tmp_path / "a.svg").getroot().iter(f"{SVG}text"):
        turned = numbers(text.get("transform", "0"))[0]
        anchor = text.get("text-anchor", "start")
        in_svg.append((text.text, float(text.get("x")), -float(text.get("y")), -turned, anchor))
    for texts in (in_dxf, in_svg):
        boxes = []
        for text, x, y, degrees, anchor in texts:
            assert -90.0 < degrees < 90.0 + 1e-5, text
            width, up = 0.75 * height * len(text), 1j * np.exp(1j * np.radians(degrees)) * height / 2.0
            along = -1j * up / height * 2.0
            middle = complex(x, y) + (0.0 if anchor == "centre" else up) + (anchor == "start") * along * width / 2.0
            boxes.append((text, corners((middle.real, middle.imag), width, height, degrees)))
        met = [
            (first[0], second[0]) for k, first in enumerate(boxes) for second in boxes[:k]
            if not are_apart(first[1], second[1])
        ]  # fmt: skip
        assert not met
        labels = [text for text, *_ in texts]
        for parameter in LENGTHS[mechanism][1]:
            value = abs(design.get(parameter, 0.0))
            wanted = f"{parameter.replace('_', ' ')} {value:.10g}"
            assert labels.count(wanted) == bool(value), wanted


def test_the_distance_of_each_two_pivots_has_the_name_of_the_length_between_them():
    """Three pivots in a row: the second pair is not named after the first length."""
    simulated = DesignOfParameters.read("crank-rocker", CRANK_ROCKER, {}).simulated
    drawing = simulated.drawing
    ground = drawing.points[drawing.pivots[1]]
    third = replace(
        drawing,
        points={**drawing.points, "third": (*ground, Vector("coupler"))},
        pivots=(*drawing.pivots, "third"),
    )
    places = {name: place[0] for name, place in simulated.pose([60.0]).points(third).items()}
    shown = [shape for shape in dimensions(simulated, third, places, 2.5) if isinstance(shape, Distance)]
    level = [(shape.name, shape.value) for shape in shown if shape.start[1] == shape.stop[1] == 0.0]
    assert level == [("ground", 180.0), ("coupler", 170.0)]


def test_a_text_lies_within_the_bounds():
    """Letters are three quarters of their height wide."""
    text = Text("title", np.array([10.0, 20.0]), "four")
    assert bounds([text], 5.0).tolist() == [[10.0, 20.0], [10.0 + 4 * 0.75 * 5.0, 25.0]]


def test_a_movement_fills_its_bounds():
    """The pitch curves of gears in all their positions, as complex numbers, with a margin of a line of text."""
    moved = move(DesignOfParameters.read("gears", DESIGNS["gears"], {}).simulated, np.arange(0.0, 360.0, 0.5))
    turned = []
    for body in moved.bodies:
        x, y = body.curve.points().T
        centres = body.centre[:, :1] + 1j * body.centre[:, 1:]
        turned.append((centres + np.exp(1j * np.radians(body.angle))[:, None] * (x + 1j * y)).ravel())
    places = np.concatenate(turned)
    (left, low), (right, high) = moved.bounds
    found = [places.real.min(), places.imag.min(), places.real.max(), places.imag.max()]
    wanted = [left + moved.height, low + moved.height, right - moved.height, high - moved.height]
    assert found == pytest.approx(wanted, abs=1e-3)  # positions are half a degree apart, points of curves less


def test_the_text_of_a_distance_stands_on_its_line():
    """Pages count y downwards."""
    level = Distance("dimensions", np.zeros(2), np.array([100.0, 0.0]), 10.0, "a")
    assert '<text x="50" y="-11"' in element(level, 2.5)  # on the line at 10, by 0.4 of the height of letters
