"""Signals about either anchor: half-tangents from one and from its opposite are the same input angle."""

from collections.abc import Iterator

import numpy as np

from explore.evaluation.positions import Position
from explore.model.quadrature import Graded, Located
from explore.model.quantities import FloatArray
from explore.testing.subject import Subject

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
