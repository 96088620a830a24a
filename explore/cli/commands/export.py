"""`explore export`: write a design as files for CAD and other tools."""

from pathlib import Path
from typing import Annotated

import typer

from explore.base.errors import RequestError
from explore.cli.options import DesignOption, DesignResultsArgument, MechanismOption, PointOption, output_option
from explore.cli.output import announce_compiling, say
from explore.cli.paths import check_output, newest_results
from explore.cli.settings import list_settings, parse_points, parse_settings

#: Formats of solids, which a planar mechanism is not.
_SOLIDS = (".step", ".stp", ".iges", ".igs", ".stl")
#: Endings of names, which are formats.
ENDINGS = (".toml", ".csv", ".hdf5", ".mat", ".dxf", ".svg", ".gif", ".mp4")


def export(
    results: DesignResultsArgument = None,
    design: DesignOption = None,
    mechanism: MechanismOption = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="A parameter; a unit may follow.")
    ] = None,
    points: PointOption = None,
    output: Annotated[
        list[Path] | None,
        output_option(
            help="A file, as often as wanted: the design as a study .toml; its motion .csv, .hdf5, .mat; the drawing "
            ".dxf, .svg; the mechanism moving .gif, .mp4, .animated.svg."
        ),
    ] = None,
) -> None:
    """Write a design as files for CAD and other tools: study, motion, drawing, animation."""
    if not output:
        raise RequestError("name a file: -o wiper.dxf, and others by -o again")
    for path in output:
        if path.suffix.lower() in _SOLIDS:
            raise RequestError(f"-o {path}: there are no solids to write; .dxf has the drawing for a sketch in CAD")
        check_output(path, ENDINGS)
    if mechanism is not None and (results is not None or design is not None):
        raise RequestError("--mechanism takes its parameters from --set; leave out RESULTS and --design")
    if mechanism is None and (settings or points):
        raise RequestError("--set and --point are those of a --mechanism; a design of results has its own")
    from explore.figures.exporting.formats import export as write_design

    if mechanism is None:
        from explore.results.store.open_results import open_results
        from explore.running.chosen import chosen_designs

        opened = open_results(results or newest_results())
        number = int(chosen_designs(opened, design).index[0])
        announce_compiling()
        write_design(opened, output, design=number)
        say(f"design {number} of {opened.path}")
    else:
        parameters, places = parse_settings(mechanism, settings or []), parse_points(points or [])
        announce_compiling()
        write_design(mechanism, output, parameters=parameters, points=places)
        say(list_settings(parameters))
    for path in output:
        say(f"wrote {path}")
