"""Quantities of a mechanism, as frozen data: parameters, signals, and metrics of all kinds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from explore.model.columns import Column
from explore.model.expressions import Expression
from explore.model.window import Window

FloatArray = npt.NDArray[np.float64]
Sense = Literal["min", "max"]

STATISTICS = ("mean", "variance", "std", "cv", "min", "max", "peak", "rms", "peak_to_peak")
#: Statistics that follow from mean and variance.
MOMENT_STATISTICS = ("mean", "variance", "std", "cv", "rms")
#: Statistics that follow from the smallest and the largest value; "peak" is the largest magnitude.
EXTREME_STATISTICS = ("min", "max", "peak", "peak_to_peak")
#: Statistics of the mechanism's output whose metrics have no name of a signal.
OUTPUT_STATISTICS = ("mean", "variance", "cv")
#: Statistic over a turn: range of the integral over the input angle, in rad, of the signal less its mean.
FLUCTUATION = "fluctuation"
#: Statistics of a torque that a motor follows: range of the integral of the motor's less it, and the motor's largest.
LAGGED_STATISTICS = ("lagged_fluctuation", "lagged_max")
#: Statistics over a whole turn.
TURN_STATISTICS = (FLUCTUATION, *LAGGED_STATISTICS)
#: Statistics of a magnitude. "power_mean" is (mean |x|^(10/3))^(3/10), by which roller bearings are sized.
MAGNITUDE_STATISTICS = ("mean", "max", "rms", "power_mean")

#: The `zero_meaning` of a parameter without which the metrics that need it are not computed.
OMITTED = "not given"


@dataclass(frozen=True)
class Quantity:
    """What a quantity says of itself: its name, that of its column or the first part of it, unit and description.

    That of a metric also has the sense in which it is better, None where neither is.
    """

    name: str
    unit: str
    long_name: str


@dataclass(frozen=True)
class Parameter(Quantity):
    """An input of a mechanism: one column of every sweep that names it.

    Attributes
    ----------
    default
        Value where a study gives none; None makes the parameter mandatory.
    lower, upper
        Values must be ``> lower`` and ``<= upper``, and finite.
    choices
        The only values allowed; empty where every number in the range is.
    only_in
        Names of the windows whose metrics depend on the parameter; empty means all.
    scales_speed
        Marks the input speed: velocities are proportional to it and accelerations to its square, so that designs
        that differ only in it share one kinematic evaluation.
    zero_meaning
        Meaning of the value 0, such as "none", where 0 is allowed in addition to the range; empty where it is not. With
        `OMITTED`, metrics that need the parameter are not computed at 0.
    affects
        What depends on the parameter: the motion and everything that follows from it, only the signals under load,
        only those of a point of the floating link, only how well it meets a target, or only derived metrics, as for
        allowed stresses.
    is_dynamic
        Whether the parameter, unless 0, makes the signals under load depend on the speed.
    adds_corners
        Whether the parameter, unless 0, gives all signals under load corners, as friction does where the force that
        causes it changes its sign; see `Signal.has_corners`.
    corners_at
        Names of the signals at whose levels these corners are; see `Signal.corners_at`.
    adds_jumps
        Whether the parameter, unless 0, makes signals under load jump at the breaks of the mechanism, as a force
        against the motion does at the ends of strokes.
    """

    default: float | None = None
    lower: float = 0.0
    upper: float = np.inf
    choices: tuple[float, ...] = ()
    only_in: tuple[str, ...] = ()
    scales_speed: bool = False
    zero_meaning: str = ""
    affects: Literal["motion", "load", "point", "target", "sizing"] = "motion"
    is_dynamic: bool = False
    adds_corners: bool = False
    corners_at: tuple[str, ...] = ()
    adds_jumps: bool = False

    def allows(self, values: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether each number is a value that the parameter can take, in the shape of `values`."""
        numbers = np.asarray(values, dtype=np.float64)
        allowed = (numbers > self.lower) & (numbers <= self.upper) & np.isfinite(numbers)
        if self.zero_meaning:
            allowed |= numbers == 0.0
        return allowed & np.isin(numbers, self.choices) if self.choices else allowed


@dataclass(frozen=True)
class Signal(Quantity):
    """A function of the input angle: one row of the kernel's signal array, times the speed to a power.

    Attributes
    ----------
    row
        Row of the signal array that `Mechanism.fill` writes.
    needs
        Bits that `Mechanism.fill` must be called with to write the row.
    speed_power
        The signal is the row times the speed to this power.
    pole_order
        Power of the node count in the quadrature's error model: 2 for angles and velocities, 4 for accelerations, 6 for
        inertia forces.
    is_rectified
        Whether the sign is chosen so that the mean is positive.
    needs_stroke
        Whether the signal has statistics only where the output rocks: an angle that grows from turn to turn has no
        mean.
    only_in
        Names of the windows in which the signal exists; empty means all.
    depends_on_load
        Whether it depends on the parameters that affect the load, and through them on the speed.
    required_loads
        Names of load parameters of which at least one must not be 0.
    is_magnitude
        Whether the row holds the square of the signal, which is smooth where the signal touches 0.
    terms_row
        Row with the size of the terms that the signal is the sum of, which bounds its rounding; -1 for none.
    shares_row_with
        Name of the signal whose row this one uses, scaled or windowed differently; empty for a row of its own.
    is_residual
        Whether the signal is small beside the terms in `terms_row` and has their singularities.
    has_corners
        Whether the signal has corners at angles that the mechanism does not know, as a power without its negative
        part: its statistics take the adaptive quadrature.
    corners_at
        Names of the signals at whose levels the corners are, as the power itself. The places are found, and the
        quadrature does not go across them. Empty for corners that are seen only if they are as wide as the distance of
        samples.
    corner_levels
        Values of its row at which signals have corners that name this one in `corners_at`.
    has_own_singularities
        Whether it has complex singularities that the mechanism does not know, as a curvature above the places where the
        point is slow: the quadrature is that of a mechanism that declares none.
    relative_to
        Name of the length parameter that the signal is comparable with in size and grows with, by which its rounding
        is bounded; empty for an angle, a number, and where it is that of the signal that this one is the derivative of.
    derivative_of
        Name of the signal whose derivative by the input angle this one is, times the speed to the difference of their
        speed powers, angles in rad; empty for none. That signal has no jumps, and is the same after a turn unless it
        has `needs_stroke` and the output does not rock.
    extremes_at
        Marks, or "anchor" and "opposite" (half a turn from it), between which the signal is monotonic; empty where
        nothing is known of its extremes.
    point
        Name of the point of the floating link that it is a signal of; empty for the signals of all designs.
    has_fluctuation
        Whether it has the statistic `FLUCTUATION`, as a torque, of which this is the energy that a flywheel stores.
    lag_row
        Row of the rate per radian at which a motor follows this torque; -1 for none, without `LAGGED_STATISTICS`.
    starts_anew
        Whether it grows over a turn of the input and begins again at input angle 0: an interval across that has none of
        its statistics.
    """

    row: int
    needs: int
    speed_power: int = 0
    pole_order: int = 2
    is_rectified: bool = False
    needs_stroke: bool = False
    only_in: tuple[str, ...] = ()
    depends_on_load: bool = False
    required_loads: tuple[str, ...] = ()
    is_magnitude: bool = False
    terms_row: int = -1
    shares_row_with: str = ""
    is_residual: bool = False
    has_corners: bool = False
    corners_at: tuple[str, ...] = ()
    corner_levels: tuple[float, ...] = (0.0,)
    has_own_singularities: bool = False
    relative_to: str = ""
    derivative_of: str = ""
    extremes_at: tuple[str, ...] = ()
    point: str = ""
    has_fluctuation: bool = False
    lag_row: int = -1
    starts_anew: bool = False

    @property
    def statistics(self) -> tuple[str, ...]:
        """The statistics that the signal has."""
        if self.is_magnitude:
            return MAGNITUDE_STATISTICS
        lagged = LAGGED_STATISTICS if self.lag_row >= 0 else ()
        return (*STATISTICS, FLUCTUATION, *lagged) if self.has_fluctuation else STATISTICS


@dataclass(frozen=True)
class Metric(Quantity):
    """A closed-form metric, a function of the geometry alone.

    Attributes
    ----------
    labels
        Words for the values of an integer code; empty for numbers.
    lower, upper
        Bounds of all possible values, so that a study cannot solve for a value outside.
    worst_of
        Name of the signal, an angle, of which this is the smallest value of it and of 180 deg less it; empty for none.
    closed_form_of
        Name of the statistic that this is without samples, with its window, such as "position_peak_to_peak_cycle";
        empty for none. `check_mechanism` compares it with the signal.
    needs_stroke
        Whether the metric exists only where the output rocks.
    is_partial
        Whether designs whose status is 'ok' may lack it, as a place of something that they need not have.
    lengths
        Formula for solving for a length: of its name, the others by name, (n,), and a value of the metric. It returns
        lengths, (k, n), of which some have that value if any do; inf for none, NaN where it cannot tell.
    """

    sense: Sense | None = None
    labels: tuple[str, ...] = ()
    lower: float = -np.inf
    upper: float = np.inf
    worst_of: str = ""
    closed_form_of: str = ""
    needs_stroke: bool = False
    is_partial: bool = False
    lengths: Callable[[str, Mapping[str, FloatArray], float], FloatArray] | None = None


@dataclass(frozen=True)
class SampledMetric(Quantity):
    """A statistic of a signal over a window, the statistic by its name."""

    sense: Sense | None
    # the name tells metrics apart; the hashes of all fields of a signal would take a third of a small evaluation
    signal: Signal = field(hash=False)
    statistic: str
    window: Window = field(hash=False)


@dataclass(frozen=True)
class Formula(Quantity):
    """The declaration of a derived metric: a pure function of other metrics and parameters.

    Attributes
    ----------
    inputs
        Names of the metrics and parameters it is a function of.
    function
        Takes one array of shape (n,) for each input, NaN where a design has none, and returns the metric; or the
        expression that a user writes.
    alternatives
        Parameters, among the inputs or theirs, of which each design must give at least one.
    optional
        Parameters among the inputs that a design may leave at 0, and metrics that it may lack for want of strokes.
    selects_one
        Whether the value is one of the inputs, such as the largest.
    is_folded
        Whether it is the smallest of angles and of 180 deg less them, whose extremes are the inputs.
    is_proportional
        Whether it is in proportion to its first input, so that its error is relative to what that of the input is.
    rounding
        Bound of the absolute error by roundings in the function, from the inputs; by default 1e-15 of the value.
    scale
        What the error is relative to, from the inputs; by default the value.
    needs_turn
        Whether the function samples the motion itself, over the full turn.
    """

    sense: Sense | None
    inputs: tuple[str, ...]
    function: Callable[..., npt.ArrayLike] | Expression
    alternatives: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()
    selects_one: bool = False
    is_folded: bool = False
    is_proportional: bool = False
    rounding: Callable[..., FloatArray] | None = None
    scale: Callable[..., FloatArray] | None = None
    needs_turn: bool = False


@dataclass(frozen=True)
class DerivedMetric(Quantity):
    """A derived metric of a request: its formula, and the metrics and parameters that this names."""

    sense: Sense | None
    formula: Formula = field(hash=False)
    inputs: tuple[ComputedMetric | Parameter, ...] = field(hash=False)

    @property
    def parts(self) -> tuple[Metric | SampledMetric | Parameter, ...]:
        """The parameters and the closed-form and sampled metrics it depends on, directly or not, each once."""
        parts: list[Metric | SampledMetric | Parameter] = []
        for each in self.inputs:
            parts += each.parts if isinstance(each, DerivedMetric) else (each,)
        return tuple(dict.fromkeys(parts))

    @property
    def sampled(self) -> tuple[SampledMetric, ...]:
        """The sampled metrics it depends on."""
        return tuple(part for part in self.parts if isinstance(part, SampledMetric))

    @property
    def needs_turn(self) -> bool:
        """Whether its formula, or one that it depends on, samples the full turn."""
        derived = [each for each in self.inputs if isinstance(each, DerivedMetric)]
        return self.formula.needs_turn or any(each.needs_turn for each in derived)


@dataclass(frozen=True)
class GivenMetric:
    """A metric that comes with the designs: who found them measured it, and evaluation takes its values as they are.

    Attributes
    ----------
    column
        Its column of results, whose role says whether it can be ranked. Codes with labels are from the best on.
    sense
        Sense in which it is better; None where neither is.
    """

    column: Column
    sense: Sense | None = None

    @property
    def name(self) -> str:
        """Column name."""
        return self.column.name

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return self.column.unit

    @property
    def long_name(self) -> str:
        """Its description."""
        return self.column.long_name


ComputedMetric = Metric | SampledMetric | DerivedMetric
AnyMetric = ComputedMetric | GivenMetric
