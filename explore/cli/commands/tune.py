"""`explore tune`: vary one parameter of a design, and find where a metric is within a range."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.base.errors import MotionError, RequestError, ResultsError
from explore.cli.completion import complete_mechanisms, complete_metrics, complete_parameters
from explore.cli.options import JsonOption
from explore.cli.output import announce_compiling, number, print_json, say, shown_unit
from explore.cli.paths import FIGURE_ENDINGS, check_output, newest_results, refuse_overwriting
from explore.cli.settings import list_settings, number_or_text, parse_settings
from explore.cli.table_files import ENDINGS, check_table, with_units, write_table
from explore.cli.tables import print_table
from explore.cli.tuning_sentences import describe_tuning, wanted_values
from explore.cli.units import UnitsOption, choose_units, units_of

if TYPE_CHECKING:
    from explore.analysis.tuning.control_curve import Tuning
    from explore.base.units.shown import Scale, ShownUnits
    from explore.results.store.results import Results

#: Number of lines of the printed table.
_N_LINES = 11


def tune(
    results: Annotated[
        Path | None,
        typer.Argument(metavar="RESULTS", help="A results file with the design; by default the newest results/*.h5."),
    ] = None,
    design: Annotated[
        int | None, typer.Option(min=0, help="The design of the results; by default the best of the Pareto set.")
    ] = None,
    mechanism: Annotated[
        str | None,
        typer.Option(autocompletion=complete_mechanisms, help="A mechanism, with --set in place of results."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A parameter, in place of the design's; a unit may follow."),
    ] = None,
    parameter: Annotated[str, typer.Option(autocompletion=complete_parameters, help="The parameter to vary.")] = "",
    metric: Annotated[
        list[str] | None,
        typer.Option(
            autocompletion=complete_metrics,
            help="The metric whose range is wanted, by default the first objective. Again: show this one too.",
        ),
    ] = None,
    low: Annotated[
        str | None, typer.Option("--from", metavar="VALUE", help="The smallest wanted value; a unit may follow.")
    ] = None,
    high: Annotated[str | None, typer.Option("--to", metavar="VALUE", help="The largest wanted value.")] = None,
    window: Annotated[
        str | None,
        typer.Option(help="With --mechanism: the part of the turn of statistics; by default the mechanism's own."),
    ] = None,
    drive: Annotated[
        str | None, typer.Option(help='With --mechanism: the stroke that the window "drive" means.')
    ] = None,
    start: Annotated[
        str | None, typer.Option(metavar="VALUE", help="The smallest value of the parameter to look at.")
    ] = None,
    stop: Annotated[
        str | None, typer.Option(metavar="VALUE", help="The largest value of the parameter to look at.")
    ] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", help="Also write the curve: a figure .png, .svg, .pdf; .csv, .json, .md."),
    ] = None,
    units: UnitsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Vary one parameter of a design: its metrics over it, and where one of them is within a range."""
    if not parameter:
        raise RequestError("name the parameter to vary: --parameter NAME")
    if mechanism is not None and (results is not None or design is not None):
        raise RequestError("--mechanism takes its parameters from --set; leave out RESULTS and --design")
    if mechanism is None and (window, drive) != (None, None):
        raise RequestError("the study of the results sets window and drive; leave out --window and --drive")
    for path in output or []:
        check_output(path, (*FIGURE_ENDINGS, *ENDINGS))
        if path.suffix.lower() in ENDINGS:
            check_table(path)
    if mechanism is not None:
        name, shown, arguments = mechanism, choose_units(units), _defaults(mechanism)
        parameters = parse_settings(mechanism, settings or [], units=shown)
        arguments |= {"window": window, "drive": drive}
    else:
        from explore import open_results

        path = results or newest_results()
        for other in output or []:
            refuse_overwriting(path, other, "the results file")
        source = open_results(path)
        name, shown = source.mechanism, units_of(source, units)
        parameters, arguments = _design_of(source, design, parameter, settings or [], shown)
    announce_compiling()
    from explore.analysis.tuning.control_curve import tune as find_curve

    objectives, constraints = arguments.pop("metrics"), arguments.pop("constraints", {})
    metrics = metric or objectives
    if not metrics:
        raise RequestError("name the metric whose range is wanted: --metric NAME")
    arguments |= {"parameter": parameter, "metric": metrics[0], "also": metrics[1:]}
    scales = _scales(name, arguments, constraints, shown)
    texts = {"low": low, "high": high, "start": start, "stop": stop}
    tuning = find_curve(name, parameters, **arguments, **_read_ends(texts, parameter, metrics[0], scales))
    shown_tuning = tuning.in_units(scales)
    say(list_settings(parameters, scales))
    if as_json:
        print_json(_as_json(shown_tuning, scales))
    else:
        _print(shown_tuning, _sentences(name))
    _say_constraints(tuning, constraints, name, parameters, arguments, scales)
    for path in output or []:
        _write(shown_tuning, path, scales)
        say(f"wrote {path}")


def _scales(
    mechanism: str, arguments: Mapping[str, Any], constraints: Iterable[str], units: ShownUnits
) -> dict[str, Scale]:
    """The scale of each parameter, metric and constraint; none where no unit is chosen."""
    if not units:
        return {}
    from explore.studies.request.names import find_mechanism
    from explore.studies.request.requests import make_request

    declared = find_mechanism(mechanism, arguments.get("points", ()), arguments.get("target"))
    names = list(dict.fromkeys([arguments["metric"], *arguments["also"], *constraints]))
    options: dict[str, Any] = {name: arguments.get(name) for name in ("window", "drive", "formulas")}
    metrics = make_request(declared, metrics=names, **options).all_metrics
    return units.scales({quantity.name: quantity.unit for quantity in (*metrics, *declared.parameters)})


def _read_ends(
    texts: Mapping[str, str | None], parameter: str, metric: str, scales: Mapping[str, Scale]
) -> dict[str, Any]:
    """The given ends of both ranges; numbers without a unit are in the shown one."""
    ends: dict[str, Any] = {}
    for (first, last), name in ((("low", "high"), metric), (("start", "stop"), parameter)):
        for side in (first, last):
            text = texts[side]
            if text is None:
                continue
            try:
                ends[side] = number_or_text(text, scales.get(name))
            except RequestError as error:
                raise RequestError(f"`{side}`: {error}") from None
        numbers: list[Any] = [ends.get(side) for side in (first, last)]
        if name in scales and all(isinstance(value, float) for value in numbers) and numbers[0] > numbers[1]:
            raise RequestError(f"`{first}` = {texts[first]} is above `{last}` = {texts[last]}")
    return ends


def _defaults(mechanism: str) -> dict[str, Any]:
    """The metrics where none is named: the objectives of the mechanism."""
    from explore.studies.request.names import find_mechanism

    return {"metrics": [text.partition(":")[0] for text in find_mechanism(mechanism).objectives]}


def _sentences(mechanism: str) -> Mapping[str, str]:
    from explore.studies.request.names import find_mechanism

    return find_mechanism(mechanism).status_sentences


def _design_of(
    results: Results, design: int | None, parameter: str, settings: Sequence[str], units: ShownUnits
) -> tuple[dict[str, float], dict[str, Any]]:
    """Parameters of a design of results, and what its study asks for, as arguments of `tune`."""
    import tomllib

    from explore.results.queries import choose_design

    path = results.path
    chosen = choose_design(results, design)
    row = results.design(chosen)
    parameters = {column.name: float(row[column.name]) for column in results.columns if column.role == "parameter"}
    parameters |= parse_settings(results.mechanism, settings, results.points, units, results.target)
    for name, value in list(parameters.items()):
        if math.isnan(value):
            if name != parameter:
                raise RequestError(f"design {chosen} of {path} has no {name}; give one with --set {name}=VALUE")
            del parameters[name]
    say(f"design {chosen} of {path}")
    try:
        formulas = tomllib.loads(results.config).get("metrics")
    except tomllib.TOMLDecodeError as error:
        raise ResultsError(f"{path} is damaged: its study cannot be read: {error}") from None
    arguments = {
        "window": results.window or None,
        "drive": results.drive or None,
        "formulas": formulas,
        "points": results.points,
        "target": results.target,
        "metrics": [name for name in (text.partition(":")[0] for text in results.objectives) if name not in parameters],
        "constraints": results.constraints,
    }
    return parameters, arguments


def _say_constraints(
    tuning: Tuning,
    constraints: Mapping[str, Mapping[str, float | None]],
    name: str,
    parameters: Mapping[str, float],
    arguments: Mapping[str, Any],
    scales: Mapping[str, Scale],
) -> None:
    """Say where in the intervals a constraint of the study holds, if it does not everywhere."""
    from explore.analysis.tuning.control_curve import tune as find_curve

    for interval in tuning.intervals:
        first, last = interval.start.parameter, interval.stop.parameter
        for metric, sides in constraints.items():
            if not first < last:
                continue
            bounds = {"low": sides["min"], "high": sides["max"], "start": first, "stop": last}
            try:
                part = find_curve(name, parameters, **{**arguments, "metric": metric, "also": (), **bounds})
            except MotionError:
                say(f"within it {metric}, which the study constrains, is undefined", "yellow")
                continue
            if [(own.start.parameter, own.stop.parameter) for own in part.intervals] != [(first, last)]:
                part = part.in_units(scales)
                unit = shown_unit(part.curve.attrs["units"][part.parameter])
                ranges = [(own.start.parameter, own.stop.parameter) for own in part.intervals]
                places = ", ".join(f"{number(a, 13)} to {number(b, 13)} {unit}".rstrip() for a, b in ranges)
                place = f"only for {tuning.parameter} {places}" if places else "nowhere"
                say(f"within it the study's constraint {metric} {wanted_values(part)} holds {place}", "yellow")


def _print(tuning: Tuning, sentences: Mapping[str, str]) -> None:
    """Print the intervals, what is out of reach, and a table of the curve."""
    for line in describe_tuning(tuning, sentences):
        say(line, data=True)
    curve, units = tuning.curve, tuning.curve.attrs["units"]
    names = [str(name) for name in curve if name != "piece"]
    rows = [[number(float(curve[name].iloc[line])) for name in names] for line in _table_lines(tuning)]
    print_table("control curve", [(name, units[name]) for name in names], rows, hint="-o FILE.csv writes all")


def _table_lines(tuning: Tuning) -> list[int]:
    """Rows of the curve that are evenly spread over the intervals, or over all of it where there are none."""
    places = tuning.curve[tuning.parameter].to_numpy()
    ends = [end.parameter for interval in tuning.intervals for end in (interval.start, interval.stop)]
    low, high = (min(ends), max(ends)) if ends else (places.min(), places.max())
    wanted = [low + (high - low) * k / (_N_LINES - 1) for k in range(_N_LINES)]
    return sorted({int(abs(places - value).argmin()) for value in wanted})


def _as_json(tuning: Tuning, scales: Mapping[str, Scale]) -> dict[str, Any]:
    from explore.base.units.shown import headings

    names = headings(scales, (tuning.parameter, tuning.metric))
    return {
        "parameter": names.get(tuning.parameter, tuning.parameter),
        "metric": names.get(tuning.metric, tuning.metric),
        "bounds": tuning.bounds,
        "intervals": [asdict(interval) for interval in tuning.intervals],
        "reach": [asdict(end) for end in tuning.reach],
        "curve": with_units(tuning.curve, scales).to_dict(orient="records"),
    }


def _write(tuning: Tuning, path: Path, scales: Mapping[str, Scale]) -> None:
    """Write the curve as a figure or as a table, by the ending of the name."""
    if path.suffix.lower() in ENDINGS:
        table = with_units(tuning.curve, scales)
        write_table(table.set_index(str(table.columns[0])), path, tuning.curve.attrs["units"])
        return
    from explore.figures.charts.style import save_figure
    from explore.figures.charts.tuning import tuning_chart

    save_figure(tuning_chart(tuning), path)
