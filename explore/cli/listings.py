"""`explore mechanisms`."""

from __future__ import annotations

import math

from explore.cli.output import compiled_kernels, number, print_json, print_table, say, shown_unit
from explore.vocabulary import MAGNITUDE_STATISTICS, STATISTICS, Formula, Mechanism, Metric, Parameter


def print_mechanisms(*, as_json: bool) -> None:
    """Print all mechanisms, a line each."""
    with compiled_kernels():
        from explore.mechanisms.registry import MECHANISMS
    if as_json:
        print_json({name: mechanism.summary for name, mechanism in MECHANISMS.items()})
        return
    print_table(
        "mechanisms", [("mechanism", ""), ("what it is", "")], [[m.name, m.summary] for m in MECHANISMS.values()]
    )
    say("explore mechanisms NAME shows parameters, signals, metrics and windows", "dim")


def print_mechanism(name: str, *, as_json: bool) -> None:
    """Print one mechanism in full."""
    with compiled_kernels():
        from explore.request.requests import find_mechanism
    mechanism = find_mechanism(name)
    if as_json:
        print_json(_described(mechanism))
        return
    say(f"{mechanism.name}: {mechanism.summary}", "bold", data=True)
    print_table(
        "parameters",
        [("parameter", ""), ("unit", ""), ("default", ""), ("allowed", ""), ("meaning", "")],
        [
            [
                p.name,
                shown_unit(p.unit),
                "required" if p.default is None else number(p.default),
                _allowed(p),
                p.long_name,
            ]
            for p in mechanism.parameters
        ],
    )
    print_table(
        "signals, functions of the crank angle",
        [("signal", ""), ("unit", ""), ("meaning", "")],
        [
            [s.name, shown_unit(s.unit), s.long_name + (f" (window {', '.join(s.only_in)})" if s.only_in else "")]
            for s in mechanism.signals
        ],
    )
    print_table(
        "closed-form metrics",
        [("metric", ""), ("unit", ""), ("meaning", "")],
        [[m.name, shown_unit(m.unit), m.long_name] for m in mechanism.metrics],
    )
    if mechanism.formulas:
        print_table(
            "derived metrics, functions of others",
            [("metric", ""), ("unit", ""), ("meaning", "")],
            [[f.name, shown_unit(f.unit), f.long_name] for f in mechanism.formulas],
        )
    print_table("windows", [("window", ""), ("meaning", "")], [[w.name, w.long_name] for w in mechanism.windows])
    say(f"sampled metrics: SIGNAL_STATISTIC or SIGNAL_STATISTIC_WINDOW, statistics {', '.join(STATISTICS)}", data=True)
    if any(signal.magnitude for signal in mechanism.signals):
        say(f"of a magnitude, statistics are {', '.join(MAGNITUDE_STATISTICS)}", data=True)
    say(f"mean, variance and cv alone are those of the output, {mechanism.output['']}", data=True)
    if len(mechanism.drives) > 1:
        say(f"drive is one of {', '.join(mechanism.drives)}", data=True)
    say(f"default objectives are {', '.join(mechanism.objectives)}", data=True)


def _allowed(parameter: Parameter) -> str:
    if parameter.choices:
        return ", ".join(number(choice) for choice in parameter.choices)
    over = "any" if math.isinf(parameter.lower) else f"> {number(parameter.lower)}"
    up_to = "" if math.isinf(parameter.upper) else f", at most {number(parameter.upper)}"
    return f"{over}{up_to}" + (f", or 0: {parameter.zero}" if parameter.zero else "")


def _described(mechanism: Mechanism) -> dict[str, object]:
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
        "statistics": list(STATISTICS),
        "drives": list(mechanism.drives),
        "objectives": list(mechanism.objectives),
    }
