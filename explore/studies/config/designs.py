"""Read the sections [sampling] and [parameters] as the design space."""

import hashlib
import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from explore.base.errors import ConfigError, Problems, RequestError
from explore.base.suggest import closest_name, format_value, suggestion
from explore.model.mechanism import Mechanism
from explore.studies.config.axes import DRAWING_METHODS, read_axes
from explore.studies.config.schema import Sampling
from explore.studies.config.solved_lengths import read_solved_length
from explore.studies.config.table_file import read_table
from explore.studies.designs.samplers import MOST_LATIN_HYPERCUBE, MOST_SOBOL, SAMPLERS
from explore.studies.designs.solved_lengths import SolvedSpace
from explore.studies.designs.spaces import (
    Axis,
    ContinuousAxis,
    DesignSpace,
    Grid,
    ListedAxis,
    Sample,
    SolvedLength,
    Table,
    TableAxis,
)
from explore.studies.request.requests import RequestArguments

SAMPLING_METHODS = ("grid", *SAMPLERS, "table")
#: Largest number of designs, which are numbered in 64 bits.
_MOST_DESIGNS = 2**63 - 1
#: Largest number of designs of each drawing method, the reason, and advice.
_LIMITS = {
    "sobol": (MOST_SOBOL, "the Sobol' sequence has 30 bits", 'use method = "random"'),
    "latin-hypercube": (
        MOST_LATIN_HYPERCUBE,
        "a Latin hypercube is held in memory",
        'use method = "sobol", which fills the ranges as evenly',
    ),
    "random": (_MOST_DESIGNS, "designs are numbered in 64 bits", "draw fewer designs"),
}


def check_sampling(sampling: Sampling, keys: Collection[str], problems: Problems) -> None:
    """Append the problems of the section [sampling]; `keys` are those in the study, valid or not."""
    method, count = sampling.method, sampling.count

    def note(key: str, reason: str) -> None:
        problems.append((("sampling", key), reason))

    if method not in SAMPLING_METHODS:
        note("method", f"unknown method {format_value(method)}; {suggestion(method, SAMPLING_METHODS)}")
        return
    if method == "table":
        if "file" not in keys:
            note("file", 'is missing; name the table of designs, such as file = "designs.csv"')
    elif sampling.file is not None:
        note("file", f'needs method = "table", not "{method}"; remove it or change the method')
    if method in SAMPLERS:
        most, reason, advice = _LIMITS[method]
        if count is None:
            if "count" not in keys:
                note("count", "is missing; say how many designs to draw, such as count = 100000")
        elif count < 1:
            note("count", f"must be at least 1, got {format_value(count)}")
        elif count > most:
            note("count", f"{reason}, which allows at most {most} designs, got {format_value(count)}; {advice}")
        return
    for key, value in (("count", count), ("seed", sampling.seed)):
        if value is not None:
            note(key, f'has no effect with method = "{method}"; remove it or set method = {DRAWING_METHODS}')


def read_space(
    mechanism: Mechanism,
    entries: Mapping[str, Any],
    sampling: Sampling | None,
    folder: Path,
    problems: Problems,
    table_problems: list[str],
    asked: RequestArguments,
) -> DesignSpace | None:
    """Read the design space from the sections [parameters] and [sampling]; it is valid only when there are no problems.

    `sampling` is None when it is wrong; the name of a table is relative to `folder`; a length is solved for over the
    window that the study asks for.
    """
    name = sampling.method if sampling else ""
    # A misspelt method must not cause messages about keys that belong to it.
    method = name if name in SAMPLING_METHODS else closest_name(name, SAMPLING_METHODS)
    axes = read_axes(mechanism, entries, method, problems)
    solved = read_solved_length(mechanism, entries, asked, problems)
    if sampling is None:
        return None
    space: DesignSpace | None
    if method == "table":
        space = _table(mechanism, entries, axes, sampling, folder, problems, table_problems)
    elif problems:
        return None
    else:
        space = _grid(axes, problems) if method == "grid" else _sample(axes, sampling, problems)
    return space if solved is None or space is None else SolvedSpace.over(space, solved)


def _sample(axes: tuple[Axis, ...], sampling: Sampling, problems: Problems) -> Sample:
    space = Sample(axes, sampling.count or 0, sampling.method, sampling.seed or 0)
    if not space.swept_parameters:
        problems.append((("parameters",), "nothing to draw: every parameter is fixed; give one a list or { min, max }"))
    return space


def _grid(axes: tuple[Axis, ...], problems: Problems) -> Grid:
    grid = Grid.over(tuple(axis for axis in axes if not isinstance(axis, ContinuousAxis)))
    if grid.n_designs > _MOST_DESIGNS:
        problems.append((("parameters",), "the grid has more than 2^63 designs, too many to number; make it coarser"))
    return grid


def _table(
    mechanism: Mechanism,
    entries: Mapping[str, Any],
    axes: tuple[Axis, ...],
    sampling: Sampling,
    folder: Path,
    problems: Problems,
    table_problems: list[str],
) -> Table | None:
    if sampling.file is None:
        return None
    try:
        columns = read_table(folder, sampling.file, mechanism, entries)
    except RequestError as error:
        problems.append((("sampling", "file"), str(error)))
        return None
    except ConfigError as error:
        table_problems += error.problems
        return None
    by_name: dict[str, ListedAxis | TableAxis] = {axis.name: axis for axis in axes if isinstance(axis, ListedAxis)}
    by_name |= {name: TableAxis(name, values) for name, values in columns.items()}
    names = [parameter.name for parameter in mechanism.axis_order]
    return Table(tuple(by_name[name] for name in names if name in by_name), len(next(iter(columns.values()))))


def space_content(space: DesignSpace) -> dict[str, object]:
    """Everything that determines the designs, for JSON; equal for equal designs, however the study is written."""
    sampling: dict[str, object] = {"method": space.method}
    base = space.base if isinstance(space, SolvedSpace) else space
    if isinstance(base, Sample):
        sampling |= {"count": space.n_designs, "seed": space.seed}
    table_axes = [axis for axis in space.axes if isinstance(axis, TableAxis)]
    if table_axes:
        # A hash of the values, because the file's name and format do not change the designs.
        values = hashlib.sha256()
        for axis in table_axes:
            values.update(axis.values.astype("<f8").tobytes())
        sampling |= {
            "rows": space.n_designs,
            "columns": [axis.name for axis in table_axes],
            "sha256": values.hexdigest(),
        }
    return {
        "parameters": {a.name: _axis_content(a) for a in space.axes if not isinstance(a, TableAxis)},
        "sampling": sampling,
    }


def _axis_content(axis: Axis | SolvedLength) -> dict[str, object]:
    if isinstance(axis, SolvedLength):
        low, high = (bound if math.isfinite(bound) else None for bound in (axis.low, axis.high))
        return {"solve": axis.metric.name, "value": axis.value, "min": low, "max": high}
    if isinstance(axis, ListedAxis):
        return {"values": axis.values}
    if isinstance(axis, ContinuousAxis):
        return {"min": axis.low, "max": axis.high, "log": axis.log}
    unit = {} if axis.unit == 1 else {"unit": float(axis.unit)}
    return {"start": axis.start, "stop": axis.stop, "num": axis.num, **unit}
