"""What a page needs to compute and draw the motion of a design: the mechanism's declaration and its functions."""

import math
from collections.abc import Collection, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from explore.base.units.shown import ShownUnits
from explore.evaluation.quadrature.windows import LONGER, SHORTER, orient
from explore.figures.reporting.javascript import TranslationError, translate
from explore.model.drawing import PLACE, Panel
from explore.model.mechanism import Mechanism
from explore.model.output_slider import COLUMNS, SLIDER, TRAVEL, TRAVEL_PANEL, TRAVEL_SIGNAL
from explore.model.points import drawn_name
from explore.model.quantities import Parameter, Signal
from explore.model.window import Window
from explore.results.labels import unit_text


def kernel_for(mechanism: Mechanism, given: Collection[str]) -> Mechanism:
    """The mechanism, or its extended one if the parameters that a study gives are those of its signals."""
    return mechanism.kernel_of(
        signal
        for signal in mechanism.signals
        if not signal.required_loads or any(load in given for load in signal.required_loads)
    )


def describe_motion(mechanism: Mechanism, units: ShownUnits, interval: Window | None = None) -> dict[str, Any]:
    """The declaration of a mechanism, that of `kernel_for`, as far as a page needs it; can be written as JSON.

    The interval is that of the study, over which designs move that lack the whole motion; None where it has none.

    Signals are in declared units; the factors of the panels lead to the shown ones.
    """
    filled = [signal for signal in mechanism.signals if mechanism.fills(signal)]
    names = {signal.name for signal in filled}
    panels = [panel for panel in mechanism.declared_panels if names.issuperset(panel.signals)]
    return {
        "input": mechanism.input_angle,
        "anchor": float(np.rad2deg(mechanism.anchor_angle)),
        "parameters": [p.name for p in mechanism.kernel_parameters],
        "allowed": [_describe_range(p) for p in mechanism.parameters],
        "speed": mechanism.speed.name if mechanism.speed else "",
        "record_rows": mechanism.record_rows,
        "first_parameter": mechanism.first_parameter,
        "status_row": mechanism.status_row,
        "moving": list(mechanism.moving_statuses),
        "signal_rows": mechanism.signal_rows,
        "interval_row": mechanism.interval_row,
        "limits": _ends_of(mechanism.limits),
        "interval": _ends_of(interval),
        "variant_row": mechanism.variant_row,
        "phases_row": mechanism.phases_row,
        "needs": int(np.bitwise_or.reduce([signal.needs for signal in filled])),
        "signals": [
            {
                "name": signal.name, "unit": signal.unit, "row": signal.row, "power": signal.speed_power,
                "magnitude": signal.is_magnitude, "rectified": signal.is_rectified, "shares": signal.shares_row_with,
            }
            for signal in filled
        ],
        "marks": dict(mechanism.marks),
        "breaks": list(mechanism.breaks),
        "strokes": {name: list(mechanism.window(name).ends) for name in mechanism.strokes},
        "longer": LONGER,
        "shorter": SHORTER,
        "ends": [end for stroke in mechanism.strokes[:1] for end in mechanism.window(stroke).ends],
        "panels": [_describe_panel([mechanism.signal(name) for name in p.signals], p, units) for p in panels],
        "drawing": asdict(mechanism.drawing) if mechanism.drawing else None,
        "place": list(PLACE),
        "slider": _describe_slider(mechanism, units),
    }  # fmt: skip


def _ends_of(interval: Window | None) -> list[float] | None:
    """First and last input angle of an interval, deg."""
    return [float(interval.start), float(interval.stop)] if interval else None


def _describe_slider(mechanism: Mechanism, units: ShownUnits) -> dict[str, Any] | None:
    """The slider that results tie to the only point of a linkage: its columns and travel; None without one."""
    if len(mechanism.points) != 1:
        return None
    return {
        "name": SLIDER,
        "point": drawn_name(mechanism.points[0]),
        "columns": list(COLUMNS),
        "signal": {"name": TRAVEL, "unit": TRAVEL_SIGNAL.unit},
        "panel": _describe_panel([TRAVEL_SIGNAL], TRAVEL_PANEL, units),
    }


def _describe_range(parameter: Parameter) -> dict[str, Any]:
    """The values that a parameter can take: a page gives no others to the mechanism's functions."""
    return {
        "name": parameter.name,
        "lower": _finite(parameter.lower),
        "upper": _finite(parameter.upper),
        "choices": list(parameter.choices),
        "zero": bool(parameter.zero_meaning),
    }


def _finite(limit: float) -> float | None:
    """The limit of a range; None for an infinite one, which JSON has no word for."""
    return limit if math.isfinite(limit) else None


def _describe_panel(signals: Sequence[Signal], panel: Panel, units: ShownUnits) -> dict[str, Any]:
    scale = units.scale(panel.unit or signals[0].unit)
    unit, factor = scale.shown, panel.factor * float(scale.factor)
    return {
        "label": panel.label,
        "signals": list(panel.signals),
        "unit": "" if unit == "1" else unit_text(unit),
        "factor": factor,
        "turn": 360.0 * factor if signals[0].unit == "deg" else 0.0,
        "clutch": panel.with_clutch,
        "magnitude": any(signal.is_magnitude for signal in signals),
        "loads": sorted({load for signal in signals for load in signal.required_loads}),
    }


def translate_functions(mechanism: Mechanism) -> str:
    """A statement of JavaScript that gives a page the mechanism's functions; empty where they have no translation."""
    try:
        functions = translate(close=mechanism.close, fill=mechanism.fill, orient=orient)
    except TranslationError:
        return ""
    return f"globalThis.exploreMechanism = {functions};"
