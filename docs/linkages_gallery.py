"""Draw the classics of the page on linkages, moving: ``python docs/linkages_gallery.py`` in the repository's root.

Writes docs/linkages-gallery.svg. Each linkage is a design of its starter in the middle of the ranges, or a random one
near it that turns.
"""

import textwrap
import tomllib
from html import escape
from pathlib import Path

import numpy as np

import explore
from explore.base.errors import MotionError
from explore.mechanisms.linkages.drawing import draw_linkage
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.expressions import evaluate_function
from explore.mechanisms.linkages.graph import FOLLOWS, PARTS, operands
from explore.mechanisms.linkages.group_steps import PoseGroup
from explore.mechanisms.linkages.steps import find_steps
from explore.studies.config.study_file import linkage_starter, linkage_starters

PICTURE = Path(__file__).parent / "linkages-gallery.svg"
#: Width of a cell, height of its drawing and of its words, cells of a row, px.
CELL, DRAWING, WORDS, ROW = 196, 150, 52, 5
#: Positions of a turn, and its duration in s.
POSITIONS, DURATION = 48, 6
STYLE = """svg{fill:none;background:#fff;font-family:sans-serif}
.links{stroke:#222;stroke-width:1.8;stroke-linejoin:round;stroke-linecap:round}
.plate{fill:#0072b2;fill-opacity:.12}.slot{stroke:#009e73;stroke-width:5;stroke-opacity:.35;stroke-linecap:round}
.path{stroke:#0072b2;stroke-width:.9}.point{stroke:#d55e00;stroke-width:1.2}
.joint{fill:#fff;stroke:#222;stroke-width:1.2}.still{stroke:#888;stroke-width:1}
.name{fill:#222;font-size:12px;font-weight:bold}.source{fill:#555;font-size:7.5px}"""


def places_of(name):
    """The linkage of a starter; of a design that turns places of points and of ends of moving slots, shape (t, 2)."""
    sections = tomllib.loads(linkage_starter(name))
    linkage, ranges = explore.Linkage(sections), sections["parameters"]
    equations = Equations(linkage.table, find_steps(linkage.table))
    rng = np.random.default_rng(1)
    for share in np.linspace(0.0, 0.5, 200):
        values = {
            key: entry["min"] + (entry["max"] - entry["min"]) * (0.5 + share * rng.uniform(-1.0, 1.0))
            if isinstance(entry, dict)
            else entry
            for key, entry in ranges.items()
            if key != "speed"
        }
        try:
            places = evaluate(equations, values, followed(linkage, values))
        except MotionError:
            continue
        if all(np.isfinite(place).all() for place in places.values()):
            return linkage, places
    raise SystemExit(f"{name}: no design turns")


def followed(linkage, values):
    """Cosines and sines of the two links of a group that no dyad solves, by the names of their operations."""
    for step in find_steps(linkage.table):
        if isinstance(step, PoseGroup):
            motion = explore.simulate(linkage, values, angles=np.linspace(0.0, 360.0, POSITIONS + 1))
            directions = [np.deg2rad(motion[f"{link}_angle"]) for link in (step.first, step.second)]
            parts = [function(each) for each in directions for function in (np.cos, np.sin)]
            return dict(zip(PARTS[: len(parts)], parts, strict=True)) | {FOLLOWS[0]: 1.0}
    return {}


def evaluate(equations, values, followed):
    """Places of all points; NaN where they have none."""
    angles = np.linspace(0.0, 2.0 * np.pi, POSITIONS + 1)
    cosine, sine = np.cos(angles), np.sin(angles)
    inputs = {"@cos": cosine, "@sin": sine} | {
        f"@versine{k}": 1.0 - part for k, part in enumerate((cosine, sine, -cosine, -sine))
    }
    known = {"add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "neg": np.negative,
             "max": np.fmax, "sqrt": np.sqrt, "abs": np.abs, "exact_sum": lambda *terms: sum(terms)}  # fmt: skip
    graph, done = equations.graph, {}
    slots = {slot.name: equations._line(slot) for slot in equations.table.slots if slot.body != "frame"}
    vectors = dict(equations.points) | {f"{name}:start": line[0] for name, line in slots.items()}
    vectors |= {f"{name}:along": line[1] for name, line in slots.items()}
    numbers = [series.terms[0] for place in vectors.values() for series in place]
    with np.errstate(invalid="ignore", divide="ignore"):
        for k in graph.needed(numbers):
            operation, *rest = graph.nodes[k]
            operands_of = [done[each] for each in operands(graph.nodes[k])]
            if operation in ("constant", "input"):
                done[k] = float(rest[0]) if operation == "constant" else inputs.get(rest[0], values.get(rest[0]))
            elif operation in followed:
                done[k] = followed[operation]
            elif operation in known:
                done[k] = known[operation](*operands_of)
            else:  # a function of the design
                done[k] = evaluate_function(operation, *map(float, operands_of))
    shape = np.zeros(POSITIONS + 1)
    places = {name: np.stack([shape + done[series.terms[0].index] for series in place], axis=1)
              for name, place in vectors.items()}  # fmt: skip
    for slot in equations.table.slots:
        if slot.name in slots:
            along, start = places.pop(f"{slot.name}:along"), places[f"{slot.name}:start"]
            ways = np.sum((places[slot.pin] - start) * along, axis=1)
            for end, way in (("first", min(ways.min(), 0.0)), ("last", max(ways.max(), 0.0))):
                places[f"{slot.name}:{end}"] = start + along * way
    return places


def moving(kind, points, style):
    """A polyline or polygon through moving points, shape (t, n, 2)."""
    lists = [" ".join(f"{x:.1f},{y:.1f}" for x, y in place) for place in points]
    return f'<{kind} class="{style}" points="{lists[0]}">{animate("points", lists)}</{kind}>'


def animate(name, values):
    return f'<animate attributeName="{name}" dur="{DURATION}s" repeatCount="indefinite" values="{";".join(values)}"/>'


def draw(name):
    """The elements of a cell."""
    linkage, places = places_of(name)
    drawing = draw_linkage(linkage.table)
    everything = np.vstack(list(places.values()))
    low, high = everything.min(axis=0), everything.max(axis=0)
    scale = min((CELL - 40) / max(high[0] - low[0], 1e-9), (DRAWING - 40) / max(high[1] - low[1], 1e-9))
    middle, centre = (low + high) / 2.0, np.array([CELL, DRAWING]) / 2.0
    shown = {point: (place - middle) * [scale, -scale] + centre for point, place in places.items()}
    parts = [guide(shown[each.point], each.angle) for each in drawing.guides]
    for path in drawing.paths:
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in shown[path.point])
        parts.append(f'<polyline class="{"point" if path.role == "point" else "path"}" points="{line}"/>')
    for slot in linkage.table.slots:
        if slot.body != "frame":
            ends = np.stack([shown[f"{slot.name}:first"], shown[f"{slot.name}:last"]], axis=1)
            parts.append(moving("polyline", ends, "slot"))
            for slide in (each for each in linkage.table.slides if each.link == slot.body):
                for point in linkage.table.body_of[slide.link].place_of:
                    stem = np.stack([shown[f"{slot.name}:start"], shown[point]], axis=1)
                    parts.append(moving("polyline", stem, "links"))
    parts += [pivot(*shown[point][0]) for point in drawing.pivots]
    for link in drawing.links:
        chain = np.stack([shown[point] for point in link.points], axis=1)
        parts.append(moving("polyline", chain, "links plate" if len(link.points) > 3 else "links"))
    joints = dict.fromkeys(point for link in drawing.links for point in link.points if point not in drawing.pivots)
    for point in joints:
        x, y = shown[point].T
        ways = animate("cx", [f"{v:.1f}" for v in x]) + animate("cy", [f"{v:.1f}" for v in y])
        parts.append(f'<circle class="joint" r="2.6" cx="{x[0]:.1f}" cy="{y[0]:.1f}">{ways}</circle>')
    return parts


def guide(places, angle):
    """The line of a pin in a slot of the frame, a little longer than its way."""
    along = np.array([np.cos(np.deg2rad(angle)), -np.sin(np.deg2rad(angle))])
    ways = (places - places[0]) @ along
    (ax, ay), (bx, by) = (places[0] + along * way for way in (ways.min() - 8.0, ways.max() + 8.0))
    return f'<path class="still" d="M{ax:.1f},{ay:.1f} L{bx:.1f},{by:.1f}"/>'


def pivot(x, y):
    """A pivot of the frame."""
    return (
        f'<path class="still" d="M{x:.1f},{y:.1f} l-5,8 h10 z m-8,8 h16"/>'
        f'<circle class="joint" r="2.6" cx="{x:.1f}" cy="{y:.1f}"/>'
    )


def words(name):
    """The name of a classic and its source."""
    source = linkage_starter(name).partition("# Source: ")[2].partition("\n\n")[0].replace("\n#", "")
    lines = textwrap.wrap(source, 48, max_lines=4, placeholder=" …")
    rows = [
        f'<text class="source" x="8" y="{DRAWING + 24 + 9 * k}">{escape(line)}</text>' for k, line in enumerate(lines)
    ]
    return [f'<text class="name" x="8" y="{DRAWING + 12}">{name}</text>', *rows]


def main():
    names = list(linkage_starters())
    cells = []
    for number, name in enumerate(names):
        x, y = number % ROW * CELL, number // ROW * (DRAWING + WORDS)
        cells.append(f'<g transform="translate({x} {y})">' + "\n".join([*draw(name), *words(name)]) + "</g>")
        print(name, len(cells[-1]), flush=True)
    width, height = ROW * CELL, -(-len(names) // ROW) * (DRAWING + WORDS)
    PICTURE.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">\n'
        f"<title>{len(names)} linkages, moving</title>\n<style>\n{STYLE}\n</style>\n" + "\n".join(cells) + "\n</svg>\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
