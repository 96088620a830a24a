"""What mechanisms under load share: declared loads, work and energy of the drive in a turn, the largest of forces."""

import math
from dataclasses import replace
from functools import partial

import numpy as np

from explore.model.quantities import FloatArray, Formula, Parameter

#: Parameter of the load, none by default.
load_parameter = partial(Parameter, default=0.0, affects="load", zero_meaning="none")


def largest(*values: FloatArray) -> FloatArray:
    """The largest of several metrics, NaN where one of them is."""
    result: FloatArray = np.maximum.reduce(values)
    return result


def largest_magnitude(low: FloatArray, high: FloatArray) -> FloatArray:
    """The largest magnitude of a signal, from its extremes."""
    return np.maximum(np.abs(low), np.abs(high))


def _work(mean_power: FloatArray, speed: FloatArray) -> FloatArray:
    return mean_power * (2.0 * math.pi / speed)


# A mechanism has the signals "positive_power" and "friction_power", the window "cycle" and the parameter "speed".
#: Metrics of the work of the drive in a turn.
WORK_FORMULAS = (
    Formula("positive_work", "N m", "work of the drive in a turn where it drives", "min",
            ("positive_power_mean_cycle", "speed"), _work),
    Formula("net_work", "N m", "work of the drive in a turn: what the load dissipates", "min",
            ("friction_power_mean_cycle", "speed"), _work),
)  # fmt: skip
#: Metric of the energy by which a flywheel is sized; of mechanisms with the signal "drive_torque".
ENERGY_FLUCTUATION = Formula(
    "energy_fluctuation", "N m", "energy that a flywheel stores and gives back in a turn at constant torque", "min",
    ("drive_torque_fluctuation_cycle",), largest, is_proportional=True,
)  # fmt: skip
#: Metric of the net work where torques on links that turn fully give or take some of it.
NET_WORK_OF_DRIVE = replace(
    WORK_FORMULAS[1], long_name="work of the drive in a turn", inputs=("drive_power_mean_cycle", "speed"),
    is_proportional=True,
)  # fmt: skip
