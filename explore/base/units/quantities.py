"""Read quantities: a number in the declared unit, or a string with a unit."""

from __future__ import annotations

import functools
import math
import re
from fractions import Fraction
from numbers import Rational
from typing import TYPE_CHECKING, Self

from explore.base.errors import RequestError
from explore.base.suggest import closest_name, format_value
from explore.base.units.common import UNIT, common_root

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pint

# A number, then factors such as "mm", "rad/s^2", "N m". pint would also evaluate arithmetic, which may never end
# (10**10**10), so only strings that match this grammar reach it.
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*({UNIT})?\s*")
_HERTZ = re.compile(r"\bHz\b")
_TON = re.compile(r"\btons?\b")
_MOST_CHARACTERS = 80

# fmt: off
_COMMON_UNITS = (
    "mm", "cm", "m", "um", "in", "inch", "ft", "deg", "rad", "rpm", "turn/min", "rad/s", "deg/s", "rad/s^2", "deg/s^2",
    "s", "ms", "min", "Hz", "kg", "g", "N", "kN", "N m", "kN m", "N/mm^2", "MPa", "GPa",
)
# fmt: on
_EXAMPLES = {"mm": "mm, cm, m or in", "deg": "deg or rad", "rad/s": "rad/s, deg/s, rpm or Hz"}


#: A full turn, deg.
_TURN = 360
#: Largest integer of a factor without pi; one with pi has 50 digits.
_LARGEST_RATIONAL = 2**53


class UnitError(RequestError):
    """A number has a unit that is not one for it."""


class WrittenNumber(float):
    """A number of a text: the nearest double, and the decimal digits, which tell large angles apart."""

    text: str

    def __new__(cls, text: str) -> Self:
        """Read a decimal number."""
        number = super().__new__(cls, text)
        number.text = text
        return number


def quantity(value: object, unit: str) -> float:
    """A finite number in the declared unit, or a string such as "1440 rpm", converted to it; "1" or "" for plain
    numbers.

    The exact value of a string is rounded once: "15 cm" is exactly 150 mm. A `RequestError` has the reason alone; the
    caller adds the key.
    """
    if isinstance(value, str):
        return _as_float(_convert(value, unit), value)
    return _number(value, unit)


def exact_angle(value: object) -> Fraction:
    """The exact value of an angle, deg; see `quantity`.

    The digits are decimal, those of a float the fewest that tell it apart, so that a study keeps its angles when it is
    written and read; a unit with pi in its factor has 50 digits.
    """
    if isinstance(value, str):
        _as_float(exact := _convert(value, "deg"), value)
        return exact
    number = _number(value, "deg")
    if isinstance(value, WrittenNumber):
        return Fraction(value.text)
    return Fraction(value) if isinstance(value, Rational) else Fraction(repr(float(number)))


def without_turns(angles: Sequence[Fraction]) -> list[Fraction]:
    """Exact angles, deg, less the whole turns of the first of them."""
    turns = _TURN * int(angles[0] / _TURN) if angles else 0
    return [angle - turns for angle in angles]


def _number(value: object, unit: str) -> float:
    """A finite number that needs no unit."""
    if isinstance(value, bool):
        raise RequestError(f"{format_value(value)} is not a number")
    try:
        number = float(value)  # type: ignore[arg-type]  # raises unless it is a number
    except (TypeError, ValueError):
        raise RequestError(f"{format_value(value)} is not a number or a string with a unit{_example(unit)}") from None
    except OverflowError:
        raise RequestError("the number is too large") from None
    if not math.isfinite(number):
        raise RequestError(f"{number} is not a finite number")
    return number


def _example(unit: str) -> str:
    return "" if unit in ("", "1") else f', such as "10 {unit}"'


def _as_float(exact: Fraction, text: str) -> float:
    """The nearest double of an exact value."""
    try:
        return float(exact)
    except OverflowError:
        raise RequestError(f"{format_value(text)} is too large") from None


def _convert(text: str, unit: str) -> Fraction:
    """Convert a string with a unit to the declared unit, exactly."""
    match = _QUANTITY.fullmatch(text) if len(text) <= _MOST_CHARACTERS else None
    if match is None:
        has_commas = "," in text and _QUANTITY.fullmatch(text[:_MOST_CHARACTERS].replace(",", "")) is not None
        hint = "; write decimals with a point, and thousands without a comma" if has_commas else _example(unit)
        raise RequestError(f"{format_value(text)} is not a number with a unit{hint}")
    number, written_unit = match.groups()
    if written_unit is None:
        with_unit = "" if unit in ("", "1") else f' or "{number} {unit}"'
        raise RequestError(f"{format_value(text)} has no unit; write {number} without quotes{with_unit}")
    # A Fraction keeps the decimal digits: lengths whose sum is exactly 0 in one unit have the sum 0 in every unit.
    return Fraction(number) * unit_factor(written_unit, unit)


def check_unit(unit: str) -> None:
    """Raise `RequestError` unless this is a unit that quantities can be converted to, or "1" for a plain number."""
    if unit == "1":
        return
    if len(unit) > _MOST_CHARACTERS or not re.fullmatch(UNIT, unit):
        raise RequestError(f'{format_value(unit)} is not a unit; write one such as "mm", or "1" for a plain number')
    if common_root(unit) is None:
        _root_units(unit, '; write "1" for a plain number')


def unit_factor(source: str, target: str) -> Fraction:
    """The factor from one unit to another; `RequestError` with the reason if there is none."""
    if target == "rad/s":
        source = _HERTZ.sub("turn/s", source)  # 1 Hz of a rotating part is 1 turn/s
    return _factor(source, target)


def irrational_factor(values: Sequence[object], unit: str) -> Fraction:
    """The factor, with pi, to the declared unit from that which all texts of quantities have; 1 where there is none.

    Decimals of other units are decimals of the declared one.
    """
    matches = [_QUANTITY.fullmatch(value) if isinstance(value, str) else None for value in values]
    units = {match[2] if match else None for match in matches}
    written = units.pop() if len(units) == 1 else None
    factor = unit_factor(written, unit) if written else Fraction(1)
    return factor if max(factor.as_integer_ratio()) > _LARGEST_RATIONAL else Fraction(1)


def join_unit(powers: Mapping[str, int]) -> str:
    """The text of a unit from its factors and their powers: "rad^2/s^4"."""
    above = " ".join(_raised(factor, power) for factor, power in powers.items() if power > 0)
    below = "".join(f"/{_raised(factor, -power)}" for factor, power in powers.items() if power < 0)
    return (above or "1") + below


def _raised(factor: str, power: int) -> str:
    return factor if power == 1 else f"{factor}^{power}"


@functools.cache
def dimension(unit: str) -> tuple[int, int, int]:
    """The powers of length, time and mass in a declared unit: (1, -2, 1) for "N"."""
    if common := common_root(unit):
        return common[1][:3]
    powers = _registry().get_dimensionality(unit)
    length, time, mass = (int(powers.get(base, 0)) for base in ("[length]", "[time]", "[mass]"))
    return length, time, mass


@functools.cache
def _registry() -> pint.UnitRegistry[Fraction]:
    import pint  # takes 0.4 s with its definitions, needed only for units that are not common

    registry: pint.UnitRegistry[Fraction] = pint.UnitRegistry(non_int_type=Fraction)
    registry.define("@alias turn = rev")
    registry.define("@alias revolutions_per_minute = RPM")
    return registry


@functools.lru_cache  # a table of designs repeats its units
def _factor(source: str, target: str) -> Fraction:
    """The factor from one unit to another, exact except for pint's 50 digits of pi."""
    own: tuple[Fraction, object] | None = common_root(source)
    wanted: tuple[Fraction, object] | None = common_root(target)
    if own is None or wanted is None:
        own, wanted = _root_units(source, _unit_hint(target)), _root_units(target or "1", "")
    # Root units, not dimensions: they keep the radian, so that "1 Hz" is not taken for 1 rad/s.
    if own[1] != wanted[1]:
        raise UnitError(f"{format_value(source)} cannot be converted to '{target or '1'}'{_unit_hint(target)}")
    return own[0] / wanted[0]


def _root_units(unit: str, hint: str) -> tuple[Fraction, pint.Unit]:
    """The factor of a unit to its root unit, and that; `hint` ends the message about a unit that is none."""
    import pint

    if len(unit) > _MOST_CHARACTERS:
        raise RequestError(f"{format_value(unit)} is not a unit{hint}")
    if _TON.search(unit):
        raise UnitError("'ton' is 907, 1000 or 1016 kg; write short_ton, tonne or long_ton")
    try:
        factor, root = _registry().get_root_units(unit.replace("·", "*"))
    except pint.UndefinedUnitError as error:
        unknown = error.unit_names[0]
        match = closest_name(unit, _COMMON_UNITS) or closest_name(unknown, _COMMON_UNITS)
        raise RequestError(f"unknown unit '{unknown}'" + (f"; did you mean '{match}'?" if match else hint)) from None
    except Exception:  # pint's parser raises many kinds for a malformed unit
        raise RequestError(f"cannot read the unit '{unit}'{hint}") from None
    return Fraction(str(factor)), root


def _unit_hint(unit: str) -> str:
    return "; use a plain number" if unit in ("", "1") else f"; use {_EXAMPLES.get(unit, unit)}"
