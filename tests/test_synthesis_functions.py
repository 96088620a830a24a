"""Function generators: reference values, exact recovery, and the true error of the output."""

import numpy as np
import pytest
from synthesis_cases import case

from explore.base.errors import RequestError
from explore.synthesis.functions import FourBarGenerator, fit_four_bar, output_angles, wrapped
from explore.synthesis.linkages import FourBar
from explore.synthesis.turning_generators import FunctionTask, find_turning_generators

LAWS = {"log10": np.log10, "x^1.5": lambda x: x**1.5}


def angles_of(inputs, x):
    """Input and output angles at values of the variable."""
    law, (first, last) = LAWS[inputs["function"]], inputs["x"]
    share = (law(x) - law(first)) / (law(last) - law(first))
    phi = inputs["phi0_deg"] + inputs["dphi_deg"] * (x - first) / (last - first)
    return np.radians(phi), np.radians(inputs["psi0_deg"] + inputs["dpsi_deg"] * share)


@pytest.mark.parametrize("name", ["funcgen3_log10", "funcgen3_x^1.5"])
def test_three_positions_exactly(name):
    inputs, outputs = case(name)
    x = np.array([float(value) for value in outputs["x"]])
    generator = fit_four_bar(*angles_of(inputs, x))
    expected = [float(outputs[key]) for key in ("l1", "l2", "l3")]
    # The condition of the three equations is about 30.
    assert [generator.crank, generator.coupler, generator.rocker] == pytest.approx(expected, rel=1e-13)
    phi, psi = angles_of(inputs, x)
    assert np.abs(wrapped(generator.outputs(phi) - psi)).max() < 1e-13
    phi, psi = angles_of(inputs, np.linspace(*inputs["x"], 401))
    errors = np.degrees(wrapped(generator.outputs(phi) - psi))
    assert np.abs(errors).max() == pytest.approx(float(outputs["max_error_deg_401_samples"]), rel=1e-11)
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(float(outputs["rms_error_deg_401_samples"]), rel=1e-11)


@pytest.mark.parametrize(("name", "law"), [("funcgenLS_1", lambda p: p**2 / 2), ("funcgenLS_2", np.log1p)])
def test_least_squares_of_the_equation(name, law):
    inputs, outputs = case(name)
    turned = np.linspace(0, np.radians(inputs["dphi_deg"]), inputs["n"])
    phi, psi = np.radians(inputs["phi0_deg"]) + turned, np.radians(inputs["psi0_deg"]) + law(turned)
    generator = fit_four_bar(phi, psi)
    expected = [float(outputs[key]) for key in ("l1", "l2", "l3")]
    assert [generator.crank, generator.coupler, generator.rocker] == pytest.approx(expected, rel=1e-12)
    error = np.degrees(np.abs(wrapped(generator.outputs(phi) - psi)).max())
    assert error == pytest.approx(float(outputs["max_output_error_deg"]), rel=1e-11)


def test_exact_data_give_the_four_bar_back():
    rng = np.random.default_rng(6)
    recovered = 0
    while recovered < 1000:
        linkage = FourBar(0j, 1 + 0j, *rng.uniform(0.2, 3, 3).tolist(), 0j, int(rng.choice([1, -1])))
        phi = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.uniform(0.1, 0.4, 5))
        psi = np.angle(linkage.rocker_pins(phi) - 1)
        if np.isnan(psi).any():
            continue
        recovered += 1
        found = fit_four_bar(phi, np.unwrap(psi))
        expected = [linkage.crank, linkage.coupler, linkage.rocker]
        assert [found.crank, found.coupler, found.rocker] == pytest.approx(expected, rel=1e-6)
        assert np.abs(wrapped(found.outputs(phi) - psi)).max() < 1e-6


def test_x_to_the_power_1_5():
    inputs, _ = case("funcgen3_x^1.5")
    phi, psi = angles_of(inputs, np.linspace(1, 4, 101))
    best = find_turning_generators(FunctionTask(phi - phi[0], psi - psi[0], np.radians(30), 10.0))[0]
    assert np.degrees(best.error_max) == pytest.approx(0.0360, abs=1e-4)


def test_outputs_are_those_of_the_linkage():
    linkage = FourBar(0j, 1 + 0j, 0.4, 0.9, 0.8, 0j, 1)
    phi = np.linspace(0, 2 * np.pi, 50)
    lengths = np.array([0.4, 0.9, 0.8])
    found = [output_angles(lengths, phi, branch) for branch in (1, -1)]
    expected = np.angle(linkage.rocker_pins(phi) - 1)
    assert min(np.abs(wrapped(each - expected)).max() for each in found) < 1e-14


@pytest.mark.parametrize(
    ("inputs", "outputs", "message"),
    [
        ([0.1, 0.2], [0.1, 0.3], "three pairs or more"),
        ([0.1, 0.1, 0.1], [0.1, 0.3, 0.4], "one does not turn"),
        ([0.1, 0.5, 0.9], [0.1, 0.5, 0.9], "turn alike"),
        ([0.1, 0.5, 0.9], [0.4, 0.8, 1.2], "only a parallelogram"),
    ],
)
def test_pairs_that_determine_no_four_bar(inputs, outputs, message):
    with pytest.raises(RequestError, match=message):
        fit_four_bar(np.array(inputs), np.array(outputs))


def test_branch_is_that_of_the_data():
    for branch in (1, -1):
        lengths = np.array([0.5, 1.2, 0.9])
        phi = np.array([0.3, 0.9, 1.5, 2.0])
        assert fit_four_bar(phi, output_angles(lengths, phi, branch)) == FourBarGenerator(
            *(pytest.approx(length, rel=1e-11) for length in lengths), branch
        )
