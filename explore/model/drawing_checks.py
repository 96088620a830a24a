"""Checks of a mechanism's drawing and panels: names that exist."""

from collections.abc import Iterator
from itertools import chain

from explore.model.declaration import Declaration
from explore.model.drawing import INPUT
from explore.model.name_checks import unknown_names


def check_drawing(declaration: Declaration) -> Iterator[str]:
    """Problems of a declaration's drawing and panels: names that do not exist."""
    signals = {signal.name: signal.unit for signal in declaration.signals}
    for panel in declaration.panels:
        units = {signals.get(name, "") for name in panel.signals}
        yield from unknown_names("signal", panel.signals, signals, f"the panel '{panel.label}'")
        if len(units) > 1:
            yield f"the panel '{panel.label}' has signals in different units"
    drawing = declaration.drawing
    if drawing is None:
        return
    lengths = {p.name for p in declaration.parameters if p.unit == "mm"} | {s for s, u in signals.items() if u == "mm"}
    angles = {INPUT, *(name for name, unit in signals.items() if unit == "deg")}
    of_profiles = (profile.vectors for profile in drawing.profiles)
    for vector in chain(*drawing.points.values(), *of_profiles):
        if isinstance(vector.length, str) and vector.length not in lengths:
            yield f"the drawing names the length '{vector.length}', which is no parameter or signal in mm"
        if isinstance(vector.angle, str) and vector.angle not in angles:
            yield f"the drawing names the angle '{vector.angle}', which is no signal in deg"
    named = [point for link in drawing.links for point in link.points]
    named += [*drawing.pivots, *(guide.point for guide in drawing.guides), *(path.point for path in drawing.paths)]
    named += [profile.centre for profile in drawing.profiles]
    named += [drawing.stroke_point] if drawing.stroke_point else []
    yield from unknown_names("point", named, drawing.points, "the drawing")
    for profile in drawing.profiles:
        if profile.angle not in angles:
            yield f"the profile '{profile.name}' turns by '{profile.angle}', which is no signal in deg"
