"""Read the section [linkage.loads.curves]: values over a place or the crank angle, in a list or in a CSV file."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from explore.base.entries import is_known, read_table
from explore.base.errors import KeyPath, RequestError
from explore.base.suggest import format_value
from explore.base.units.quantities import quantity
from explore.mechanisms.linkages.coordinate import Place
from explore.mechanisms.linkages.load_table import CRANK_ANGLE, FROM_LEAST, TO_GREATEST, Curve
from explore.studies.linkages.coordinates import read_pair, value_of
from explore.studies.linkages.names import reason_against
from explore.studies.linkages.parameters import Located
from explore.studies.linkages.structure import SECTION, Structure
from explore.studies.request.target_files import FileColumn, read_target_file

#: Example of a curve.
CURVE = 'cut = { over = "ram", points = [[0, 0], [2, 900], [5, 0]] }'

_KEYS = ("over", "points", "file", "shape")
_SHAPES = ("linear", "cubic")
_POINT_KEYS = ("point", "along")
_POINT = '{ point = "P", along = [0, -1] }'
#: Largest number of points of all curves together: each takes up to seven operations.
_MOST_POINTS = 200
#: A turn of the crank, deg.
_TURN = 360.0


class CurveReader:
    """The curves of a structure, with the coordinates of their directions; problems are appended to its own.

    `names` are those of all curves, and `lowest` the least value of each one without problems.
    """

    def __init__(
        self, structure: Structure, output: str, moving: Sequence[str], folder: Path | None, *, turns: bool
    ) -> None:
        self._structure, self._output, self._moving, self._folder = structure, output, moving, folder
        self._turns, self._problems = turns, structure.problems
        self._sliders = structure.sliders
        self.names: set[str] = set()
        self.lowest: dict[str, float] = {}
        self.coordinates: list[Located] = []

    def read(self, entries: Mapping[str, Any]) -> tuple[Curve, ...]:
        """The curves of a section."""
        self.names = {*entries}
        curves = tuple(self._curve(name, entry) for name, entry in entries.items())
        if (count := sum(len(curve.points) for curve in curves)) > _MOST_POINTS:
            key = (SECTION, "loads", "curves")
            self._problems.append((key, f"have {count:,} points together; at most {_MOST_POINTS} are possible"))
        return curves

    def _curve(self, name: str, entry: object) -> Curve:
        key = (SECTION, "loads", "curves", name)
        structure = self._structure
        taken = {*structure.points, *structure.bodies, *self._sliders}
        for each in (name, f"{name}_place", f"{name}_value"):
            if each in taken:
                self._problems.append((key, f"{each} is the name of something else; choose another"))
        if reason := reason_against(name):
            self._problems.append((key, reason))
        given = read_table(entry, key, _KEYS, CURVE, self._problems)
        if ("points" in given) == ("file" in given):
            reason = "has both points and a file; leave one out" if "file" in given else "has no points"
            self._problems.append((key, f"{reason}; a complete one is {CURVE}"))
        if "over" not in given:
            self._problems.append((key, f"the key 'over' is missing; a complete one is {CURVE}"))
        over = self._over(given.get("over", CRANK_ANGLE), (*key, "over"))
        shape = given.get("shape", _SHAPES[0])
        is_known(shape, (*key, "shape"), _SHAPES, "shape", self._problems)
        turns = self._output in structure.bodies and self._output not in self._sliders
        of_angle = over == CRANK_ANGLE or (over in (FROM_LEAST, TO_GREATEST) and turns)
        points = self._points(given, key, "deg" if of_angle else "mm")
        if over == CRANK_ANGLE and "over" in given and self._turns and points:
            (first, start), (last, stop) = points[0], points[-1]
            if last - first != _TURN:
                reason = f"the crank turns fully, and the points span {last - first:g} deg; write them for 360 deg"
                self._problems.append((key, reason))
            elif start != stop:
                reason = f"{first:g} and {last:g} deg are the same angle, with the values {start:g} and {stop:g}"
                self._problems.append((key, reason))
        self.lowest[name] = min((y for _, y in points), default=0.0)
        return Curve(name, over, points, shape == _SHAPES[1])

    # what it is over

    def _over(self, entry: object, key: KeyPath) -> str | tuple[str, Place]:
        if isinstance(entry, Mapping):
            return self._along(entry, key)
        known = (*self._sliders, CRANK_ANGLE, FROM_LEAST, TO_GREATEST)
        is_known(entry, key, known, f"slot or way, or a point such as {_POINT},", self._problems)
        if entry in (FROM_LEAST, TO_GREATEST) and not self._turns:
            self._problems.append((key, "a linkage with a range has no strokes, whose ends places are measured from"))
        elif entry in (FROM_LEAST, TO_GREATEST) and not self._output:
            self._problems.append((key, "is measured from an end of the stroke of the output; name one, output = ..."))
        return str(entry)

    def _along(self, entry: Mapping[str, Any], key: KeyPath) -> str | tuple[str, Place]:
        given = read_table(entry, key, _POINT_KEYS, _POINT, self._problems)
        missing = [word for word in _POINT_KEYS if word not in given]
        self._problems += [(key, f"the key '{word}' is missing; a complete one is {_POINT}") for word in missing]
        if missing:
            return CRANK_ANGLE
        is_known(given["point"], (*key, "point"), self._moving, "moving point", self._problems)
        direction = read_pair(given["along"], (*key, "along"), self._problems)
        if not any(part.names or value_of(part, {}) for part in direction):
            self._problems.append(((*key, "along"), "has no direction; write one such as [0, -1]"))
        self.coordinates += [(part, (*key, "along"), "mm") for part in direction]
        return str(given["point"]), direction

    # points

    def _points(self, given: Mapping[str, Any], key: KeyPath, unit: str) -> tuple[tuple[float, float], ...]:
        """The points; none after problems of theirs are noted."""
        word = "file" if "file" in given else "points"
        if word not in given:
            return ()
        try:
            return _checked(self._from_file(given[word], unit) if word == "file" else _from_list(given[word], unit))
        except RequestError as error:
            self._problems.append(((*key, word), str(error)))
            return ()

    def _from_file(self, file: object, unit: str) -> list[list[float]]:
        if self._folder is None:
            raise RequestError("no file is read here; write its rows as points")
        return read_target_file(self._folder, file, (FileColumn("place", unit), FileColumn("value", "1")))


def _from_list(entry: object, unit: str) -> list[list[float]]:
    if not isinstance(entry, list | tuple):
        raise RequestError(f"must be a list such as [[0, 0], [2, 900]], got {format_value(entry)}")
    rows = []
    for number, row in enumerate(entry, 1):
        if not isinstance(row, list | tuple) or len(row) != 2:
            raise RequestError(f"point {number} must be a pair [place, value], got {format_value(row)}")
        try:
            rows.append([quantity(row[0], unit), quantity(row[1], "1")])
        except RequestError as error:
            raise RequestError(f"point {number}: {error}") from None
    return rows


def _checked(rows: list[list[float]]) -> tuple[tuple[float, float], ...]:
    """The points of rows with ascending places."""
    points = tuple((x + 0.0, y + 0.0) for x, y in rows)
    if len(points) < 2:
        raise RequestError(f"has {len(points)} points; write two or more")
    if not all(math.isfinite(number) for point in points for number in point):
        raise RequestError("has a number that is not finite")
    for number, ((x, _), (after, _)) in enumerate(pairwise(points), 2):
        if not x < after:
            raise RequestError(f"places must ascend, and point {number} is at {after:g} after {x:g}")
    return points
