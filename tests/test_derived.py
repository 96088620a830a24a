"""Error bounds of derived metrics, from formulas whose errors are known by hand."""

from contextlib import suppress

import numpy as np
import pytest
from linkage_cases import loaded_shaper

import explore
from explore.base.errors import RequestError
from explore.evaluation import evaluate
from explore.evaluation.derived import Derivation
from explore.mechanisms.registry import MECHANISMS
from explore.model.quantities import DerivedMetric, Formula, Metric
from explore.model.status import Status

RIG = {"crank": 37.0, "coupler": 1271.5, "rocker": 595.0, "ground": 751.0}


def bound_of(function, values, errors, **kind):
    """Error bound of a formula at one point."""
    inputs = tuple(Metric(name, "1", name) for name in "ab"[: len(values)])
    formula = Formula("f", "1", "f", None, tuple("ab"[: len(values)]), function, **kind)
    arrays = ({name: np.array([x]) for name, x in zip("ab", numbers, strict=False)} for numbers in (values, errors))
    metric = DerivedMetric("f", "1", "f", None, formula, inputs)
    value, error, _ = Derivation({}, *arrays, tolerance=1e-9).evaluate(metric)
    assert value[0] == function(*map(np.array, values))
    return error[0]


def test_the_changes_by_the_inputs_add_up_unless_the_formula_selects_one():
    assert bound_of(np.add, (3.0, 4.0), (0.1, 0.2)) == pytest.approx(0.3, rel=1e-12)
    assert bound_of(np.maximum, (4.0, 4.0), (0.1, 0.2), selects_one=True) == pytest.approx(0.2, rel=1e-12)


@pytest.mark.parametrize("mechanism", [*MECHANISMS.values(), loaded_shaper().mechanism], ids=lambda each: each.name)
def test_a_formula_selects_one_where_its_magnitude_is_always_that_of_an_input(mechanism):
    rng = np.random.default_rng(1)
    for formula in (each for each in mechanism.formulas if len(each.inputs) > 1):
        inputs, is_input = rng.uniform(-2.0, 2.0, (len(formula.inputs), 50)), False
        with np.errstate(all="ignore"), suppress(RequestError):  # sizes that are not positive are refused
            is_input = (np.abs(formula.function(*inputs)) == np.abs(inputs)).any(axis=0).all()
        assert formula.selects_one == is_input, formula.name


def test_an_input_may_err_in_both_directions():
    for function in (np.minimum, np.maximum):
        assert bound_of(lambda a, f=function: f(a, 5.0), (5.0,), (0.5,)) == pytest.approx(0.5, rel=1e-12)


def test_a_magnitude_does_not_err_below_zero():
    assert bound_of(np.sqrt, (0.01,), (1.0,)) == pytest.approx(np.sqrt(1.01) - 0.1, rel=1e-12)


def test_the_bound_of_an_extreme_is_relative_to_the_extreme(monkeypatch):
    """Not to the root mean square, which is smaller: of a peak alone both bounds are the same."""
    bounds = []

    def derive(*arguments, real=evaluate.derive):
        result = real(*arguments)
        bounds.append(result[1])
        return result

    monkeypatch.setattr(evaluate, "derive", derive)
    frame = explore.evaluate("test-rig", RIG | {"constant_torque": 25e3}, metrics=["coupler_force_peak"])
    assert bounds[0][0] == pytest.approx(frame["error"][0], rel=1e-12)


def test_a_formula_multiplies_the_error_of_its_input():
    """A life is the load to the power -10/3."""
    load = {"constant_torque": 25e3, "bearing_rating": 44.6e3}
    life = explore.evaluate("test-rig", RIG | load, metrics=["bearing_life"], tolerance=1e-9)
    mean = explore.evaluate("test-rig", RIG | load, metrics=["pin_force_a_power_mean"], tolerance=2e-11)
    assert life["error"][0] == pytest.approx(10.0 / 3.0 * mean["error"][0], rel=0.1)


def test_a_design_that_lacks_a_parameter_says_so_whatever_its_error():
    kite = {"crank": 0.74187406, "coupler": 0.7617274, "rocker": 0.7637541, "ground": 0.74390088}
    designs = kite | {"constant_torque": 1.0, "bearing_rating": np.array([0.0, 1.0])}
    frame = explore.evaluate("test-rig", designs, metrics=["bearing_life", "rocker_acceleration_max"], tolerance=1e-13)
    assert frame["status"].tolist() == [Status.NOT_GIVEN, Status.TOLERANCE_NOT_MET]
