"""Every sizing rule takes arrays, returns NaN for NaN and refuses values without physical meaning."""

import inspect
from itertools import pairwise

import numpy as np
import pytest

from explore import sizing
from explore.base.errors import RequestError

RULES = [getattr(sizing, name) for name in sizing.__all__]
VALUES = {"hollow_ratio": 0.5, "sensitivity": 0.8, "position": 0.3, "surface": "machined", "load": 2.0}
# beyond zero and NaN: accelerations and mean stress have signs, and the position is a coordinate
SIGNED = {"acceleration_start", "acceleration_end", "mean", "position"}


def arguments(rule):
    names = inspect.signature(rule).parameters
    values = {name: VALUES.get(name, 3.0) for name in names}
    return values | ({"load": "axial"} if rule is sizing.endurance_limit else {})


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_rules_take_arrays_as_they_take_numbers(rule):
    values = arguments(rule)
    numbers = [name for name, value in values.items() if not isinstance(value, str)]
    scalar = rule(**values)
    assert np.ndim(scalar) == 0
    assert isinstance(float(scalar), float)
    factors = np.array([0.9, 1.0, 1.1])
    for name in numbers:  # one array, the others numbers
        many = rule(**values | {name: values[name] * factors})
        each = [rule(**values | {name: values[name] * factor}) for factor in factors]
        np.testing.assert_allclose(many, each, rtol=1e-15)
    for name, other in pairwise(numbers):  # a column and a row
        table = rule(**values | {name: values[name] * factors[:, None], other: values[other] * factors[None, :2]})
        assert np.shape(table) == (3, 2)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_nan_gives_nan_and_invalid_values_are_refused(rule):
    values = arguments(rule)
    for name, value in values.items():
        if isinstance(value, str):
            with pytest.raises(RequestError, match=f"{name}: unknown 'mashined'"):
                rule(**values | {name: "mashined"})
            continue
        out = rule(**values | {name: np.array([value, np.nan])})
        assert np.isfinite(out[0])
        assert np.isnan(out[1]), name
        assert np.isnan(rule(**values | {name: np.nan}))
        if name not in SIGNED:
            for invalid in (-1.0, np.array([value, -2.0])):
                with pytest.raises(RequestError, match=f"^{name}: must be .*, got -[12]$"):
                    rule(**values | {name: invalid})


def test_messages_of_refused_values():
    with pytest.raises(RequestError, match="^allowed_stress: must be greater than 0, got 0$"):
        sizing.rod_diameter(1.0, 0.0)
    with pytest.raises(RequestError, match="^force: must be 0 or more; give the magnitude, got -5$"):
        sizing.pin_diameter(-5.0, 80.0)
    with pytest.raises(RequestError, match="^hollow_ratio: must be below 1, got 1$"):
        sizing.rod_diameter(1.0, 100.0, 1.0)
    with pytest.raises(RequestError, match="^sensitivity: must be at most 1, got 2$"):
        sizing.notch_factor(2.0, 2.0)
