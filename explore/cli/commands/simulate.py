"""`explore simulate`: print the motion of one design."""

from __future__ import annotations

import math
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from explore.base.errors import MotionError, RequestError
from explore.base.json_text import json_text
from explore.cli.completion import complete_mechanisms
from explore.cli.options import JsonOption, PointOption, output_option
from explore.cli.output import announce_compiling, count_of, print_json, say
from explore.cli.paths import check_new_file, refuse_overwriting
from explore.cli.settings import Places, list_settings, parse_points, parse_settings
from explore.cli.table_files import with_units
from explore.cli.units import UnitsOption, choose_units, units_of_designs

if TYPE_CHECKING:
    import pandas as pd

    from explore.base.units.shown import ShownUnits
    from explore.studies.config.study import Study


def simulate(
    config: Annotated[
        Path | None, typer.Argument(metavar="STUDY", help="A study; --design picks one of its designs.")
    ] = None,
    mechanism: Annotated[
        str | None,
        typer.Option(autocompletion=complete_mechanisms, help="A mechanism, with --set in place of a study."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A parameter, in place of the study's; a unit may follow."),
    ] = None,
    points: PointOption = None,
    design: Annotated[int, typer.Option(min=0, help="The number of the design in the study.")] = 0,
    angles: Annotated[int, typer.Option(min=1, help="The number of equispaced input angles.")] = 360,
    method: Annotated[
        str, typer.Option(help="Solver: closed-form, or newton, rk45 … of its loops, see `explore precision`.")
    ] = "closed-form",
    output: Annotated[
        Path | None, output_option(help="The file, CSV unless it ends in .json; by default stdout.")
    ] = None,
    units: UnitsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print all signals of one design over a turn, such as angles, velocities and forces."""
    from explore.studies.config import toml_text

    if (config is None) == (mechanism is None):
        raise RequestError("name either a study or --mechanism with its --set NAME=VALUE")
    if config:
        toml_text.read_text(str(config))  # reports a missing file before the kernels are compiled
        refuse_overwriting(config, output, "the study")
    if output is not None:
        check_new_file(output)
    from explore.base.units.shown import in_units
    from explore.running.public import simulate as simulate_motion

    announce_compiling()
    if config:
        from explore.studies.config.study_file import load_study

        study = load_study(config)
        shown = choose_units(units, study.units.units)
        places = parse_points(points or [], shown)
        told = units_of_designs(units, study)
        name, parameters, places = _study_design(study, config, design, settings or [], places, told)
        target = study.request.mechanism.target
    else:
        shown, name, target = choose_units(units), mechanism or "", None
        places = parse_points(points or [], shown)
        parameters = parse_settings(name, settings or [], units=shown)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        motion = simulate_motion(name, parameters, points=places, target=target, angles=angles, method=method)
    for warning in caught:
        say(f"warning: {warning.message}", "yellow")
    if left_out := motion.attrs["left_out"]:
        others = f" and {len(left_out) - 1} more" if len(left_out) > 1 else ""
        say(f"left out: {left_out[0]}{others}, which only the closed form has", "yellow")
    scales = shown.scales(motion.attrs["units"])
    _write(with_units(in_units(motion, scales), scales), output, as_json=as_json)


def _study_design(
    study: Study, config: Path, design: int, settings: list[str], places: Places, units: ShownUnits
) -> tuple[str, dict[str, float], Places]:
    """The mechanism of a study, and one of its designs, with the given parameters and points in place of its own.

    `units` are those in which the design is told, and of settings without one.
    """
    from explore.model.points import coordinates
    from explore.model.status import Status

    n_designs = study.space.n_designs
    if design >= n_designs:
        raise RequestError(
            f"{config} has {count_of(n_designs, 'design')}, numbered from 0; there is no design {design}"
        )
    name, points = study.request.mechanism.name, study.request.mechanism.points
    own = {key: float(values[0]) for key, values in study.space.designs(design, design + 1).items()}
    replaced = parse_settings(name, settings, points, units, study.request.mechanism.target)
    unreachable = [key for key, value in own.items() if math.isnan(value) and key not in replaced]
    if unreachable:
        raise MotionError(f"design {design} of {config} has no {unreachable[0]}: {Status.UNREACHABLE.sentence}")
    scales = units.scales({p.name: p.unit for p in study.request.mechanism.parameters})
    exceptions = f", but {list_settings(replaced, scales)}" if replaced else ""
    say(f"design {design} of {n_designs:,}: {list_settings(own, scales)}{exceptions}")
    parameters = own | replaced
    return name, parameters, {**coordinates(points, parameters), **places}


def _write(motion: pd.DataFrame, output: Path | None, *, as_json: bool) -> None:
    columns = {str(name): column.tolist() for name, column in motion.reset_index().items()}
    if output is None:
        if as_json:
            print_json(columns)
        else:
            motion.to_csv(sys.stdout)
        return
    from explore.results.store.outputs import new_output

    with new_output(output) as unfinished:
        if as_json or output.suffix.lower() == ".json":
            unfinished.write_text(json_text(columns) + "\n", encoding="utf-8")
        else:
            motion.to_csv(unfinished)
    say(f"wrote {len(motion)} {str(motion.index.name).replace('_', ' ')}s to {output}")
