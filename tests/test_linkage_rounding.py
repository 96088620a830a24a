"""Rounding errors of linkages: bounds from disturbed samples against motions with the digits of mpmath."""

import math

import mpmath
import numpy as np
import pytest
from linkage_cases import CASES, columns, evaluate_graph, linkage_of, near_limits, scattered, trace, turns, values_of
from numba import njit

import explore
from explore.base.lanes.disturbance import DISTURBANCE, FACTORS, PERIOD, first_factor
from explore.evaluation.evaluate import evaluate_columns
from explore.studies.request.requests import make_request


def test_factors_have_random_signs_and_differ_from_node_to_node():
    signs = (FACTORS - 1.0) / DISTURBANCE
    assert set(signs) == {-1.0, 1.0}
    assert abs(signs.sum()) < 3.0 * math.sqrt(len(signs))
    assert {first_factor(node) for node in range(PERIOD)} == set(range(PERIOD))


@njit
def _call(fill, constants, tangents, anchor, law, variant, count, needs, out):
    fill(constants, tangents, anchor, law, variant, count, needs, out)


def test_disturbed_samples_tell_the_derivatives_by_all_operations():
    """The mean square of changes of a crank pin's place, r cos and r sin, is that of two operations."""
    kernel = linkage_of(CASES["watt-2"]).mechanism.for_signals(["A_x", "A_y"])
    design = {name: np.array([value]) for name, value in values_of(CASES["watt-2"]).items()}
    count, tangents = 64, np.repeat(np.linspace(-0.9, 0.9, 64), 16)
    constants = np.repeat(kernel.constants(columns(kernel, design))[:, 0], 16)
    samples, disturbed = (np.empty(count * kernel.signal_rows * 16) for _ in range(2))
    for fill, out in ((kernel.fill, samples), (kernel.disturbed_fill, disturbed)):
        _call(fill, constants, tangents, 0, 0, 0, count, 1, out)
    shape = (count, kernel.signal_rows, 16)
    changes = ((disturbed - samples) / DISTURBANCE).reshape(shape)[:, :2, 0]
    expected = 2.0 * (samples.reshape(shape)[:, :2, 0] ** 2).mean(axis=0)
    assert (changes**2).mean(axis=0) == pytest.approx(expected, rel=0.5)


def test_rounding_is_not_overestimated():
    """Of Watt linkages near their limits all but a few keep 12 digits, and their bounds say so."""
    case = CASES["watt-2"]
    linkage = linkage_of(case)
    names = ("coupler_velocity", "coupler_acceleration", "rocker_velocity", "rocker_acceleration")
    metrics = [f"{name}_{statistic}" for name in names for statistic in ("mean", "variance", "max")]
    made = make_request(linkage.mechanism, metrics=metrics, window="cycle", tolerance=1e-12)
    rng = np.random.default_rng(3)
    designs = near_limits(made.kernel, scattered(case, 400, rng, 0.25), 100, rng)
    status = evaluate_columns(made, designs).columns["status"]
    assert np.count_nonzero(status == 1) >= 97


@pytest.mark.parametrize("margin", [1e-3, 1e-7, 1e-10])
def test_the_smallest_transmission_angle_is_within_its_bound_beside_the_limit(margin):
    """It follows from the square of the sine of an angle that is almost 0: half of the digits are lost."""
    case = CASES["watt-2"]
    linkage = linkage_of(case)
    kernel = linkage.mechanism.for_signals(())
    design = {name: np.array([value]) for name, value in values_of(case).items()}
    low, high = values_of(case)["fx"], 2.0 * values_of(case)["fx"]
    while high - low > 1e-13 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if turns(kernel, design | {"fx": np.array([middle])})[0] else (low, middle)
    values = {**values_of(case), "fx": low * (1.0 - margin)}
    row = explore.evaluate(linkage, values, metrics=["transmission_angle_min"], tolerance=1e-9).iloc[0]
    equations = trace(linkage)
    factor = equations.factors[-1].value
    sine, cosine = equations.transmission["E"]
    with mpmath.workdps(40):
        start = min(np.linspace(0.0, 2.0 * math.pi, 721), key=lambda t: evaluate_graph([factor.terms[0]], values, t)[0])
        at = mpmath.findroot(lambda t: evaluate_graph([factor.terms[1]], values, t)[0], (start, start + 1e-3))
        exact = 180 - mpmath.degrees(mpmath.atan2(*evaluate_graph([sine, cosine], values, at)))
        error = abs(mpmath.mpf(row["transmission_angle_min"]) - exact) / exact
    # or what the root of the margin costs: the error may be small by chance
    assert error <= row["error"] <= max(1e3 * error, 5e-12 / math.sqrt(margin))
