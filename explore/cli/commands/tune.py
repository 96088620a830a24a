"""`explore tune`: vary one parameter of a design, and find where a metric is within a range."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.base.errors import MotionError, RequestError
from explore.cli.completion import complete_metrics, complete_parameters
from explore.cli.options import DesignOption, DesignResultsArgument, JsonOption, MechanismOption, output_option
from explore.cli.output import announce_compiling, number, print_json, say, shown_unit
from explore.cli.paths import newest_results, refuse_overwriting
from explore.cli.settings import list_settings, number_or_text, parse_settings
from explore.cli.table_files import check_outputs, with_units, write_output
from explore.cli.tables import print_table
from explore.cli.tuning_sentences import describe_tuning, wanted_values
from explore.cli.units import UnitsOption, choose_units, units_of

if TYPE_CHECKING:
    from explore.analysis.tuning.control_curve import Tuning
    from explore.base.units.shown import Scale, ShownUnits

#: Number of lines of the printed table.
_N_LINES = 11

_value_option = partial(typer.Option, metavar="VALUE")


def tune(
    results: DesignResultsArgument = None,
    design: DesignOption = None,
    mechanism: MechanismOption = None,
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
    low: Annotated[str | None, _value_option("--from", help="The smallest wanted value; a unit may follow.")] = None,
    high: Annotated[str | None, _value_option("--to", help="The largest wanted value.")] = None,
    window: Annotated[
        str | None,
        typer.Option(help="With --mechanism: the part of the turn of statistics; by default the mechanism's own."),
    ] = None,
    drive: Annotated[
        str | None, typer.Option(help='With --mechanism: the stroke that the window "drive" means.')
    ] = None,
    start: Annotated[str | None, _value_option(help="The smallest value of the parameter to look at.")] = None,
    stop: Annotated[str | None, _value_option(help="The largest value of the parameter to look at.")] = None,
    output: Annotated[
        list[Path] | None, output_option(help="Also write the curve: a figure .png, .svg, .pdf; .csv, .json, .md.")
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
    check_outputs(output or [])
    if mechanism is not None:
        subject = _subject_of_mechanism(mechanism, settings or [], choose_units(units), window, drive)
    else:
        path = results or newest_results()
        for other in output or []:
            refuse_overwriting(path, other, "the results file")
        subject = _subject_of_results(path, design, parameter, settings or [], units)
    metrics = metric or subject.metrics
    if not metrics:
        raise RequestError("name the metric whose range is wanted: --metric NAME")
    announce_compiling()
    asked = subject.arguments | {"parameter": parameter, "metric": metrics[0], "also": metrics[1:]}
    scales = _scales(subject, asked)
    texts = {"low": low, "high": high, "start": start, "stop": stop}
    tuning = _find_curve(subject, asked | _read_ends(texts, parameter, metrics[0], scales))
    shown = tuning.in_units(scales)
    say(list_settings(subject.parameters, scales))
    if as_json:
        print_json(_as_json(shown, scales))
    else:
        from explore.studies.request.names import find_mechanism

        _print(shown, find_mechanism(subject.mechanism).status_sentences)
    _say_constraints(tuning, subject, asked, scales)
    for path in output or []:
        table = with_units(shown.curve, scales)
        table = table.set_index(str(table.columns[0]))
        write_output(path, table, shown.curve.attrs["units"], "tuning", shown)


@dataclass(frozen=True)
class _Subject:
    """A design to vary, the units to show, the metrics and constraints of its study, and arguments of `tune`."""

    mechanism: str
    parameters: dict[str, float]
    units: ShownUnits
    metrics: list[str]
    constraints: Mapping[str, Mapping[str, float | None]]
    arguments: dict[str, Any]


def _subject_of_mechanism(
    mechanism: str, settings: Sequence[str], units: ShownUnits, window: str | None, drive: str | None
) -> _Subject:
    """The design of the settings; its metrics are the objectives of the mechanism."""
    from explore.studies.request.names import find_mechanism

    metrics = [text.partition(":")[0] for text in find_mechanism(mechanism).objectives]
    parameters = parse_settings(mechanism, settings, units=units)
    return _Subject(mechanism, parameters, units, metrics, {}, {"window": window, "drive": drive})


def _subject_of_results(
    path: Path, design: int | None, parameter: str, settings: Sequence[str], texts: Sequence[str] | None
) -> _Subject:
    """A design of results with the settings in place of its own, and what its study asks for."""
    from explore.results.queries import choose_design
    from explore.results.store.open_results import open_results
    from explore.studies.config.linkage import mechanism_of

    results = open_results(path)
    mechanism = mechanism_of(results).name
    units, chosen = units_of(results, texts), choose_design(results, design)
    row = results.design(chosen)
    parameters = {column.name: float(row[column.name]) for column in results.columns if column.role == "parameter"}
    parameters |= parse_settings(mechanism, settings, results.points, units, results.target)
    for name, value in list(parameters.items()):
        if math.isnan(value):
            if name != parameter:
                raise RequestError(f"design {chosen} of {path} has no {name}; give one with --set {name}=VALUE")
            del parameters[name]
    say(f"design {chosen} of {path}")
    arguments = {
        "window": results.window or None,
        "drive": results.drive or None,
        "formulas": results.sections.get("metrics"),
        "points": results.points,
        "target": results.target,
    }
    metrics = [text.partition(":")[0] for text in results.named_objectives]
    metrics = [name for name in metrics if name not in parameters]
    constraints = {name: sides for name, sides in results.constraints.items() if name not in results.given}
    return _Subject(mechanism, parameters, units, metrics, constraints, arguments)


def _find_curve(subject: _Subject, arguments: Mapping[str, Any]) -> Tuning:
    from explore.analysis.tuning.control_curve import tune as find_curve

    return find_curve(subject.mechanism, subject.parameters, **arguments)


def _scales(subject: _Subject, arguments: Mapping[str, Any]) -> dict[str, Scale]:
    """The scale of each parameter, metric and constraint; none where no unit is chosen."""
    if not subject.units:
        return {}
    from explore.studies.request.names import find_mechanism
    from explore.studies.request.requests import make_request

    declared = find_mechanism(subject.mechanism, arguments.get("points", ()), arguments.get("target"))
    names = list(dict.fromkeys([arguments["metric"], *arguments["also"], *subject.constraints]))
    options: dict[str, Any] = {name: arguments.get(name) for name in ("window", "drive", "formulas")}
    metrics = make_request(declared, metrics=names, **options).all_metrics
    return subject.units.scales({quantity.name: quantity.unit for quantity in (*metrics, *declared.parameters)})


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


def _say_constraints(
    tuning: Tuning, subject: _Subject, arguments: Mapping[str, Any], scales: Mapping[str, Scale]
) -> None:
    """Say where in the intervals a constraint of the study holds, if it does not everywhere."""
    shown = tuning.in_units(scales)
    unit = shown_unit(shown.curve.attrs["units"][tuning.parameter])
    for interval, told in zip(tuning.intervals, shown.intervals, strict=True):
        first, last = interval.start.parameter, interval.stop.parameter
        is_range = first < last
        # A curve has two ends: those of a single value are its neighbours.
        ends = (first, last) if is_range else (math.nextafter(first, -math.inf), math.nextafter(last, math.inf))
        ends_told = dict.fromkeys(number(end.parameter, 13) for end in (told.start, told.stop))
        place = f"{tuning.parameter} {' to '.join(ends_told)} {unit}".rstrip()
        where = f"{'within' if is_range else 'at'} {place}"
        if is_range and len(tuning.intervals) == 1:
            where = "within it"
        for metric, sides in subject.constraints.items():
            bounds = {"low": sides["min"], "high": sides["max"], "start": ends[0], "stop": ends[1]}
            try:
                part = _find_curve(subject, {**arguments, "metric": metric, "also": (), **bounds})
            except MotionError:
                say(f"{where} {metric}, which the study constrains, is undefined", "yellow")
                continue
            if not any(own.start.parameter <= first <= last <= own.stop.parameter for own in part.intervals):
                part = part.in_units(scales)
                ranges = [(own.start.parameter, own.stop.parameter) for own in part.intervals]
                places = ", ".join(f"{number(a, 13)} to {number(b, 13)} {unit}".rstrip() for a, b in ranges)
                holds = f"holds only for {tuning.parameter} {places}" if places else "holds nowhere"
                verdict = holds if is_range else "does not hold"
                say(f"{where} the study's constraint {metric} {wanted_values(part)} {verdict}", "yellow")


def _print(tuning: Tuning, sentences: Mapping[str, str]) -> None:
    """Print the intervals, what is out of reach, and a table of the curve."""
    for line in describe_tuning(tuning, sentences):
        say(line, data=True)
    curve, units = tuning.curve, tuning.curve.attrs["units"]
    names = [str(name) for name in curve if name not in ("error", "piece")]
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
