"""Numbers that people write: a number in the declared unit, or a text with a unit of its own."""

from __future__ import annotations

import functools
import math
import re
from fractions import Fraction
from typing import TYPE_CHECKING

from explore.errors import RequestError
from explore.suggest import closest, shown

if TYPE_CHECKING:
    import pint

# A number, then factors such as "mm", "rad/s^2", "N m". A grammar of our own keeps arithmetic, which could run for
# ever (10**10**10), away from pint.
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_FACTOR = r"[^\W\d](?:[^\W\d]|[°%])*|[°%]"
_POWER = r"(?:(?:\^|\*\*)-?[1-9])?"
_TERM = rf"(?:{_FACTOR}){_POWER}"
_UNIT = rf"(?:1\s*/\s*)?{_TERM}(?:\s*[*/·]\s*{_TERM}|\s+{_TERM})*"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*({_UNIT})?\s*")
_HERTZ = re.compile(r"\bHz\b")
_LONGEST_TEXT = 80

# fmt: off
_COMMON_UNITS = (
    "mm", "cm", "m", "um", "in", "inch", "ft", "deg", "rad", "rpm", "turn/min", "rad/s", "deg/s", "rad/s^2", "deg/s^2",
    "s", "ms", "min", "Hz", "kg", "g", "N", "kN", "N m", "kN m", "N/mm^2", "MPa", "GPa",
)
# fmt: on
_EXAMPLES = {"mm": "mm, cm, m or in", "deg": "deg or rad", "rad/s": "rad/s, deg/s, rpm or Hz"}


def quantity(value: object, unit: str) -> float:
    """A number in the declared unit.

    Parameters
    ----------
    value
        A finite number, taken to be in `unit`, or a text such as "1440 rpm".
    unit
        The declared unit; "1" or "" for a plain number.

    Returns
    -------
    float
        The exact value of the text, rounded once: "15 cm" is exactly 150 mm.

    Raises
    ------
    RequestError
        The reason alone; the caller knows which key it belongs to.
    """
    if isinstance(value, str):
        return _converted(value, unit)
    if isinstance(value, bool):
        raise RequestError(f"{shown(value)} is not a number")
    try:
        number = float(value)  # type: ignore[arg-type]  # what is no number raises
    except (TypeError, ValueError):
        raise RequestError(f"{shown(value)} is not a number or a text with a unit{_example(unit)}") from None
    except OverflowError:
        raise RequestError("the number is too large") from None
    if not math.isfinite(number):
        raise RequestError(f"{number} is not a finite number")
    return number


def _example(unit: str) -> str:
    return "" if unit in ("", "1") else f', such as "10 {unit}"'


def _converted(text: str, unit: str) -> float:
    """A text with a unit, in the declared unit."""
    match = _QUANTITY.fullmatch(text) if len(text) <= _LONGEST_TEXT else None
    if match is None:
        raise RequestError(f"{shown(text)} is not a number with a unit{_example(unit)}")
    number, written = match.groups()
    if written is None:
        with_unit = "" if unit in ("", "1") else f' or "{number} {unit}"'
        raise RequestError(f"{shown(text)} is a text without a unit; write {number} without quotes{with_unit}")
    if unit == "rad/s":
        written = _HERTZ.sub("turn/s", written)  # of what turns
    # Fraction keeps the digits as written: a sum of lengths that is exactly 0 must stay exactly 0.
    exact = Fraction(number) * _factor(written, unit)
    try:
        return float(exact)
    except OverflowError:
        raise RequestError(f"{shown(text)} is too large") from None


@functools.cache
def _registry() -> pint.UnitRegistry[Fraction]:
    import pint  # 0.3 s, needed only when a text with a unit occurs

    registry: pint.UnitRegistry[Fraction] = pint.UnitRegistry(non_int_type=Fraction)
    registry.define("@alias turn = rev")
    registry.define("@alias revolutions_per_minute = RPM")
    return registry


@functools.lru_cache  # a table of designs repeats its units
def _factor(written: str, unit: str) -> Fraction:
    """What one `written` is in `unit`, exactly (with pint's 50 digits of pi)."""
    import pint

    registry = _registry()
    try:
        factor, root = registry.get_root_units(written.replace("·", "*"))
    except pint.UndefinedUnitError as error:
        unknown = error.unit_names[0]
        match = closest(written, _COMMON_UNITS) or closest(unknown, _COMMON_UNITS)
        hint = f"; did you mean '{match}'?" if match else _meant(unit)
        raise RequestError(f"unknown unit '{unknown}'{hint}") from None
    except Exception:  # pint's parser raises many kinds for a malformed unit
        raise RequestError(f"cannot read the unit '{written}'{_meant(unit)}") from None
    declared_factor, declared_root = registry.get_root_units(unit or "1")
    # Root units, not dimensions: they keep the radian, so that "1 Hz" is not taken for 1 rad/s.
    if root != declared_root:
        raise RequestError(f"'{written}' does not measure the same as '{unit or '1'}'{_meant(unit)}")
    return Fraction(str(factor)) / Fraction(str(declared_factor))


def _meant(unit: str) -> str:
    return "; a plain number is wanted" if unit in ("", "1") else f"; use {_EXAMPLES.get(unit, unit)}"
