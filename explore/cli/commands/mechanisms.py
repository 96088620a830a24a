"""`explore mechanisms`: list the mechanisms, or describe one."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import chain, pairwise
from typing import TYPE_CHECKING, Annotated

import typer

from explore.cli.completion import complete_mechanisms
from explore.cli.options import JsonOption
from explore.cli.output import announce_compiling, number, print_json, say, shown_unit
from explore.cli.tables import print_table

if TYPE_CHECKING:
    from explore.model.mechanism import Mechanism
    from explore.model.points import FloatingLink
    from explore.model.quantities import Formula, Metric, Parameter, Signal
    from explore.studies.config.linkage import Linkage

#: Number of values up to which all are listed; of more that count up, the first two and the last are.
_MOST_CHOICES = 4


def mechanisms(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            autocompletion=complete_mechanisms,
            help="One mechanism in full, or the file.toml of a linkage: a study, or its table alone.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List the mechanisms, or the parameters, signals, metrics and windows of one."""
    from explore.mechanisms.registry import MECHANISMS
    from explore.studies.request.names import find_mechanism

    if name is not None:
        found = _linkage(name) if name.lower().endswith(".toml") else name
        _print_mechanism(find_mechanism(found), as_json=as_json)
        return
    available, problems = MECHANISMS.load_all()
    for problem in problems:
        say(f"warning: {problem}", "yellow")
    if as_json:
        print_json({name: mechanism.summary for name, mechanism in available.items()})
    else:
        rows = [[mechanism.name, mechanism.summary] for mechanism in available.values()]
        print_table("mechanisms", [("mechanism", ""), ("meaning", "")], rows)
        say("explore mechanisms NAME shows parameters, signals, metrics and windows", "dim")
        say("explore init --linkage NAME writes a study of a linkage that a table describes", "dim")


def _linkage(file: str) -> Linkage:
    """The linkage of a file; what its mechanism has takes a compiler to find out."""
    from explore.studies.config.linkage import load_linkage

    linkage = load_linkage(file)
    announce_compiling()
    return linkage


def _print_mechanism(mechanism: Mechanism, *, as_json: bool) -> None:
    if as_json:
        print_json(_json_description(mechanism))
        return
    say(f"{mechanism.name}: {mechanism.summary}", "bold", data=True)
    print_table(
        "parameters",
        [("parameter", ""), ("unit", ""), ("default", ""), ("allowed", ""), ("meaning", "")],
        [
            [p.name, shown_unit(p.unit), "required" if p.default is None else number(p.default), _range(p), p.long_name]
            for p in mechanism.parameters
        ],
        droppable=["allowed", "unit", "default"],
    )
    _print_quantities(f"signals, functions of the {mechanism.input_angle}", "signal", mechanism.signals)
    _print_quantities("closed-form metrics, of the design in any window", "metric", mechanism.metrics)
    if mechanism.formulas:
        _print_quantities("derived metrics, functions of others", "metric", mechanism.formulas)
    print_table("windows", [("window", ""), ("meaning", "")], [[w.name, w.long_name] for w in mechanism.windows])
    if mechanism.statuses:
        rows = [[status.label, status.sentence] for status in mechanism.statuses.values()]
        print_table("statuses of designs without a motion or without strokes", [("status", ""), ("meaning", "")], rows)
    for note in _notes(mechanism):
        say(note, data=True)


def _print_quantities(title: str, heading: str, quantities: Sequence[Signal | Metric | Formula]) -> None:
    rows = [[q.name, shown_unit(q.unit), q.long_name + _window_note(q)] for q in quantities]
    print_table(title, [(heading, ""), ("unit", ""), ("meaning", "")], rows)


def _window_note(quantity: Signal | Metric | Formula) -> str:
    """The windows of a signal that exists in these only."""
    windows = getattr(quantity, "only_in", ())
    return f" (window {', '.join(windows)})" if windows else ""


def _notes(mechanism: Mechanism) -> Iterator[str]:
    """How sampled metrics are named, and the points, targets, drives and objectives of the mechanism."""
    from explore.model.points import COORDINATES, MOST_POINTS, point_signals
    from explore.model.quantities import MAGNITUDE_STATISTICS, STATISTICS
    from explore.model.targets import TARGETS

    yield "statistics of signals: SIGNAL_STATISTIC over the window of the study, SIGNAL_STATISTIC_WINDOW over another"
    yield f"STATISTIC is {', '.join(STATISTICS)}"
    yield "min and max have the sign of the signal, peak is its largest magnitude"
    statistics = {f"{signal.name}_{statistic}" for signal in mechanism.signals for statistic in signal.statistics}
    for name in (metric.name for metric in mechanism.metrics if metric.name in statistics):
        over_a_window = f"over a window it is, for example, {name}_{mechanism.default_window}"
        yield f"{name} is a closed-form metric of the full turn; {over_a_window}"
    if any(signal.is_magnitude for signal in mechanism.signals):
        yield f"of a magnitude, statistics are {', '.join(MAGNITUDE_STATISTICS)}"
    yield f"mean, variance and cv alone are those of the output, {mechanism.output_signals['']}"
    if link := mechanism.floating_link:
        given = "[points] NAME = { along = 120, across = 40 } in a study, mm"
        where = f"along the {link.name} from {link.pin} and across it counter-clockwise"
        yield f"points of the {link.name}, up to {MOST_POINTS}: {given} {where}"
        parameters = ", ".join(f"NAME_{coordinate}" for coordinate in COORDINATES)
        signals = ", ".join(s.name.replace("knife", "NAME") for s in point_signals(link, ("knife",)))
        yield f"the parameters of a point are {parameters}, its signals {signals}"
    for kind, metrics in _target_metrics(mechanism).items():
        names = ", ".join(metric.name for metric in metrics)
        yield f'{TARGETS[kind].doer} can have a target, [target] kind = "{kind}" in a study; its metrics are {names}'
    if mechanism.drives:
        yield f"drive is one of {', '.join(mechanism.drives)}"
    yield f"default objectives are {', '.join(mechanism.objectives)}"


def _target_metrics(mechanism: Mechanism) -> dict[str, tuple[Formula, ...]]:
    """The metrics of targets of each kind that the mechanism meets, of a point "knife" where a study names points."""
    from explore.model.targets import TARGETS

    formulas: dict[str, tuple[Formula, ...]] = {}
    for kind, declared in mechanism.targets.items():
        of_kind = chain(*map(declared.formulas, TARGETS[kind].examples(*declared.points[:1])))
        formulas[kind] = tuple({formula.name: formula for formula in of_kind}.values())
    return formulas


def _range(parameter: Parameter) -> str:
    if parameter.choices:
        values = [number(choice) for choice in parameter.choices]
        counts_up = all(after - before == 1 for before, after in pairwise(parameter.choices))
        return ", ".join([*values[:2], "…", values[-1]] if counts_up and len(values) > _MOST_CHOICES else values)
    over = "any" if math.isinf(parameter.lower) else f"> {number(parameter.lower)}"
    up_to = "" if math.isinf(parameter.upper) else f", at most {number(parameter.upper)}"
    return f"{over}{up_to}" + (f", or 0: {parameter.zero_meaning}" if parameter.zero_meaning else "")


def _json_description(mechanism: Mechanism) -> dict[str, object]:
    from explore.model.quantities import STATISTICS

    metrics: tuple[Metric | Formula, ...] = (*mechanism.metrics, *mechanism.formulas)
    return {
        "name": mechanism.name,
        "summary": mechanism.summary,
        "parameters": {
            p.name: {"unit": p.unit, "default": p.default, "meaning": p.long_name} for p in mechanism.parameters
        },
        "signals": {s.name: {"unit": s.unit, "meaning": s.long_name} for s in mechanism.signals},
        "metrics": {m.name: {"unit": m.unit, "meaning": m.long_name, "sense": m.sense} for m in metrics},
        "windows": {w.name: w.long_name for w in mechanism.windows},
        "statuses": {status.label: status.sentence for status in mechanism.statuses.values()},
        "statistics": list(STATISTICS),
        "drives": list(mechanism.drives),
        "points": _json_points(mechanism.floating_link),
        "targets": {
            kind: {m.name: {"unit": m.unit, "meaning": m.long_name, "sense": m.sense} for m in metrics}
            for kind, metrics in _target_metrics(mechanism).items()
        },
        "objectives": list(mechanism.objectives),
    }


def _json_points(link: FloatingLink | None) -> dict[str, object] | None:
    from explore.model.points import MOST_POINTS, point_parameters, point_signals

    if link is None:
        return None
    example = ("knife",)
    return {
        "link": link.name,
        "most": MOST_POINTS,
        "example": "knife",
        "parameters": {p.name: {"unit": p.unit, "meaning": p.long_name} for p in point_parameters(link, example)},
        "signals": {s.name: {"unit": s.unit, "meaning": s.long_name} for s in point_signals(link, example)},
    }
