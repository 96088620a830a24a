"""The rounding of a signal is compared with its own size, whatever the units and sizes of others in the request."""

import numpy as np
import pytest
from simple_slider import SIMPLE_SLIDER

import explore
from explore.mechanisms.registry import MECHANISMS

#: Statistics that have a bound of each kind.
STATISTICS = ("mean", "variance", "std", "rms", "max", "peak_to_peak")
#: A position of a million crank lengths beside a velocity of about one, an ordinary design, and a short rod.
DESIGNS = {"crank": 1.0, "rod": [1e6, 3.0, 1.6], "offset": [0.0, 0.5, -0.5]}


def bounds(*metrics, factor=1.0):
    """The bounds of designs whose lengths grow by a factor, where the nodes leave little more than rounding."""
    designs = {name: factor * np.broadcast_to(lengths, 3) for name, lengths in DESIGNS.items()}
    with MECHANISMS.including(SIMPLE_SLIDER):
        return explore.evaluate("simple-slider", designs, metrics=metrics, tolerance=1e-13)["error"].to_numpy()


@pytest.mark.parametrize("statistic", STATISTICS)
def test_a_bound_does_not_depend_on_signals_of_other_sizes(statistic):
    position, velocity = f"position_{statistic}", f"velocity_{statistic}"
    if statistic == "mean":  # of the velocity it is 0
        velocity = "velocity_rms"
    alone = np.maximum(bounds(position), bounds(velocity))
    # together they have as many nodes as the one that needs more, and less is left of its error
    assert bounds(position, velocity) == pytest.approx(alone, rel=0.5)
    assert (bounds(velocity) < 1e-13).all()


def test_a_bound_does_not_depend_on_the_unit_of_length():
    """Also with the terms that cancel in the velocity, which `noise_row` tells: powers of 2 change no digit."""
    for statistic in STATISTICS[1:]:
        for signal in ("position", "velocity"):
            name = f"{signal}_{statistic}"
            assert np.array_equal(bounds(name, factor=1024.0), bounds(name))
            assert np.array_equal(bounds(name, factor=2.0**-30), bounds(name))
