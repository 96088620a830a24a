"""Task "function": four-bars whose rocker turns as a function of what their crank turns."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from explore.base.errors import Problems, RequestError
from explore.base.suggest import format_value
from explore.model.columns import Column
from explore.model.progress import ReportProgress
from explore.model.target_kinds import STARTS
from explore.model.targets import FunctionTarget
from explore.studies.request.target_entries import read_rows
from explore.studies.request.target_files import FileColumn
from explore.synthesis.candidates import SOLUTION, Candidates
from explore.synthesis.functions import FourBarGenerator, branch_of, fit_four_bar, wrapped
from explore.synthesis.laws import Law, chebyshev_points, formula_law, remarks_on_angles, table_law
from explore.synthesis.linkages import distinct
from explore.synthesis.tasks.contract import MOST_CANDIDATES, Task, TaskSections, TaskType
from explore.synthesis.tasks.placed_four_bars import FORMULAS, LENGTHS, FourBarBounds
from explore.synthesis.tasks.sections import SectionReader
from explore.synthesis.turning_generators import FoundGenerator, FunctionTask, find_turning_generators, is_same

#: Number of values of x over which the search takes its mean.
_N_SEARCHED = 101
#: Number of values of x at which the target asks for the output.
_N_ASKED = 401
#: Largest number of precision points.
_MOST_POINTS = 100
#: Columns of a file of pairs.
_COLUMNS = (FileColumn("x", "1"), FileColumn("y", "1"))
#: Bounds on the transmission angle that are searched beside a smaller one that is asked for, deg.
_FLOORS = (30.0, 40.0, 50.0)
#: Column with the way in which a linkage was found.
_METHOD = Column(
    "method", "", "how the linkage was found", "bookkeeping", "|i1", {1: "precision_points", 2: "least_error"}
)
#: Names of the initial angles.
_STARTS = tuple(parameter.name for parameter in STARTS)
#: Sentences on the ways in which linkages are found.
_SENTENCES = {
    "precision_points": "Freudenstein's equation holds at the precision points, or nearly at more than three",
    "least_error": "the error of the output itself is least in the mean, among linkages nearby; its starts are free",
}


@dataclass(frozen=True)
class _Search:
    """The function, and what a linkage has to meet.

    What crank and rocker turn over the range, and their angles at its start, rad, None where they are free; the number
    of precision points of the linkage with these starts; the length of the ground, mm; bounds on the transmission angle
    and the ratio of links; the largest error of the output, rad, which linkages may miss only where all do. `count` is
    the largest number of candidates.
    """

    law: Law
    turns: tuple[float, float]
    starts: tuple[float, float] | None
    n_points: int
    ground: float
    bounds: FourBarBounds
    error_max: float
    count: int

    def find(self, _: ReportProgress | None) -> Candidates:
        """The candidates: first the one with the given starts, then those of the least error with free ones."""
        found, tried = self._least_errors()
        kept = [each for each in found if each.error_max <= self.error_max]
        if found and not kept:
            tried.append(f"none has an error of {np.degrees(self.error_max):g} deg or less; these come nearest")
        elif len(kept) < len(found):
            tried.append(f"left out {len(found) - len(kept)} with an error above {np.degrees(self.error_max):g} deg")
            found = kept
        methods = [2] * len(found)
        if self.starts is not None:
            try:
                found.insert(0, self._at_precision_points(self.starts))
                methods.insert(0, 1)
            except RequestError as error:
                tried.append(f"at the given starts: {error}")
        if not found:
            raise RequestError("; ".join(tried))
        generators = [each.generator for each in found]
        lengths = np.array([(abs(each.crank), each.coupler, abs(each.rocker), 1.0) for each in generators])
        starts = np.degrees(wrapped(np.array([(each.input_start, each.output_start) for each in found])))
        parameters = {name: self.ground * lengths[:, k] for k, name in enumerate(LENGTHS)}
        # The branch of `output_angles` counts from the rocker's pivot, that of the mechanism from the crank's pin.
        parameters["branch"] = np.array([-float(each.branch) for each in generators])
        parameters |= {name: starts[:, k] for k, name in enumerate(_STARTS)}
        return Candidates(
            parameters=parameters,
            added=(SOLUTION, _METHOD),
            values={"solution": np.arange(1, len(found) + 1), "method": np.array(methods)},
            tried=tuple(tried),
            sentences=_SENTENCES,
            most=self.count,
            always=tuple(np.flatnonzero(np.array(methods) == 1).tolist()),
        )

    def _least_errors(self) -> tuple[list[FoundGenerator], list[str]]:
        """Generators of the least true error within the bounds, and within higher transmission angles."""
        x = self.law.even(_N_SEARCHED)
        inputs, outputs = self.law.inputs(x, self.turns[0]), self.law.outputs(x, self.turns[1])
        asked, ratio = self.bounds.transmission_angle_min, self.bounds.link_ratio_max
        floors = [asked, *(floor for floor in _FLOORS if floor > asked)]
        found: list[FoundGenerator] = []
        tried = (
            f"searched four-bars whose crank turns, with transmission angles of at least "
            f"{', '.join(f'{floor:g}' for floor in floors)} deg and links within a ratio of {ratio:g}"
        )
        for floor in floors:
            try:
                found += find_turning_generators(FunctionTask(inputs, outputs, math.radians(floor), ratio))
            except RequestError as error:
                if floor == asked:
                    return [], [str(error)]
        best = distinct(sorted(found, key=lambda each: each.error_rms), is_same)  # one may be best with several bounds
        return best, [f"{tried}: those of least error, each a local optimum"]

    def _at_precision_points(self, starts: tuple[float, float]) -> FoundGenerator:
        """The linkage of Freudenstein's equation with given starts; lengths are positive."""
        x = chebyshev_points(self.law.first, self.law.last, self.n_points)
        inputs = starts[0] + self.law.inputs(x, self.turns[0])
        fitted = fit_four_bar(inputs, starts[1] + self.law.outputs(x, self.turns[1]))
        lengths = abs(fitted.crank), fitted.coupler, abs(fitted.rocker)
        # A negative length is a link in the opposite direction.
        crank, rocker = math.pi * (fitted.crank < 0.0), math.pi * (fitted.rocker < 0.0)
        branch = branch_of(np.array(lengths), inputs + crank, fitted.outputs(inputs) + rocker)
        generator = FourBarGenerator(*lengths, branch)
        return FoundGenerator(generator, starts[0] + crank, starts[1] + rocker, math.nan, math.nan)

    @property
    def target(self) -> FunctionTarget:
        """The function as the target of a study."""
        x = self.law.even(_N_ASKED)
        turned = self.law.inputs(x, self.turns[0]), self.law.outputs(x, self.turns[1])
        return FunctionTarget(tuple(zip(*np.degrees(turned).tolist(), strict=True)))


def _read(sections: TaskSections, problems: Problems) -> Task | None:
    target = sections.target
    law, table = _read_law(target, sections.folder, problems)
    turns = tuple(_read_turn(target, key, most) for key, most in (("input_angle", 360.0), ("output_angle", 180.0)))
    starts = [target.number(key, "deg", default=math.nan) for key in ("input_start", "output_start")]
    given = [key for key in ("input_start", "output_start") if key in target]
    if len(given) == 1:
        target.note(given[0], "give input_start and output_start, or neither, and both are found")
    n_points = target.count("precision_points", 3, _MOST_POINTS)
    if n_points < 3:
        target.note("precision_points", f"three or more determine a linkage, not {n_points}")
    ground = target.number("ground", "mm", default=100.0, above=0.0)
    bounds = FourBarBounds.read(sections.bounds)
    error = sections.bounds.number("output_error_max", "deg", default=2.0, above=0.0)
    count = sections.search.count("count", 20, MOST_CANDIDATES)
    if problems or law is None:
        return None
    radians = tuple(math.radians(turn) for turn in turns)
    fixed_starts = (math.radians(starts[0]), math.radians(starts[1])) if given else None
    search = _Search(law, (radians[0], radians[1]), fixed_starts, n_points, ground, bounds, math.radians(error), count)
    return Task(
        mechanism="crank-rocker",
        find=search.find,
        parameters=(*LENGTHS, "branch", *_STARTS),
        fixed=("ground",),
        objectives=("output_error_max:min", "transmission_angle_worst:max", "footprint:min"),
        metrics=(
            "output_error_rms",
            "output_error_max",
            "transmission_angle_min",
            "transmission_angle_max",
            "link_ratio",
        ),
        constraints={**bounds.constraints, "output_error_max": {"max": error}},
        formulas=FORMULAS,
        target=search.target.to_content(),
        given={"table": table} if table else {},
        window="cycle",  # a rocker that turns fully has no strokes
        remarks=[(("target", "formula"), text) for text in remarks_on_angles(target.get("formula"), law)],
    )


def _read_turn(target: SectionReader, key: str, most: float) -> float:
    turn = target.number(key, "deg", "60", least=-most, below=most)
    if turn == 0.0:
        target.note(key, "must not be 0")
    return turn


def _read_law(target: SectionReader, folder: Path, problems: Problems) -> tuple[Law | None, Any]:
    """The function, from a formula with a range or a table of pairs, of a file too, and its table, None without one.

    The function is None after a mistake is noted.
    """
    formula, tables = target.get("formula"), target.entries("table", "file")
    if (formula is None) == (not tables):
        key = next(iter(tables), "formula")
        target.note(key, 'give one of formula = "log(x)" with from and to, or table = [[1, 0], [2, 0.3], [3, 0.48]]')
        return None, None
    if formula is None:
        own = Problems()
        rows, source = read_rows(tables, "table", _COLUMNS, folder, own)
        problems += [(("target", *key), reason) for key, reason in own]
        return (_read_table(target, rows, source), rows) if source else (None, None)
    first, last = target.number("from", "1", "1"), target.number("to", "1", "2")
    if not isinstance(formula, str):
        target.note("formula", f'must be a string such as "log(x)", got {format_value(formula)}')
    elif first == last:
        target.note("to", "must differ from from")
    elif math.isfinite(first - last):
        try:
            return formula_law(formula, first, last), None
        except RequestError as error:
            target.note("formula", str(error))
    return None, None


def _read_table(target: SectionReader, table: object, source: str) -> Law | None:
    def is_pair(row: object) -> bool:
        return (
            isinstance(row, Sequence) and len(row) == 2
            and all(isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in row)
        )  # fmt: skip

    if not isinstance(table, list) or not all(is_pair(row) for row in table):
        target.note(source, "must be a list of pairs of numbers x and y, such as [[1, 0], [2, 0.3], [3, 0.48]]")
        return None
    try:
        return table_law([row[0] for row in table], [row[1] for row in table])
    except RequestError as error:
        target.note(source, str(error))
        return None


TYPE = TaskType("function", "a four-bar whose rocker turns as a function of what its crank turns", _read)
