"""Units in which values are shown, chosen by quantity: inches for all lengths, rpm for all rotational speeds.

A unit that nobody chose follows the others where that is natural: the square of a quantity with a chosen unit is in the
square of that, and what has lengths, angles and times alone follows the lengths and the angles, so that inches give
in/s, in^2 and deg/in. Forces, torques and stresses have no such form: N/in^2 is no unit that anybody wants.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.base.suggest import format_value, suggestion
from explore.base.units.common import split_unit
from explore.base.units.quantities import join_unit, quantity, unit_factor

if TYPE_CHECKING:
    import pandas as pd

FloatArray = npt.NDArray[np.float64]

#: Unit of each quantity. Energies and torques have one dimension, see `_quantity`.
QUANTITIES = {
    "length": "mm", "angle": "deg", "time": "s", "mass": "kg", "speed": "rad/s", "angular_acceleration": "rad/s^2",
    "velocity": "mm/s", "acceleration": "mm/s^2", "force": "N", "torque": "N m", "energy": "J", "power": "W",
    "stress": "MPa", "inertia": "kg m^2", "stiffness": "N/m", "rotational_stiffness": "N m/rad", "damping": "N s/m",
    "rotational_damping": "N m s/rad",
}  # fmt: skip
#: Quantities whose chosen units a compound unit follows.
_FOLLOWED = ("length", "angle")
#: Quantities of a compound unit that follows.
_KINEMATIC = (*_FOLLOWED, "time")
#: Bound below which all integers are exact as a float.
_LARGEST_EXACT = 2**53

_HEADING = re.compile(r"(.*?)\s*\[([^][]*)\]", re.DOTALL)
_ONE_FACTOR = re.compile(r"[^\W\d]+|°")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)


def _shorten(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Numbers with ten digits where those are no farther than four rounding errors: their own, and of what was read."""
    with np.errstate(divide="ignore", invalid="ignore"):
        places = 9.0 - np.floor(np.log10(np.abs(values)))
        up, down = (10.0 ** np.clip(sign * places, 0.0, 22.0) for sign in (1.0, -1.0))  # exact powers
        short = np.rint(values * up / down) / up * down
        is_near = (np.abs(short - values) <= 4.0 * 2.0**-53 * np.abs(values)) & (np.abs(places) <= 22.0)
        return np.where(is_near, short, values)


@dataclass(frozen=True)
class Scale:
    """The units that values are declared and shown in, "1" or "" for plain numbers, and the factor between them.

    The factor is exact but for 50 digits of pi.
    """

    declared: str = ""
    shown: str = ""
    factor: Fraction = Fraction(1)

    @property
    def is_declared(self) -> bool:
        """Whether values are shown as they are declared."""
        return self.shown == self.declared

    @property
    def ratio(self) -> tuple[float, float]:
        """The factor as a multiplier and a divisor; both are exact but for a factor with pi."""
        top, bottom = self.factor.as_integer_ratio()
        return (float(self.factor), 1.0) if max(top, bottom) > _LARGEST_EXACT else (float(top), float(bottom))

    def show(self, value: float) -> float:
        """A declared value in the shown unit, see `show_all`."""
        return float(self.show_all(np.asarray(value)))

    def show_all(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Declared values in the shown unit, by an exact factor with two rounding errors.

        A number of ten digits that is as near is taken instead, as 120 rpm for 119.99999999999999.
        """
        if self.factor == 1:
            return values
        top, bottom = self.ratio
        return _shorten(np.asarray(values * top / bottom))

    def read(self, text: str) -> float:
        """The declared value of a text, a number in the shown unit or with a unit; an error has the reason alone.

        What `show` writes for a number of ten digits is read as that number, as 2.3622047244094486 in for 60 mm.
        """
        text = text.strip()
        written = _NUMBER.match(text)
        if written is None or written[0] != text:
            number = quantity(text, self.declared)
            is_as_written = written is not None and number == float(written[0])
            return number if is_as_written else float(_shorten(np.asarray(number)))
        number = float(text)
        try:
            # The fraction of a number such as 1e-999999999, which is 0 here, or of 1e999999999 would fill the memory.
            if self.factor != 1 and number != 0.0 and math.isfinite(number):
                number = float(_shorten(np.asarray(float(Fraction(text) / self.factor))))
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise RequestError("the number is too large")
        return number

    def __str__(self) -> str:
        return self.shown


#: The scale of values without a known unit.
PLAIN = Scale()


@dataclass(frozen=True)
class ShownUnits:
    """The chosen unit of each quantity of `QUANTITIES` that has one.

    A column that a study gives in another unit than the declared is shown in the `given` one; a chosen one wins.
    """

    units: Mapping[str, str] = field(default_factory=dict)
    given: Mapping[str, str] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.units or self.given)

    def with_given(self, given: Mapping[str, str]) -> ShownUnits:
        """The same, with the units in which a study gives columns."""
        return replace(self, given=given)

    def scale(self, declared: str) -> Scale:
        """The scale of values in a declared unit."""
        if not self.units or declared in ("", "1"):
            return Scale(declared, declared)
        return _find_scale(tuple(sorted(self.units.items())), declared)

    def scales(self, units: Mapping[str, str]) -> dict[str, Scale]:
        """The scale of each column, from its declared unit."""
        return {name: self._scale_of(name, unit) for name, unit in units.items()}

    def _scale_of(self, name: str, declared: str) -> Scale:
        if name not in self.given or self.units.get(_quantity(declared)):
            return self.scale(declared)
        return Scale(declared, self.given[name], 1 / unit_factor(self.given[name], declared))


def read_shown_units(entries: Mapping[str, object]) -> ShownUnits:
    """The chosen units from entries such as ``{"length": "in"}``.

    The first wrong entry raises a `RequestError`, ``quantity: reason``.
    """
    for name, unit in entries.items():
        if reason := explain_entry(name, unit):
            raise RequestError(f"{name}: {reason}")
    return ShownUnits({name: str(unit) for name, unit in entries.items()})


def explain_entry(name: str, unit: object) -> str:
    """Why a quantity cannot be shown in this unit; empty if it can."""
    if name not in QUANTITIES:
        return f"no such quantity; {suggestion(name, QUANTITIES)}"
    if not isinstance(unit, str):
        return f'must be a unit in quotes, such as "{QUANTITIES[name]}", got {format_value(unit)}'
    if split_unit(unit) is None:
        return f'{format_value(unit)} is not a unit; write one such as "{QUANTITIES[name]}"'
    try:
        unit_factor(unit, QUANTITIES[name])
    except RequestError as error:
        return str(error)
    return ""


def number_with_unit(value: float, scale: Scale, digits: int = 6) -> str:
    """A declared value as a message shows it, with the unit if that is not the declared one."""
    text = f"{scale.show(value):.{digits}g}"
    return text if scale.is_declared else f"{text} {scale.shown}"


@functools.lru_cache(maxsize=1024)
def _find_scale(chosen: tuple[tuple[str, str], ...], declared: str) -> Scale:
    units = dict(chosen)
    if unit := units.get(_quantity(declared)):
        return Scale(declared, unit, 1 / unit_factor(unit, declared))
    powers = split_unit(declared) or {}
    if powers and all(power % 2 == 0 for power in powers.values()):
        root = _find_scale(chosen, join_unit({factor: power // 2 for factor, power in powers.items()}))
        shown = split_unit(root.shown) or {}
        squared = join_unit({factor: 2 * power for factor, power in shown.items()})
        return Scale(declared, declared if root.is_declared else squared, root.factor**2)
    return _compose(units, declared, powers)


def _compose(units: Mapping[str, str], declared: str, powers: Mapping[str, int]) -> Scale:
    """The scale of a unit of lengths, angles and times, whose lengths and angles follow the chosen units."""
    kinds = {factor: _quantity(factor) for factor in powers}
    shown: dict[str, int] = {}
    scale = Fraction(1)
    for factor, power in powers.items():
        unit = units.get(kinds[factor], "") if kinds[factor] in _FOLLOWED else ""
        unit = unit if _ONE_FACTOR.fullmatch(unit) else factor
        shown[unit] = shown.get(unit, 0) + power
        scale *= (1 / unit_factor(unit, factor)) ** power if unit != factor else 1
    if scale == 1 or not all(kind in _KINEMATIC for kind in kinds.values()):
        return Scale(declared, declared)
    return Scale(declared, join_unit(shown), scale)


@functools.cache
def _quantity(unit: str) -> str:
    """Name of the quantity that a unit measures; empty for one without a name."""
    for name, example in QUANTITIES.items():
        try:
            unit_factor(unit, example)
        except RequestError:
            continue
        # A torque is written as a product, an energy as one unit.
        return "energy" if name == "torque" and len(split_unit(unit) or {}) == 1 else name
    return ""


def in_units(table: pd.DataFrame, scales: Mapping[str, Scale]) -> pd.DataFrame:
    """A table in the shown units: its columns, and the units and the bounds of constraints in its ``attrs``."""
    names = [name for name in map(str, table.columns) if scales.get(name, PLAIN).factor != 1]
    shown = table.copy(deep=False)
    for name in names:
        shown[name] = scales[name].show_all(table[name].to_numpy())
    if "units" in shown.attrs:
        units = table.attrs["units"]
        shown.attrs["units"] = {name: scales[name].shown if name in scales else units[name] for name in units}
    if "constraints" in shown.attrs:
        shown.attrs["constraints"] = show_bounds(table.attrs["constraints"], scales)
    return shown


def show_bounds(
    constraints: Mapping[str, Mapping[str, float | None]], scales: Mapping[str, Scale]
) -> dict[str, dict[str, float | None]]:
    """The bounds of each metric, which may have a margin only, in the shown units."""
    by_metric = {metric: scales.get(metric) or scales.get(f"{metric}_margin", PLAIN) for metric in constraints}
    return {
        metric: {side: None if bound is None else by_metric[metric].show(bound) for side, bound in sides.items()}
        for metric, sides in constraints.items()
    }


def headings(scales: Mapping[str, Scale], names: Iterable[str]) -> dict[str, str]:
    """Names of columns in tables that carry no units: with the unit where it is not the declared one, "crank [in]"."""
    known = {name: scales[name] for name in names if name in scales and not scales[name].is_declared}
    return {name: f"{name} [{scale.shown}]" for name, scale in known.items()}


def split_heading(text: str) -> tuple[str, str]:
    """The name and the unit of a heading such as "crank [in]"; the unit is empty where there is none."""
    match = _HEADING.fullmatch(text.strip())
    return (match[1], match[2].strip()) if match else (text.strip(), "")
