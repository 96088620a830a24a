"""`explore coverage`: the swings that a study's cranks reach over the travel of its coupler."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from explore.cli.output import compiled_kernels, number, print_json, print_table, refuse_same, say
from explore.errors import RequestError

if TYPE_CHECKING:
    from explore.covering import Coverage
    from explore.study import Study
    from explore.vocabulary import Constraint

_LENGTHS = ("crank", "coupler", "rocker", "ground")


def print_coverage(config: Path, output: Path | None, *, as_json: bool) -> None:
    """Print the table, say gaps and overlaps, and draw the figure if asked for."""
    from explore.cli.plots import check_figure

    check_figure(output)
    refuse_same(output, config, "the study")
    with compiled_kernels():
        from explore.config.study_file import load_study
        from explore.covering import coverage
    study = load_study(config)
    travel, cranks, rocker, ground = _lengths(study, config)
    found = coverage(
        cranks, rocker=rocker, ground=ground, coupler=travel, transmission_angle=_bounds(study.request.constraints)
    )
    if as_json:
        print_json({"cranks": found.table.to_dict(orient="records"), "total": found.total, "gaps": found.gaps})
    else:
        _print(found)
    if output is not None:
        from explore.charts.coverage import coverage_chart
        from explore.charts.style import save

        save(coverage_chart(found), output)
        say(str(output), data=not as_json)


def _lengths(study: Study, config: Path) -> tuple[tuple[float, float], list[float], float, float]:
    """Travel of the coupler, cranks, rocker and ground, mm."""
    from explore.design_space import Continuous, Listed, Solved, Spaced

    def values(name: str) -> list[float]:
        axis = next((axis for axis in study.space.axes if axis.name == name), None)
        if axis is None or isinstance(axis, Solved):
            raise RequestError(f"{config}: coverage needs crank, coupler, rocker and ground given, but {name} is not")
        if isinstance(axis, Continuous):
            return [axis.low, axis.high]
        if isinstance(axis, Spaced):
            return [axis.start, axis.stop] if name == "coupler" else [float(v) for v in axis.at(np.arange(axis.num))]
        return [float(value) for value in (axis.values if isinstance(axis, Listed) else np.unique(axis.values))]

    crank, coupler, rocker, ground = (values(name) for name in _LENGTHS)
    for name, found in (("rocker", rocker), ("ground", ground)):
        if len(found) > 1:
            raise RequestError(f"{config}: coverage is of one rig, but {name} has {len(found):,} values; give one")
    if len(coupler) == 1:
        raise RequestError(
            f"{config}: coverage needs the travel of the coupler; write coupler = {{ start = …, stop = …, num = … }}"
        )
    return (min(coupler), max(coupler)), crank, rocker[0], ground[0]


def _bounds(constraints: tuple[Constraint, ...]) -> tuple[float, float]:
    """Bounds of the transmission angle, deg; a constraint on anything else is told of as not looked at."""
    low, high = 0.0, 180.0
    for constraint in constraints:
        name, minimum, maximum = constraint.metric.name, constraint.minimum, constraint.maximum
        if name == "transmission_angle_min" and maximum is None:
            low = max(low, minimum or 0.0)
        elif name == "transmission_angle_max" and minimum is None:
            high = min(high, maximum or 0.0)
        elif name == "transmission_angle_worst" and maximum is None:
            low, high = max(low, minimum or 0.0), min(high, 180.0 - (minimum or 0.0))
        else:
            say(f"coverage does not look at the constraint on {name}", "yellow")
    return low, high


def _print(coverage: Coverage) -> None:
    columns = [("crank", "mm"), ("coupler", "mm"), ("to", "mm"), ("swing", "deg"), ("to", "deg"), ("overlap", "deg")]
    rows = [[number(value, 9) for value in row] for row in coverage.table.itertuples(index=False)]
    print_table("Swings of each crank over the travel of the coupler", columns, rows)
    low, high = coverage.total
    for start, end in coverage.gaps:
        say(f"gap: {start:.9g} to {end:.9g} deg", data=True)
    if np.isnan(low):
        say("no crank turns with any of these couplers", data=True)
    else:
        say(f"{low:.9g} to {high:.9g} deg, {'with gaps' if coverage.gaps else 'without a gap'}", data=True)
