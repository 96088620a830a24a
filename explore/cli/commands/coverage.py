"""`explore coverage`: print the swings that a study's cranks reach over the travel of its coupler."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.base.errors import RequestError
from explore.cli.options import JsonOption, output_option
from explore.cli.output import announce_compiling, number, print_json, say
from explore.cli.paths import FIGURE_ENDINGS, check_output, refuse_overwriting
from explore.cli.table_files import with_units
from explore.cli.tables import print_table
from explore.cli.units import UnitsOption, choose_units

if TYPE_CHECKING:
    from explore.analysis.covering import Coverage
    from explore.base.units.shown import Scale
    from explore.model.request import Constraint
    from explore.studies.config.study import Study

#: Largest number of values of a length in a readable table.
_MOST_LENGTHS = 1000
#: Names of the lengths.
_LENGTHS = ("crank", "coupler", "rocker", "ground")


def coverage(
    config: Annotated[
        Path,
        typer.Argument(
            metavar="STUDY",
            help="A study with several cranks, a coupler range and optional transmission-angle bounds.",
        ),
    ],
    output: Annotated[Path | None, output_option(help="Also draw it: FILE.png, .svg or .pdf.")] = None,
    units: UnitsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show which swings exchangeable cranks reach over the travel of the coupler, their overlaps and gaps."""
    from explore.studies.config import toml_text

    check_output(output, FIGURE_ENDINGS)
    toml_text.read_text(str(config))  # reports a missing file before the kernels are compiled
    refuse_overwriting(config, output, "the study")
    from explore.analysis.covering import coverage as cover
    from explore.studies.config.study_file import load_study

    choose_units(units)  # reports a wrong unit before the kernels are compiled
    announce_compiling()
    study = load_study(config)
    shown = choose_units(units, study.units.units)
    travel, cranks, rocker, ground = _lengths(study, config)
    bounds = _transmission_angle_bounds(study.request.constraints)
    declared = cover(cranks, rocker=rocker, ground=ground, coupler=travel, transmission_angle=bounds)
    swings = declared.in_units(shown)
    if as_json:
        print_json(_as_json(swings, shown.scales(declared.table.attrs["units"])))
    else:
        _print(swings)
    if output is not None:
        from explore.figures.charts.coverage import coverage_chart
        from explore.figures.charts.style import save_figure

        save_figure(coverage_chart(swings), output)
        say(str(output), data=not as_json)


def _lengths(study: Study, config: Path) -> tuple[tuple[float, float], list[float], float, float]:
    """Travel of the coupler, cranks, rocker and ground, mm."""
    import numpy as np

    from explore.studies.designs.spaces import ContinuousAxis, ListedAxis, SolvedLength, SpacedAxis

    mechanism = study.request.mechanism
    if set(mechanism.loop_lengths) != {"crank", "coupler", "rocker", "ground"}:
        raise RequestError(
            f"{config}: coverage is of linkages with crank, coupler, rocker and ground, not of {mechanism.name}; "
            "`explore sweep` and then `explore plot map` show what its ranges reach"
        )

    def values(name: str) -> list[float]:
        axis = next((axis for axis in study.space.axes if axis.name == name), None)
        if axis is None or isinstance(axis, SolvedLength):
            raise RequestError(f"{config}: coverage needs crank, coupler, rocker and ground given, but {name} is not")
        if isinstance(axis, ContinuousAxis):
            return [axis.low, axis.high]
        if isinstance(axis, SpacedAxis) and name == "coupler":
            return [axis.start, axis.stop]
        listed = (
            axis
            if isinstance(axis, (ListedAxis, SpacedAxis))
            else ListedAxis(name, tuple(np.unique(axis.values).tolist()))
        )
        if len(listed) > _MOST_LENGTHS:
            raise RequestError(
                f"{config}: coverage takes at most {_MOST_LENGTHS:,} values of {name}, got {len(listed):,}"
            )
        return [float(value) for value in listed.values_at(np.arange(len(listed)))]

    crank, coupler, rocker, ground = (values(name) for name in _LENGTHS)
    for name, lengths in (("rocker", rocker), ("ground", ground)):
        if len(lengths) > 1:
            raise RequestError(f"{config}: coverage takes one rig: give one {name}, not {len(lengths):,}")
    if len(coupler) == 1:
        raise RequestError(
            f"{config}: coverage needs the travel of the coupler; write coupler = {{ start = …, stop = …, num = … }}"
        )
    return (min(coupler), max(coupler)), crank, rocker[0], ground[0]


def _transmission_angle_bounds(constraints: tuple[Constraint, ...]) -> tuple[float, float]:
    """Bounds of the transmission angle, deg; warn about other constraints, which coverage ignores."""
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
            say(f"coverage ignores the constraint on {name}", "yellow")
    return low, high


def _as_json(coverage: Coverage, scales: dict[str, Scale]) -> dict[str, Any]:
    """The table, and the range and the gaps of all swings, named with their unit if that is not the declared one."""
    from explore.base.units.shown import headings

    angles = headings(dict.fromkeys(("total", "gaps"), scales["swing_min"]), ("total", "gaps"))
    return {
        "cranks": with_units(coverage.table, scales).to_dict(orient="records"),
        angles.get("total", "total"): coverage.total,
        angles.get("gaps", "gaps"): coverage.gaps,
    }


def _print(coverage: Coverage) -> None:
    length, angle = coverage.units
    names = ("crank", "coupler", "to", "swing", "to", "overlap")
    columns = [(name, length if k < 3 else angle) for k, name in enumerate(names)]
    rows = [[number(value, 9) for value in row] for row in coverage.table.itertuples(index=False)]
    print_table("Swings of each crank over the travel of the coupler", columns, rows)
    low, high = coverage.total
    for start, end in coverage.gaps:
        say(f"gap: {start:.9g} to {end:.9g} {angle}", data=True)
    if math.isnan(low):
        say("no crank turns with any of these couplers", data=True)
    else:
        say(f"{low:.9g} to {high:.9g} {angle}, {'with gaps' if coverage.gaps else 'without a gap'}", data=True)
