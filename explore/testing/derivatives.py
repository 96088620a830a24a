"""Signals that are declared as derivatives of others, integrated and compared with the changes of those."""

from collections.abc import Iterator

import numpy as np

from explore.model.quantities import FloatArray, Signal
from explore.testing.dense_statistics import Panels, sample
from explore.testing.subject import Subject

#: Largest difference between an integral and a change, relative to both; wrong derivatives differ by more.
_TOLERANCE = 1e-9


def wrong_derivatives(subject: Subject) -> Iterator[str]:
    """A sentence for each signal whose integral over some panel of the turn is not the change of its antiderivative."""
    by_name = {signal.name: row for row, signal in enumerate(subject.signals)}
    pairs = [(row, by_name[s.derivative_of]) for row, s in enumerate(subject.signals) if s.derivative_of in by_name]
    wrong: dict[int, str] = {}
    for design in np.flatnonzero(subject.is_computed) if pairs else ():

        def motion(input_angle: FloatArray, design: int = int(design)) -> FloatArray:
            return subject.motion(design, input_angle)

        panels = sample(motion, 0.0, 360.0)
        ends = motion(panels.edges)
        for rate, source in pairs:
            difference, size = _difference(subject, panels, ends, int(design), rate, source)
            if difference > _TOLERANCE * size and rate not in wrong:
                wrong[rate] = (
                    f"{subject.signals[rate].name} is not the derivative of {subject.signals[source].name}: integrals "
                    f"differ by {difference / size:.1e} of its size, for {subject.describe(int(design))}"
                )
    yield from wrong.values()


def _difference(
    subject: Subject, panels: Panels, ends: FloatArray, design: int, rate: int, source: int
) -> tuple[float, float]:
    """Largest difference between integrals of one signal and changes of another on the panels, and the size of both."""
    signal, antiderivative = subject.signals[rate], subject.signals[source]
    speed = subject.speed(design)
    integrals = 2.0 * np.pi * (panels.values[rate] * panels.weights).sum(axis=1) / _factor(signal, speed)
    changes = np.diff(ends[source])
    if antiderivative.unit == "deg":
        changes = (changes + 180.0) % 360.0 - 180.0
    changes /= _factor(antiderivative, speed)
    size = np.abs(integrals).sum() + np.abs(ends[source]).max() / _factor(antiderivative, speed)
    return float(np.abs(integrals - changes).max()), float(size)


def _factor(signal: Signal, speed: float) -> float:
    """Factor from the signal for unit speed and rad to its values."""
    return float(speed**signal.speed_power * (np.rad2deg(1.0) if signal.unit == "deg" else 1.0))
