"""The [sampling] and [parameters] of a study file become its design space."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from explore.config.axes import DRAWING_METHODS, read_axes
from explore.config.schema import Problems, Sampling
from explore.config.solved import read_solved
from explore.config.table_file import read_table
from explore.design_space import Axis, Continuous, DesignSpace, Drawn, Grid, Listed, Solved, Table, Tabled
from explore.errors import ConfigError, RequestError
from explore.solving import SolvedSpace
from explore.suggest import closest, shown, suggestion
from explore.unit_cube import MOST_LATIN_HYPERCUBE, MOST_SOBOL, SAMPLERS
from explore.vocabulary import Mechanism

METHODS = ("grid", *SAMPLERS, "table")
#: Designs are numbered in 64 bits.
_MOST_DESIGNS = 2**63 - 1
#: Of each drawing method: the most designs, why, and what to do instead.
_LIMITS = {
    "sobol": (MOST_SOBOL, "the Sobol' sequence has 30 bits", 'use method = "random"'),
    "latin-hypercube": (
        MOST_LATIN_HYPERCUBE,
        "a Latin hypercube is held in memory",
        'use method = "sobol", which fills the ranges as evenly',
    ),
    "random": (_MOST_DESIGNS, "designs are numbered in 64 bits", "draw fewer"),
}


def check_sampling(sampling: Sampling, written: Collection[str], problems: Problems) -> None:
    """Whether the method exists and the other keys go with it. `written` are the section's keys, right or wrong."""
    method, count = sampling.method, sampling.count

    def note(key: str, reason: str) -> None:
        problems.append((("sampling", key), reason))

    if method not in METHODS:
        note("method", f"unknown method {shown(method)}; {suggestion(method, METHODS)}")
        return
    if method == "table":
        if "file" not in written:
            note("file", 'is missing; name the table of designs, such as file = "designs.csv"')
    elif sampling.file is not None:
        note("file", f'belongs to method = "table", not to "{method}"; remove it or change the method')
    if method in SAMPLERS:
        most, why, instead = _LIMITS[method]
        if count is None:
            if "count" not in written:
                note("count", "is missing; say how many designs to draw, such as count = 100000")
        elif count < 1:
            note("count", f"must be at least 1, got {shown(count)}")
        elif count > most:
            note("count", f"{why}, which allows at most {most} designs, got {shown(count)}; {instead}")
        return
    does = "a grid takes every combination" if method == "grid" else "a table gives every design"
    for key, value in (("count", count), ("seed", sampling.seed)):
        if value is not None:
            note(key, f"{does} and draws nothing; remove it or set method = {DRAWING_METHODS}")


def read_space(
    mechanism: Mechanism,
    raw: Mapping[str, Any],
    sampling: Sampling | None,
    folder: Path,
    problems: Problems,
    problems_of_table: list[str],
) -> DesignSpace | None:
    """The design space; only to be used when there are no problems.

    Parameters
    ----------
    mechanism
        Whose parameters.
    raw
        The section [parameters].
    sampling
        The section [sampling]; None when it cannot be understood.
    folder
        Of the study file.
    problems, problems_of_table
        Get what is wrong in the study file and in the file of its table.
    """
    written = sampling.method if sampling else ""
    # A method that is merely misspelt must not make all else look wrong.
    method = written if written in METHODS else closest(written, METHODS)
    axes = read_axes(mechanism, raw, method, problems)
    solved = read_solved(mechanism, raw, problems)
    if sampling is None:
        return None
    free: DesignSpace | None
    if method == "table":
        free = _table(mechanism, raw, axes, sampling, folder, problems, problems_of_table)
    elif problems:
        return None
    else:
        free = _grid(axes, problems) if method == "grid" else _drawn(axes, sampling, problems)
    return free if solved is None or free is None else SolvedSpace.over(free, solved, mechanism)


def _drawn(axes: tuple[Axis, ...], sampling: Sampling, problems: Problems) -> Drawn:
    space = Drawn(axes, sampling.count or 0, sampling.method, sampling.seed or 0)
    if not space.swept:
        problems.append((("parameters",), "nothing to draw: every parameter is fixed; give one a list or { min, max }"))
    return space


def _grid(axes: tuple[Axis, ...], problems: Problems) -> Grid:
    grid = Grid.over(tuple(axis for axis in axes if not isinstance(axis, Continuous)))
    if grid.count > _MOST_DESIGNS:
        problems.append((("parameters",), "the grid has more than 2^63 designs, too many to number; make it coarser"))
    return grid


def _table(
    mechanism: Mechanism,
    raw: Mapping[str, Any],
    axes: tuple[Axis, ...],
    sampling: Sampling,
    folder: Path,
    problems: Problems,
    problems_of_table: list[str],
) -> Table | None:
    if sampling.file is None:
        return None
    try:
        columns = read_table(folder, sampling.file, mechanism, raw)
    except RequestError as error:
        problems.append((("sampling", "file"), str(error)))
        return None
    except ConfigError as error:
        problems_of_table += error.problems
        return None
    found: dict[str, Listed | Tabled] = {axis.name: axis for axis in axes if isinstance(axis, Listed)}
    found |= {name: Tabled(name, values) for name, values in columns.items()}
    names = [parameter.name for parameter in (*mechanism.geometry, mechanism.speed)]
    return Table(tuple(found[name] for name in names if name in found), len(next(iter(columns.values()))))


def space_words(space: DesignSpace) -> dict[str, object]:
    """What determines the designs, for JSON: the same for the same designs however they are written."""
    sampling: dict[str, object] = {"method": space.method}
    free = space.free if isinstance(space, SolvedSpace) else space
    if isinstance(free, Drawn):
        sampling |= {"count": space.count, "seed": space.seed}
    tabled = [axis for axis in space.axes if isinstance(axis, Tabled)]
    if tabled:
        # The values, not the file: neither its name nor how it is written changes a design.
        values = hashlib.sha256()
        for axis in tabled:
            values.update(axis.values.astype("<f8").tobytes())
        sampling |= {"rows": space.count, "columns": [axis.name for axis in tabled], "sha256": values.hexdigest()}
    return {
        "parameters": {a.name: _axis_words(a) for a in space.axes if not isinstance(a, Tabled)},
        "sampling": sampling,
    }


def _axis_words(axis: Axis | Solved) -> dict[str, object]:
    if isinstance(axis, Solved):
        high = None if axis.high == math.inf else axis.high
        return {"solve": axis.metric.name, "value": axis.value, "min": axis.low, "max": high}
    if isinstance(axis, Listed):
        return {"values": axis.values}
    if isinstance(axis, Continuous):
        return {"min": axis.low, "max": axis.high, "log": axis.log}
    return {"start": axis.start, "stop": axis.stop, "num": axis.num}
