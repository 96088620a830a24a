"""Numbers with units."""

import math
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from explore.base.errors import RequestError
from explore.base.units.common import _UNITS, common_root
from explore.base.units.quantities import _registry, dimension, quantity


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("60 rpm", "rad/s", 2.0 * math.pi),
        ("60 rev/min", "rad/s", 2.0 * math.pi),
        ("60 RPM", "rad/s", 2.0 * math.pi),
        ("360 deg/s", "rad/s", 2.0 * math.pi),
        ("180 deg", "deg", 180.0),
        ("0.5236 rad", "deg", math.degrees(0.5236)),
        ("108.34236 cm", "mm", 1083.4236),
        ("54.17118cm", "mm", 541.7118),
        ("1 in", "mm", 25.4),
        ("5. mm", "mm", 5.0),
        (".5e1 mm", "mm", 5.0),
        ("30 %", "1", 0.3),
        ("12 Hz", "rad/s", 24.0 * math.pi),
        ("25 kN m", "N m", 25e3),
        ("206 GPa", "MPa", 206e3),
        ("44.6 kN", "N", 44.6e3),
        ("2 N m/deg", "N m/rad", 360.0 / math.pi),
        ("1 rad^2/s^2", "rad^2/s^2", 1.0),
    ],
)
def test_units_to_full_precision(text, unit, value):
    # Digits are kept as written and the factor is exact, so that one rounding remains: at most one unit in the last
    # place against the expected value, which is itself rounded. Lengths must be exact: the sum 150 + 1083.4236 -
    # 541.7118 - 691.7118 has to stay exactly 0.
    result = quantity(text, unit)
    assert abs(result - value) <= (0.0 if unit == "mm" else math.ulp(value))


_POWERED = st.builds("{}^{}".format, st.sampled_from(sorted(_UNITS)), st.integers(-3, 3).filter(bool))
_FACTORS = st.sampled_from(sorted(_UNITS)) | _POWERED


def assert_is_that_of_pint(unit):
    factor, root = _registry().get_root_units(unit)
    own, powers = common_root(unit)
    assert own == Fraction(factor)
    named = zip(("meter", "second", "gram", "radian"), powers, strict=True)
    assert {name: power for name, power in named if power} == dict(root._units)


@settings(derandomize=True, deadline=None)  # the first call reads the definitions of pint
@given(st.lists(_FACTORS, min_size=1, max_size=4), st.lists(st.sampled_from((" ", "*", "/", " / ")), min_size=3))
def test_common_units_are_those_of_pint(factors, signs):
    assert_is_that_of_pint(factors[0] + "".join(map("".join, zip(signs, factors[1:], strict=False))))


@pytest.mark.parametrize("name", _UNITS)
def test_each_common_unit_is_that_of_pint(name):
    assert_is_that_of_pint(name)


@pytest.mark.parametrize(
    ("value", "unit", "reason"),
    [
        ("5 kg", "mm", "'kg' cannot be converted to 'mm'; use mm, cm, m or in"),
        ("1 1/s", "rad/s", "'1/s' cannot be converted to 'rad/s'; use rad/s, deg/s, rpm or Hz"),
        ("3 mmm", "mm", "unknown unit 'mmm'; did you mean 'mm'"),
        ("3 furlongz", "mm", "unknown unit 'furlongz'; use mm, cm, m or in"),
        ("100", "mm", 'has no unit; write 100 without quotes or "100 mm"'),
        ("2 ton", "kg", "'ton' is 907, 1000 or 1016 kg; write short_ton, tonne or long_ton"),
        ("3", "1", "write 3 without quotes"),
        ("3 mm", "1", "use a plain number"),
        ("nan mm", "mm", "is not a number with a unit"),
        ("", "mm", "is not a number with a unit"),
        ("40,5 mm", "mm", "is not a number with a unit; write decimals with a point, and thousands without a comma"),
        ("4;5 mm", "mm", 'is not a number with a unit, such as "10 mm"'),
        ("10**10**10 mm", "mm", "is not a number with a unit"),
        ("1e308 km", "mm", "too large"),
        (10**400, "mm", "too large"),
        pytest.param(16**5000, "mm", "too large", id="too long to print"),
        (True, "mm", "true is not a number"),
        (None, "mm", "is not a number or a string with a unit"),
        (math.inf, "mm", "inf is not a finite number"),
    ],
)
def test_bad_quantities(value, unit, reason):
    with pytest.raises(RequestError) as caught:
        quantity(value, unit)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("", (0, 0, 0)),
        ("1", (0, 0, 0)),
        ("deg", (0, 0, 0)),
        ("mm", (1, 0, 0)),
        ("rad^2/s^4", (0, -4, 0)),
        ("deg/mm", (-1, 0, 0)),
        ("N", (1, -2, 1)),
        ("N m s/rad", (2, -1, 1)),
        ("MPa", (-1, -2, 1)),
        ("W", (2, -3, 1)),
        ("h", (0, 1, 0)),
    ],
)
def test_dimensions(unit, powers):
    assert dimension(unit) == powers
