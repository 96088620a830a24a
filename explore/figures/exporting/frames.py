"""An animation as pictures: GIF, or MP4 by the program ffmpeg."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from explore.base.errors import ResultsError
from explore.figures.exporting.movement import DURATION, Movement, move
from explore.figures.exporting.shapes import Arc, Circle, Polyline, Spline, arc_points, rotation
from explore.figures.exporting.symbols import JOINT
from explore.figures.simulation import SimulatedDesign
from explore.model.quantities import FloatArray

if TYPE_CHECKING:
    from PIL.Image import Image as Picture
    from PIL.ImageDraw import ImageDraw

#: Number of positions of a turn, or of a way to and fro, one picture each.
POSITIONS = 100
#: Larger side of a picture, px.
_SIDE = 640
#: Factor by which a picture is drawn larger to smooth its lines.
_SMOOTHING = 3
#: Colour of links and joints.
_INK = "#222222"
#: Colour of paths.
_PATH = "#0072b2"
#: Colour of profiles.
_BODY = "#009e73"


def write_gif(simulated: SimulatedDesign, path: Path) -> None:
    """Write an animation of one turn, or one way to and fro, that begins again for ever."""
    from PIL import Image

    pictures = list(_pictures(simulated))
    # One palette for all pictures: a few colours, and no flicker. A body may hide a path in one of two positions.
    width, height = pictures[0].size
    both = Image.new("RGB", (width, 2 * height))
    both.paste(pictures[0], (0, 0))
    both.paste(pictures[POSITIONS // 3], (0, height))
    palette = both.quantize(64)
    first, *others = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures)
    duration = round(1000.0 * DURATION / POSITIONS)
    # Kept apart, equal pictures are not merged, and each is there for the same time.
    first.save(path, "GIF", save_all=True, append_images=others, duration=duration, loop=0, disposal=1)


def has_ffmpeg() -> bool:
    """Whether the program that makes MP4 is installed."""
    return shutil.which("ffmpeg") is not None


def write_mp4(simulated: SimulatedDesign, path: Path) -> None:
    """Write a film of the same; `ResultsError` if ffmpeg fails."""
    pictures = list(_pictures(simulated))
    width, height = pictures[0].size
    command = [
        shutil.which("ffmpeg") or "ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24",
        "-s", f"{width}x{height}", "-r", f"{POSITIONS / DURATION:g}", "-i", "-", "-pix_fmt", "yuv420p",
        "-movflags", "+faststart", "-f", "mp4", str(path),
    ]  # fmt: skip
    stream = b"".join(picture.tobytes() for picture in pictures)
    done = subprocess.run(command, input=stream, capture_output=True, check=False)  # noqa: S603 -- no shell
    if done.returncode:
        *_, reason = done.stderr.decode(errors="replace").strip().splitlines() or ["no reason given"]
        raise ResultsError(f"ffmpeg failed: {reason}")


def _pictures(simulated: SimulatedDesign) -> Iterator[Picture]:
    """A picture for each position of a turn or a way to and fro, the last before it begins again."""
    from PIL import Image, ImageDraw

    movement = move(simulated, simulated.span.once(POSITIONS))
    paper = _Paper(movement)
    ground = Image.new("RGB", paper.size, "white")
    paper.draw_still(ImageDraw.Draw(ground), movement)
    size = (paper.size[0] // _SMOOTHING, paper.size[1] // _SMOOTHING)
    for k in range(POSITIONS):
        picture = ground.copy()
        paper.draw_moving(ImageDraw.Draw(picture), movement, k)
        yield picture.resize(size, Image.Resampling.BOX)


class _Paper:
    """The pixels of a part of the plane."""

    def __init__(self, movement: Movement) -> None:
        self._low, self._high = movement.bounds
        extent = self._high - self._low
        self._scale = _SMOOTHING * _SIDE / float(extent.max())
        # Even numbers of pixels, as films need them.
        width, height = (2 * _SMOOTHING * round(side * self._scale / (2 * _SMOOTHING)) for side in extent.tolist())
        self.size = (width, height)
        self._joint = JOINT * movement.height

    def _pixels(self, points: FloatArray) -> list[tuple[float, float]]:
        places = np.column_stack([points[:, 0] - self._low[0], self._high[1] - points[:, 1]]) * self._scale
        return [(x, y) for x, y in places.tolist()]

    def _line(self, draw: ImageDraw, points: FloatArray, colour: str, width: float) -> None:
        pixels = self._pixels(points)
        thickness = round(width * _SMOOTHING)
        draw.line(pixels, fill=colour, width=thickness, joint="curve")

    def _disc(self, draw: ImageDraw, centre: FloatArray, radius: float) -> None:
        ((x, y),) = self._pixels(centre[None])
        size = radius * self._scale
        draw.ellipse((x - size, y - size, x + size, y + size), fill="white", outline=_INK, width=2 * _SMOOTHING)

    def draw_still(self, draw: ImageDraw, movement: Movement) -> None:
        """Paths, guides and pivots."""
        for shape in movement.still:
            colour, width = (_PATH, 1.2) if shape.layer == "paths" else (_INK, 1.5)
            if isinstance(shape, Circle) and shape.layer != "paths":
                self._disc(draw, shape.centre, shape.radius)
            elif isinstance(shape, (Circle, Arc, Spline)):
                self._line(draw, _points(shape), colour, width)
            elif isinstance(shape, Polyline):
                points = np.vstack([shape.points, shape.points[:1]]) if shape.closed else shape.points
                self._line(draw, points, colour, width)

    def draw_moving(self, draw: ImageDraw, movement: Movement, k: int) -> None:
        """Bodies, links, sliders and joints in one position."""
        for body in movement.bodies:
            turned = rotation(float(body.angle[k])).T
            curve = body.curve.points() @ turned + body.centre[k]
            self._line(draw, curve, _BODY, 2.0)
            self._line(draw, np.array([body.centre[k], curve[0]]), _BODY, 1.5)
            self._disc(draw, body.centre[k], self._joint)
        for chain in movement.chains:
            self._line(draw, chain[k], _INK, 3.0)
        for block in movement.sliders:
            draw.polygon(self._pixels(block[k]), fill="white", outline=_INK, width=2 * _SMOOTHING)
        for places in movement.joints:
            self._disc(draw, places[k], self._joint)
        for shape in movement.still:
            if isinstance(shape, Circle) and shape.layer == "pivots":
                self._disc(draw, shape.centre, shape.radius)


def _points(shape: Circle | Arc | Spline) -> FloatArray:
    """Points of a curve, near enough for pixels."""
    if isinstance(shape, Spline):
        return shape.points()
    start, stop = (shape.start, shape.stop) if isinstance(shape, Arc) else (0.0, 360.0)
    return arc_points(shape.centre, shape.radius, np.linspace(start, stop, 241))
