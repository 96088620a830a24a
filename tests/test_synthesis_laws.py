"""Laws of function generators: Chebyshev's spacing, formulas, tables, and what is refused."""

import numpy as np
import pytest
from synthesis_cases import case

from explore.base.errors import RequestError
from explore.synthesis.laws import chebyshev_points, formula_law, table_law


@pytest.mark.parametrize("name", ["funcgen3_log10", "funcgen3_x^1.5"])
def test_precision_points_of_the_reference_cases(name):
    inputs, outputs = case(name)
    assert chebyshev_points(*inputs["x"], 3) == pytest.approx(np.array(outputs["x"], dtype=float), rel=1e-15)


def test_a_formula_is_scaled_to_angles():
    law = formula_law("log(x) / log(10)", 1, 2)
    x = np.array([1, 1.5, 2])
    assert law.inputs(x, 60) == pytest.approx([0, 30, 60])
    assert law.outputs(x, 90) == pytest.approx(90 * np.log10(x) / np.log10(2), rel=1e-14)


def test_a_falling_function_turns_the_output_back():
    law = formula_law("1 / x", 1, 2)
    assert law.outputs(np.array([1.0, 2.0]), 50) == pytest.approx([0, -50])
    # A range may fall, too.
    assert formula_law("1 / x", 2, 1).outputs(np.array([2.0, 1.0]), 50) == pytest.approx([0, 50])


def test_a_table_is_met_at_its_pairs():
    law = table_law([3, 2, 1], [10, 7, -2])
    assert law.values(np.array([1.0, 2.0, 3.0])) == pytest.approx([-2, 7, 10])
    assert (law.first, law.last) == (3, 1)
    # No overshoot between the pairs.
    assert np.ptp(law.values(law.even(100))) == pytest.approx(12)


@pytest.mark.parametrize(
    ("text", "first", "last", "message"),
    [
        ("log(x)", -1, 2, "has no value at x = -1"),
        ("1 / (x - 1)", 0, 2, "has no value at x = 1"),
        ("x * 0 + 3", 0, 1, "one value over the whole range"),
        ("y + x", 0, 1, "a formula of x alone, got the name 'y'"),
        ("3", 0, 1, "does not depend on x"),
        ("2 x", 0, 1, "expected an operator"),
    ],
)
def test_formulas_that_are_refused(text, first, last, message):
    with pytest.raises(RequestError, match=message):
        formula_law(text, first, last)


@pytest.mark.parametrize(
    ("x", "y", "message"),
    [
        ([1, 2], [1, 2], "three or more"),
        ([1, 2, 2], [1, 2, 3], "must ascend"),
        ([1, 2, 3], [5, 5, 5], "one value"),
    ],
)
def test_tables_that_are_refused(x, y, message):
    with pytest.raises(RequestError, match=message):
        table_law(x, y)


@pytest.mark.parametrize(
    ("law", "places"),
    [
        (formula_law("abs(x - 0.4112)", 0.0, 1.0), [0.4112, 1.0]),
        (formula_law("sin(x)", 0.0, 170.0), [0.0, 90.0]),
        (table_law([0.0, 1.0, 3.3], [0.0, 1.0, 0.0]), [0.0, 1.0]),
    ],
)
def test_the_output_turns_from_the_least_to_the_greatest_value_between_samples_too(law, places):
    """From sample to sample the first turned by 90 deg, from the fold on by 90.18."""
    assert np.ptp(law.outputs(np.array(places), 90.0)) == pytest.approx(90.0, rel=1e-12)


def test_a_pole_between_two_samples_is_refused():
    with pytest.raises(RequestError, match="has a pole within the range; change the range"):
        formula_law("1 / (x - 0.4112)", 0.0, 1.0)
    assert formula_law("exp(-1e6 * (x - 0.4112) ** 2)", 0.0, 1.0).height == pytest.approx(1.0, rel=1e-9)
