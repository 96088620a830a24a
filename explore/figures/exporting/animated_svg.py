"""An animation as one SVG without scripts: SMIL, one turn after the other, or to and fro."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from explore.figures.exporting.movement import DURATION, Body, move
from explore.figures.exporting.shapes import Circle
from explore.figures.exporting.svg import at, document, element, number, path_data
from explore.figures.exporting.symbols import JOINT
from explore.figures.simulation import SimulatedDesign
from explore.model.quantities import FloatArray

#: Number of positions of a turn, between which points move straight: this shortens a link by 0.02 %.
_POSITIONS = 180


def write_animated_svg(simulated: SimulatedDesign, path: Path) -> None:
    """Write an animation."""
    angles = simulated.span.once(_POSITIONS)
    movement = move(simulated, np.append(angles, simulated.span.first + (360.0 if simulated.span.is_turn else 0.0)))
    still = [element(shape, movement.height) for shape in movement.still if shape.layer == "paths"]
    frame = [(shape.layer, element(shape, movement.height)) for shape in movement.still if shape.layer != "paths"]
    parts = [
        _group("paths", still),
        _group("profiles", [_body(body) for body in movement.bodies]),
        *(_group(layer, [text]) for layer, text in frame),
        _group("links", [_moving("polyline", chain) for chain in movement.chains]),
        _group("links", [_moving("polygon", block) for block in movement.sliders]),
        _group("links", [_joint(places, JOINT * movement.height) for places in movement.joints]),
    ]
    low, high = movement.bounds
    path.write_text(document(movement.title, low, high, movement.height, "\n".join(parts)), encoding="utf-8")


def _group(layer: str, elements: Iterable[str]) -> str:
    return f'<g class="{layer}">\n' + "\n".join(elements) + "\n</g>"


def _animate(name: str, values: Iterable[str], kind: str = "animate", more: str = "") -> str:
    """An attribute that goes through values, evenly in time, and begins again."""
    return (
        f'<{kind} attributeName="{name}"{more} dur="{number(DURATION)}s" repeatCount="indefinite" '
        f'values="{";".join(values)}"/>'
    )


def _moving(kind: str, points: FloatArray) -> str:
    """Straight lines through moving points, shape (t, n, 2)."""
    lists = [" ".join(map(at, positions)) for positions in points]
    fill = ' class="white"' if kind == "polygon" else ""
    return f'<{kind}{fill} points="{lists[0]}">{_animate("points", lists)}</{kind}>'


def _joint(places: FloatArray, radius: float) -> str:
    """A circle at a moving place, shape (t, 2)."""
    start = element(Circle("links", places[0], radius), 0.0).removesuffix("/>")
    across, down = ([number(value) for value in column] for column in (places * [1.0, -1.0]).T)
    return f"{start}>{_animate('cx', across)}{_animate('cy', down)}</circle>"


def _body(body: Body) -> str:
    """The curve of a body, turning rigidly, with a line from its centre to where the curve begins."""
    spoke = f'<path d="M0,0 L{at(body.curve.controls[0])}"/>'
    turns = [number(-angle) for angle in body.angle]  # clockwise is positive in SVG
    turning = _animate("transform", turns, "animateTransform", ' type="rotate"')
    inner = f'<g transform="rotate({turns[0]})">{turning}<path d="{path_data(body.curve)}"/>{spoke}</g>'
    return f'<g transform="translate({at(body.centre[0])})">{inner}</g>'
