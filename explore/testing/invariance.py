"""Results that must not change: with the units of length, time and mass, the block of a design, or the anchor."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.base.units.quantities import dimension
from explore.evaluation.positions import Position
from explore.model.columns import Arrays
from explore.model.quadrature import Graded, Located
from explore.model.quantities import AnyMetric, DerivedMetric, FloatArray, Metric, SampledMetric
from explore.model.status import Status
from explore.testing.subject import COMPUTED, Subject, name_of


@dataclass(frozen=True)
class _Units:
    """Other units: the numbers by which lengths, times and masses grow, and whether products with them are exact."""

    description: str
    factors: tuple[float, float, float]
    is_exact: bool = True

    def factor(self, unit: str) -> float:
        """The number by which quantities of a unit grow."""
        return float(np.prod(np.power(self.factors, dimension(unit))))


#: Changes of units: powers of 2 commute with all roundings but of powers, 1000 rounds every length anew.
_UNITS = (
    _Units("a unit of length that is 1024 times smaller", (2.0**10, 1.0, 1.0)),
    _Units("a unit of time that is 8 times greater", (1.0, 2.0**-3, 1.0)),
    _Units("a unit of mass that is 32 times smaller", (1.0, 1.0, 2.0**5)),
    _Units("a unit of length that is 1000 times smaller", (1000.0, 1.0, 1.0), is_exact=False),
)
#: Largest relative change of metrics by exact factors.
_EXACT = 2e-15
#: Largest relative change by exact factors of metrics with powers, of which there may be many.
_POWERS = 1e-12
#: Largest relative change by other factors.
_ROUNDED = 1e-9
#: Largest relative change of a bound by rounding.
_ROUNDING = 1e-13
#: Largest factor on a bound that is a difference of rounded values.
_GREATER = 10.0
#: Factor on the speed of half of the designs.
_FASTER = 1.7
#: Numbers of designs of a block.
_BLOCK_SIZES = (1, 7)
#: Number of blocks that are evaluated.
_BLOCK_COUNT = 6


def changes_with_units(subject: Subject) -> Iterator[str]:
    """A sentence for each column that does not change as its unit says when units of length, time or mass change."""
    wrong: dict[str, str] = {}
    declared = {parameter.name: parameter.unit for parameter in subject.mechanism.parameters}
    designs = subject.complete_designs
    for window, drive in subject.windows():
        metrics = subject.all_metrics(window)
        names = [metric.name for metric in metrics]
        before = subject.evaluate(names, window, drive, designs=designs)
        for units in _UNITS:
            scaled = {name: column * units.factor(declared[name]) for name, column in designs.items()}
            after = subject.evaluate(names, window, drive, designs=scaled)
            for name, design, value, expected in _changes(metrics, before, after, units):
                sentence = (
                    f"{name} over {name_of(window)} is {value!r} and not {expected!r} "
                    f"in {units.description}, for {subject.describe(design)}"
                )
                wrong.setdefault(name, sentence)
    yield from wrong.values()


def _changes(
    metrics: tuple[AnyMetric, ...], before: Arrays, after: Arrays, units: _Units
) -> Iterator[tuple[str, int, float, float]]:
    """Name, design, value and expected value of the first design of each column that changes otherwise."""
    expected: Arrays = {metric.name: before[metric.name] * units.factor(metric.unit) for metric in metrics}
    allowed = {metric.name: _allowed(metric, expected, units.is_exact) for metric in metrics}
    after = after | {"status": _outcome(after)}
    expected |= {"status": _outcome(before)}
    allowed["status"] = np.zeros(len(before["status"]))
    if units.is_exact:
        # the bound of a value that is nothing but rounding may be anything
        expected["error"] = before["error"]
        allowed["error"] = np.where(before["status"] == Status.OK, _ROUNDING + _GREATER * before["error"], np.inf)
    for name, column in expected.items():
        value = after[name]
        with np.errstate(invalid="ignore"):  # infinite minus infinite
            agrees = np.abs(value - column) <= allowed[name]
        agrees |= (value == column) | (np.isnan(value) & np.isnan(column))
        if not agrees.all():
            design = int(np.flatnonzero(~agrees)[0])
            yield name, design, value[design].item(), column[design].item()


def _outcome(columns: Arrays) -> npt.NDArray[np.int64]:
    """The status of each design; near the tolerance rounding decides which of those of computed designs it is."""
    status = columns["status"].astype(np.int64)
    return np.where(np.isin(status, COMPUTED), Status.OK, status)


def _allowed(metric: AnyMetric, expected: Arrays, is_exact: bool) -> FloatArray:
    """Largest change of a metric that is rounding, shape (n,)."""
    size = np.abs(expected[metric.name])
    if is_exact:
        has_powers = metric.statistic == "power_mean" if isinstance(metric, SampledMetric) else False
        return np.asarray((_POWERS if has_powers or isinstance(metric, DerivedMetric) else _EXACT) * size)
    if isinstance(metric, SampledMetric):
        if metric.statistic == "cv":  # its mean may be next to nothing
            return np.full(size.shape, np.inf)
        start = f"{metric.signal.name}_"
        rms = expected[f"{start}rms{metric.name.removeprefix(start + metric.statistic)}"]
        return np.asarray(_ROUNDED * np.maximum(size, rms**2 if metric.statistic == "variance" else rms))
    return np.asarray(_ROUNDED * (np.nanmax(size, initial=0.0) if isinstance(metric, Metric) else size))


def changes_with_the_block(subject: Subject) -> Iterator[str]:
    """A sentence for each column with a value that depends on the block of its design or the place in the block."""
    wrong: dict[str, str] = {}
    # each design twice, at two speeds if there are any, because equal motions share an evaluation
    designs = {name: np.repeat(column, 2) for name, column in subject.complete_designs.items()}
    if subject.mechanism.speed:
        designs[subject.mechanism.speed.name][::2] *= _FASTER
    count = 2 * len(subject)
    for window, drive in subject.windows():
        names = [metric.name for metric in subject.all_metrics(window)]
        whole = subject.evaluate(names, window, drive, designs=designs)
        for arrangement, parts in _arrangements(count):
            results = [
                subject.evaluate(names, window, drive, designs={name: column[part] for name, column in designs.items()})
                for part in parts
            ]
            order = np.concatenate(parts)
            for name, column in whole.items():
                other = np.concatenate([result[name] for result in results])
                if other.tobytes() != column[order].tobytes():
                    wrong.setdefault(name, f"{name} over {name_of(window)} changes with {arrangement}")
    yield from wrong.values()


def _arrangements(count: int) -> Iterator[tuple[str, list[npt.NDArray[np.intp]]]]:
    """Ways to evaluate designs: what they are called, and the numbers of the designs of each block."""
    yield "the order of the designs", [np.arange(count)[::-1]]
    for size in _BLOCK_SIZES:
        first = np.arange(min(count, size * _BLOCK_COUNT))
        yield f"blocks of {size}", np.split(first, range(size, len(first), size))


#: Half-tangents of angles from nearly half a turn before an anchor to as far behind it.
_TANGENTS = np.concatenate([side * 10.0 ** np.array([-9.0, -3.0, -0.5, 0.5, 3.0, 6.0, 9.0]) for side in (-1.0, 1.0)])
#: Largest difference relative to the signal's largest magnitude; beside change points rounding is amplified.
_TOLERANCE = 1e-7


def changes_with_the_anchor(subject: Subject) -> Iterator[str]:
    """A sentence for each signal that is another one at the same angle about the other anchor.

    Extremes of a whole turn are looked for about one anchor up to its opposite, where half-tangents grow without limit.
    Signals in pieces have panels of their own there.
    """
    mechanism = subject.mechanism.extended or subject.mechanism
    computed = np.flatnonzero(subject.is_computed)
    if mechanism.limits or not isinstance(mechanism.quadrature, Graded | Located) or not len(computed):
        return
    signals = [signal for signal in mechanism.signals if mechanism.fills(signal)]
    parameters = np.stack([subject.complete_designs[p.name][computed] for p in mechanism.kernel_parameters])
    constants = mechanism.constants(parameters)

    def sample(anchor: int, tangent: float) -> FloatArray:
        position = Position(anchor, np.full(len(computed), tangent))
        return np.array([position.sample(mechanism, constants, signal) for signal in signals])

    about_one = np.array([[sample(anchor, tangent) for tangent in _TANGENTS] for anchor in (0, 1)])
    about_other = np.array([[sample(1 - anchor, -1.0 / tangent) for tangent in _TANGENTS] for anchor in (0, 1)])
    differences = np.abs(about_one - about_other)
    sizes = np.fmax.reduce(np.minimum(np.abs(about_one), np.abs(about_other)), axis=(0, 1))
    for row, signal in enumerate(signals):
        wrong = differences[:, :, row] > _TOLERANCE * sizes[row]
        wrong |= np.isnan(about_one[:, :, row]) != np.isnan(about_other[:, :, row])
        if wrong.any():
            anchor, place, design = np.argwhere(wrong)[0]
            yield (
                f"{signal.name} at the half-tangent {_TANGENTS[place]:g} from anchor {anchor} is "
                f"{about_one[anchor, place, row, design]:.9g}, and about the other anchor "
                f"{about_other[anchor, place, row, design]:.9g}, for {subject.describe(int(computed[design]))}"
            )
