"""What tolerances do to designs, in the units that were chosen to show it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from explore.analysis.tolerancing.robustness import Robustness
from explore.base.units.shown import PLAIN, Scale, ShownUnits

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

#: Columns of `Robustness.metrics` in the unit of the metric.
_AMOUNTS = ("nominal", "mean", "std", "std_first_order", "low", "high")


def show_robustness(robustness: Robustness, units: ShownUnits) -> Robustness:
    """The tables with all values in the chosen units; the same object if none is chosen."""
    if not units:
        return robustness
    scales = robustness_scales(robustness, units)
    return replace(
        robustness,
        designs=_show_designs(robustness.designs, scales),
        metrics=_show_metrics(robustness.metrics, scales),
        derivatives=_show_derivatives(robustness.derivatives, scales),
        tolerances=tuple(
            replace(t, plus_minus=scales[t.parameter].show(t.plus_minus)) for t in robustness.tolerances
        ),
        _scales=scales,
    )  # fmt: skip


def robustness_scales(robustness: Robustness, units: ShownUnits) -> dict[str, Scale]:
    """The declared and the shown unit of each column, and of each metric and parameter of an analysis."""
    return units.scales(robustness.designs.attrs["units"] | robustness.declared_units)


def _show_designs(frame: pd.DataFrame, scales: Mapping[str, Scale]) -> pd.DataFrame:
    names = [str(name) for name in frame.columns if scales.get(str(name), PLAIN).factor != 1]
    shown = frame.assign(**{name: scales[name].show_all(frame[name].to_numpy()) for name in names})
    bounds: dict[str, Any] = {
        metric: {side: None if bound is None else scales[metric].show(bound) for side, bound in sides.items()}
        for metric, sides in frame.attrs["constraints"].items()
    }
    units = {name: scales[name].shown for name in frame.attrs["units"]}
    shown.attrs = {**frame.attrs, "units": units, "constraints": bounds}
    return shown


def _show_metrics(table: pd.DataFrame, scales: Mapping[str, Scale]) -> pd.DataFrame:
    factors = [float(scales[name].factor) for name in table.index.get_level_values("metric")]
    return table.assign(**{column: table[column] * factors for column in _AMOUNTS})


def _show_derivatives(table: pd.DataFrame, scales: Mapping[str, Scale]) -> pd.DataFrame:
    pairs = zip(table.index.get_level_values("metric"), table.index.get_level_values("parameter"), strict=True)
    factors = [float(scales[metric].factor / scales[parameter].factor) for metric, parameter in pairs]
    return table.assign(**{column: table[column] * factors for column in ("derivative", "error")})
