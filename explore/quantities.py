"""What a mechanism declares of its own quantities, as frozen data: parameters, signals, windows, and metrics of all
kinds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Sense = Literal["min", "max"]

STATISTICS = ("mean", "variance", "std", "cv", "min", "max", "rms", "peak_to_peak")
#: Those of a magnitude. "power_mean" is (mean |x|^(10/3))^(3/10), by which roller bearings are sized.
MAGNITUDE_STATISTICS = ("mean", "max", "rms", "power_mean")

#: What 0 means for a parameter that a metric cannot do without.
OMITTED = "not given"


@dataclass(frozen=True)
class Parameter:
    """An input of a mechanism: one column of every sweep that names it.

    Values must be ``> lower`` and ``<= upper``. `zero` says what 0 means where it is allowed as well, such as "none";
    where it is `OMITTED`, no metric that needs the parameter is computed. `only_in` names the windows that the
    parameter matters to; none means all. `scales_speed` marks the input speed: velocities are proportional to it and
    accelerations to its square, so it never asks for a new kinematic evaluation.

    `enters` is what depends on the parameter: the motion and all that follows from it, only the signals under load, or
    only derived metrics, as allowed stresses do. A parameter that is `dynamic` makes the signals under load depend on
    the speed unless it is 0.
    """

    name: str
    unit: str
    long_name: str
    default: float | None = None
    lower: float = 0.0
    upper: float = np.inf
    choices: tuple[float, ...] = ()
    only_in: tuple[str, ...] = ()
    scales_speed: bool = False
    zero: str = ""
    enters: Literal["motion", "load", "sizing"] = "motion"
    dynamic: bool = False

    def allows(self, values: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether numbers are values that the parameter can take, of their shape."""
        numbers = np.asarray(values, dtype=np.float64)
        good = (numbers > self.lower) & (numbers <= self.upper) & np.isfinite(numbers)
        if self.zero:
            good |= numbers == 0.0
        return good & np.isin(numbers, self.choices) if self.choices else good


@dataclass(frozen=True)
class Signal:
    """A function of the crank angle: one row of the scratch array, times speed to a power.

    `needs` is the bit that the mechanism's kernel must be given to fill the row; `pole_order` is the power of the
    node count in the quadrature's error model (2 for velocities, 4 for accelerations). A `rectified` signal is
    taken in the sense in which its mean is positive. `needs_stroke` marks angles that have no mean when the output
    turns on and on. `only_in` restricts a signal to the windows named.

    A `loaded` signal depends on the parameters that enter the load, of which one of `requires` must not be 0, and
    through them on the speed. The row of a `magnitude` holds its square, which has no corner where the signal touches
    0. `terms` is the row with the size of the terms that a signal is the sum of, which bounds its rounding; a `rest` is
    small beside them and has their singularities.
    """

    name: str
    unit: str
    long_name: str
    row: int
    needs: int
    speed_power: int = 0
    pole_order: int = 2
    rectified: bool = False
    needs_stroke: bool = False
    only_in: tuple[str, ...] = ()
    loaded: bool = False
    requires: tuple[str, ...] = ()
    magnitude: bool = False
    terms: int = -1
    rest: bool = False

    @property
    def statistics(self) -> tuple[str, ...]:
        """The statistics that can be asked of it."""
        return MAGNITUDE_STATISTICS if self.magnitude else STATISTICS


@dataclass(frozen=True)
class Metric:
    """A closed-form metric: known from the geometry alone. `labels` name the values of an integer code.

    All its values are ``>= lower`` and ``<= upper``, so that nobody solves for another.
    """

    name: str
    unit: str
    long_name: str
    sense: Sense | None = None
    labels: tuple[str, ...] = ()
    lower: float = -np.inf
    upper: float = np.inf


@dataclass(frozen=True)
class Window:
    """A part of the turn: `code` is what the mechanism's kernel is told; `needs_stroke` marks windows that only
    exist when the output rocks; `start` and `stop` (rad) belong to explicit intervals.
    """

    name: str
    code: int
    long_name: str
    needs_stroke: bool = True
    start: float = 0.0
    stop: float = 0.0


@dataclass(frozen=True)
class SampledMetric:
    """A statistic of a signal over a window."""

    name: str
    unit: str
    long_name: str
    sense: Sense | None
    signal: Signal
    statistic: str
    window: Window


@dataclass(frozen=True)
class Formula:
    """The declaration of a derived metric: a pure function of other metrics and parameters.

    `inputs` are their names; ``function`` takes an array of shape (n,) for each, NaN where it is not known, and gives
    the metric. Of the parameters in `either` one is enough, and those in `optional` need not be given. A formula that
    `selects` gives one of its inputs, such as the largest.
    """

    name: str
    unit: str
    long_name: str
    sense: Sense | None
    inputs: tuple[str, ...]
    function: Callable[..., npt.ArrayLike]
    either: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()
    selects: bool = False


@dataclass(frozen=True)
class DerivedMetric:
    """A derived metric, its inputs resolved."""

    name: str
    unit: str
    long_name: str
    sense: Sense | None
    formula: Formula
    inputs: tuple[Metric | SampledMetric | DerivedMetric | Parameter, ...]

    @property
    def parts(self) -> tuple[Metric | SampledMetric | Parameter, ...]:
        """What it is made of in the end, each once."""
        found: list[Metric | SampledMetric | Parameter] = []
        for each in self.inputs:
            found += each.parts if isinstance(each, DerivedMetric) else (each,)
        return tuple(dict.fromkeys(found))

    @property
    def sampled(self) -> tuple[SampledMetric, ...]:
        """The sampled metrics that it is made of."""
        return tuple(part for part in self.parts if isinstance(part, SampledMetric))


AnyMetric = Metric | SampledMetric | DerivedMetric
