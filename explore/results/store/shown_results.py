"""Results in the units that were chosen to show them; the file stays in declared units."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from explore.base.units.shown import PLAIN, Scale, ShownUnits
from explore.model.columns import Column
from explore.results.store.results import Results

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas as pd


#: The one unit in which a parameter is shown because its study gives it so.
_RPM = "rpm"


def units_of_study(results: Results) -> dict[str, object]:
    """The entries of [units] in the study of results; none where the text of the study cannot be read."""
    try:
        entries = tomllib.loads(results.config).get("units", {})
    except tomllib.TOMLDecodeError:
        return {}
    return entries if isinstance(entries, dict) else {}


def given_units(results: Results) -> dict[str, str]:
    """The unit of the input speed, where the study gives it in rpm alone."""
    try:
        entry = tomllib.loads(results.config).get("parameters", {}).get(results.speed)
    except (tomllib.TOMLDecodeError, AttributeError):
        return {}
    values = list(entry.values()) if isinstance(entry, dict) else entry if isinstance(entry, list) else [entry]
    texts = [value for value in values if isinstance(value, str)]
    is_in_rpm = bool(texts) and all(text.split()[-1:] == [_RPM] for text in texts)
    has_numbers = isinstance(entry, list) and len(texts) < len(values)
    return {results.speed: _RPM} if is_in_rpm and not has_numbers else {}


def show_results(results: Results, units: ShownUnits) -> Results:
    """The results with all values and bounds in the chosen units; the same object if none is chosen."""
    return ShownResults(results.declared, units) if units else results


class ShownResults(Results):
    """Results whose columns and bounds are in chosen units; `declared` are the same in declared ones.

    Values are converted when they are read. Two designs that differ by a rounding error may become equal, so that
    rankings compare the declared values.
    """

    def __init__(self, declared: Results, units: ShownUnits) -> None:
        self.path, self._reader, self._layout = declared.path, declared._reader, declared._layout
        self._declared, self._units = declared, units

    @property
    def declared(self) -> Results:
        """These results in declared units."""
        return self._declared

    @property
    def shown_units(self) -> ShownUnits:
        """The chosen units."""
        return self._units

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """The declared and the shown unit of each column."""
        return self._units.scales(self._declared.units)

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """The columns in their order, the index first."""
        return tuple(replace(column, unit=self.scales[column.name].shown) for column in self._declared.columns)

    @property
    def constraints(self) -> dict[str, dict[str, float | None]]:
        """The bounds of each constrained metric as "min" and "max"; None leaves a side open."""
        return {
            metric: {
                side: None if bound is None else self.scale_of(metric).show(bound) for side, bound in sides.items()
            }
            for metric, sides in self._declared.constraints.items()
        }

    def scale_of(self, metric: str) -> Scale:
        """The units of a metric, which may have a margin only."""
        return self.scales.get(metric) or self.scales.get(f"{metric}_margin", PLAIN)

    def show(self, frame: pd.DataFrame) -> pd.DataFrame:
        """A table of `declared` in the shown units; other columns are unchanged."""
        names = [str(name) for name in frame.columns]
        converted = {name: self._convert(name, frame[name].to_numpy()) for name in names if self._is_converted(name)}
        shown = frame.assign(**converted)
        if "units" in frame.attrs:
            units = {name: str(self.scales[name]) if name in self.scales else unit
                     for name, unit in frame.attrs["units"].items()}  # fmt: skip
            shown.attrs = {**frame.attrs, "units": units}
        if "constraints" in frame.attrs:
            shown.attrs["constraints"] = self.constraints
        return shown

    def to_pandas(self, columns: Sequence[str] | None = None) -> pd.DataFrame:
        """The committed designs as a table; see `Results.to_pandas`."""
        return self.show(self._declared.to_pandas(columns))

    def design(self, number: int) -> dict[str, Any]:
        """One design: the value of each column by name."""
        row = self._declared.design(number)
        return {
            name: self.scales[name].show(value) if self._is_converted(name) else value for name, value in row.items()
        }

    def designs(self, numbers: npt.ArrayLike) -> pd.DataFrame:
        """Read some designs by number; see `Results.designs`."""
        return self.show(self._declared.designs(numbers))

    def blocks(self, columns: Sequence[str] | None = None) -> Iterator[dict[str, npt.NDArray[Any]]]:
        """Read the committed blocks in order, each as arrays of shape (n,) by name; all columns when None."""
        for block in self._declared.blocks(columns):
            yield {name: self._convert(name, values) for name, values in block.items()}

    def _is_converted(self, name: str) -> bool:
        return name in self.scales and self.scales[name].factor != 1

    def _convert(self, name: str, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return self.scales[name].show_all(np.asarray(values)) if self._is_converted(name) else values
