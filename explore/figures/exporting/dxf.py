"""A drawing as DXF of the release 2010: millimetres, layers, and dimensions that CAD programs can measure again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from explore.figures.exporting.shapes import LAYERS, SMALL, Angle, Arc, Circle, Distance, Shape, Sheet, Spline, Text

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.layouts.layout import Modelspace

_STYLE = "explore"
#: Colour (an index of AutoCAD's), width of lines in 0.01 mm, and linetype of each layer.
_LOOKS = {
    "paths": (5, 25, "CONTINUOUS"),
    "limit positions": (8, 25, "DIVIDE"),
    "profiles": (3, 35, "CONTINUOUS"),
    "guides": (7, 35, "CONTINUOUS"),
    "pivots": (7, 35, "CONTINUOUS"),
    "links": (7, 50, "CONTINUOUS"),
    "dimensions": (1, 18, "CONTINUOUS"),
    "text": (7, 25, "CONTINUOUS"),
}
#: Pattern of the linetype with two dots of extreme positions (ISO 128): dash, gaps and dots, in heights of text.
_DIVIDE = (4.0, -0.7, 0.0, -0.7, 0.0, -0.7)
#: Bit of a spline that is closed.
_CLOSED = 1
#: Bit of a planar spline.
_PLANE = 8


def write_dxf(sheet: Sheet, path: Path) -> None:
    """Write a drawing."""
    from ezdxf import units
    from ezdxf.document import Drawing as Document

    document = Document.new("R2010")
    document.units = units.MM
    document.header["$MEASUREMENT"] = 1
    pattern = [sheet.height * part for part in _DIVIDE]
    document.linetypes.add("DIVIDE", [sum(map(abs, pattern)), *pattern], description="__ . . __ . . __")
    for name in LAYERS:
        colour, width, linetype = _LOOKS[name]
        document.layers.add(name, color=colour, lineweight=width, linetype=linetype)
    _add_dimension_style(document, sheet)
    space = document.modelspace()
    for shape in sheet.shapes:
        _add(space, shape, sheet.height)
    low, high = sheet.bounds
    document.set_modelspace_vport(height=float(1.1 * (high - low).max()), center=tuple((low + high) / 2.0))
    space.reset_extents((*low, 0.0), (*high, 0.0))
    document.saveas(path)


def _add_dimension_style(document: Drawing, sheet: Sheet) -> None:
    """Dimensions in millimetres with up to four decimals, sized by the height of texts; eight where one is small."""
    style, height = document.dimstyles.add(_STYLE), sheet.height
    is_small = any(shape.value < SMALL for shape in sheet.shapes if isinstance(shape, Distance))
    colour = _LOOKS["dimensions"][0]
    values: dict[str, Any] = {
        "dimtxt": height, "dimasz": 0.9 * height, "dimexe": 0.5 * height, "dimexo": 0.3 * height,
        "dimgap": 0.35 * height, "dimlfac": 1.0, "dimdec": 8 if is_small else 4, "dimadec": 4, "dimzin": 8,
        "dimazin": 2, "dimtad": 1, "dimtih": 0, "dimtoh": 0, "dimtmove": 2, "dimdsep": ord("."), "dimtxsty": "Standard",
        "dimclrd": colour, "dimclre": colour, "dimclrt": colour,
    }  # fmt: skip
    for name, value in values.items():
        style.dxf.set(name, value)


def _add(space: Modelspace, shape: Shape, height: float) -> None:
    """Add an entity of the kind that is edited most easily."""
    look = {"layer": shape.layer}
    if isinstance(shape, Circle):
        space.add_circle(shape.centre, shape.radius, dxfattribs=look)
    elif isinstance(shape, Arc):
        space.add_arc(shape.centre, shape.radius, shape.start % 360.0, shape.stop % 360.0, dxfattribs=look)
    elif isinstance(shape, Spline):
        spline = space.add_spline(dxfattribs={**look, "flags": _PLANE | (_CLOSED if shape.is_closed else 0)})
        spline.knots = shape.knots
        spline.control_points = np.column_stack([shape.controls, np.zeros(len(shape.controls))])
    elif isinstance(shape, Text):
        text = shape.text.replace("^", "^ ")  # a caret begins the code of a control character
        space.add_text(text, height=height, dxfattribs=look).set_placement(shape.place)
    elif isinstance(shape, (Distance, Angle)):
        _add_dimension(space, shape, look)
    elif len(shape.points) == 2:
        space.add_line(shape.points[0], shape.points[1], dxfattribs=look)
    else:
        space.add_lwpolyline(shape.points, close=shape.closed, dxfattribs=look)


def _add_dimension(space: Modelspace, shape: Distance | Angle, look: dict[str, str]) -> None:
    """A dimension with the block that shows it, for programs that do not draw dimensions themselves."""
    if isinstance(shape, Distance):
        text = f"{shape.name} <>".strip()
        dimension = space.add_aligned_dim(
            shape.start, shape.stop, shape.offset, text=text, dimstyle=_STYLE, dxfattribs=look
        )
    else:
        arc = shape.arc
        dimension = space.add_angular_dim_cra(
            arc.centre, arc.radius, arc.start, arc.stop, shape.radius - arc.radius, dimstyle=_STYLE, dxfattribs=look
        )
    dimension.render()
