"""Factors of common units, exact, without the 0.4 s that pint takes with its definitions."""

import re
from fractions import Fraction

#: Half a turn in rad, with as many digits as pint has.
_PI = Fraction("3.1415926535897932384626433832795028841971693993751")
#: Powers of meter, second, gram and radian.
Root = tuple[int, int, int, int]

_LENGTH: Root = (1, 0, 0, 0)
_TIME: Root = (0, 1, 0, 0)
_MASS: Root = (0, 0, 1, 0)
_ANGLE: Root = (0, 0, 0, 1)
_STRESS: Root = (-1, -2, 1, 0)

#: Factor to meter, second, gram and radian, and their powers.
_UNITS: dict[str, tuple[Fraction | int, Root]] = {
    "mm": (Fraction(1, 1000), _LENGTH), "cm": (Fraction(1, 100), _LENGTH), "m": (1, _LENGTH),
    "um": (Fraction(1, 10**6), _LENGTH), "in": (Fraction(127, 5000), _LENGTH), "inch": (Fraction(127, 5000), _LENGTH),
    "ft": (Fraction(381, 1250), _LENGTH), "s": (1, _TIME), "ms": (Fraction(1, 1000), _TIME), "min": (60, _TIME),
    "g": (1, _MASS), "kg": (1000, _MASS), "rad": (1, _ANGLE), "deg": (_PI / 180, _ANGLE), "turn": (2 * _PI, _ANGLE),
    "rev": (2 * _PI, _ANGLE), "rpm": (2 * _PI / 60, (0, -1, 0, 1)), "RPM": (2 * _PI / 60, (0, -1, 0, 1)),
    "Hz": (1, (0, -1, 0, 0)), "N": (1000, (1, -2, 1, 0)), "kN": (10**6, (1, -2, 1, 0)), "Pa": (1000, _STRESS),
    "MPa": (10**9, _STRESS), "GPa": (10**12, _STRESS), "J": (1000, (2, -2, 1, 0)), "W": (1000, (2, -3, 1, 0)),
    "kW": (10**6, (2, -3, 1, 0)),
}  # fmt: skip

_FACTOR = r"[^\W\d](?:[^\W\d]|[°%])*|[°%]"
_POWERED = rf"(?:{_FACTOR})(?:(?:\^|\*\*)-?[1-9])?"
#: Grammar of units: factors such as "mm", "rad/s^2", "N m".
UNIT = rf"(?:1\s*/\s*)?{_POWERED}(?:\s*[*/·]\s*{_POWERED}|\s+{_POWERED})*"

_TERM = re.compile(rf"([*/·]?)\s*({_FACTOR})(?:(?:\^|\*\*)(-?[1-9]))?")


def split_unit(unit: str) -> dict[str, int] | None:
    """The factors of a unit with their powers: {"rad": 2, "s": -4} for "rad^2/s^4"; None for another notation."""
    if not re.fullmatch(UNIT, unit):
        return None
    powers: dict[str, int] = {}
    for sign, factor, power in _TERM.findall(unit):
        powers[factor] = powers.get(factor, 0) + (-1 if sign == "/" else 1) * int(power or 1)
    return powers


def common_root(unit: str) -> tuple[Fraction, Root] | None:
    """The factor of a unit to its root unit, and that; None unless all of its factors are common."""
    powers = {} if unit in ("", "1") else split_unit(unit)
    if powers is None or not powers.keys() <= _UNITS.keys():
        return None
    factor, root = Fraction(1), [0, 0, 0, 0]
    for name, power in powers.items():
        own, exponents = _UNITS[name]
        factor *= Fraction(own) ** power
        root = [total + power * exponent for total, exponent in zip(root, exponents, strict=True)]
    return factor, (root[0], root[1], root[2], root[3])
