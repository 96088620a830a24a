"""Signals with declared marks at which they have their extremes, against samples of whole turns."""

from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np

from explore.model.columns import Arrays
from explore.model.quantities import Signal
from explore.testing.subject import COMPUTED, Subject

#: Least number of designs in which each mark must be an extreme.
_OFTEN = 10
#: Largest number of draws to find these designs.
_MOST_DRAWS = 40
#: Samples of a turn, deg.
_ANGLES = np.arange(0.0, 360.0, 0.5)
#: Distance from an extreme, as a share of the signal's largest magnitude, within which a value is the extreme.
_ROUNDING = 1e-9

#: Function that draws as many designs as the subject has, by a number that is not 0.
Draw = Callable[[int], Arrays]


def wrong_extremes(subject: Subject, draw: Draw | None) -> Iterator[str]:
    """A sentence for each signal with an extreme at none of its marks, or with a mark that is hardly ever one.

    Without `draw` the designs are given, and marks may be extremes of none of them.
    """
    signals = [signal for signal in subject.signals if signal.extremes_at]
    yield from filter(None, (_problem(subject, signal, draw) for signal in signals))


def _problem(subject: Subject, signal: Signal, draw: Draw | None) -> str:
    """What is wrong with the marks of a signal; empty if nothing is."""
    counts, moving = Counter[str](), 0
    for drawn in _subjects(subject, draw):
        for design in _moving(drawn, signal):
            at_extremes = _marks_at_extremes(drawn, design, signal)
            if at_extremes is None:
                return (
                    f"{signal.name} has an extreme at none of its extremes_at, {', '.join(signal.extremes_at)}, "
                    f"for {drawn.describe(design)}"
                )
            counts.update(at_extremes)
            moving += 1
        if all(counts[mark] >= _OFTEN for mark in signal.extremes_at):
            return ""
    if draw is None:
        return ""
    mark = min(signal.extremes_at, key=counts.__getitem__)
    return (
        f"'{mark}' in extremes_at of {signal.name} is where an extreme is for {counts[mark]} of the {moving} designs "
        f"that were drawn; remove it, or give a study in which it is for at least {_OFTEN}"
    )


def _subjects(subject: Subject, draw: Draw | None) -> Iterator[Subject]:
    """The designs, then further ones as far as they can be drawn."""
    yield subject
    if draw:
        yield from (Subject(subject.mechanism, draw(number)) for number in range(1, _MOST_DRAWS))


def _moving(subject: Subject, signal: Signal) -> list[int]:
    """Numbers of the designs that have the signal over a turn."""
    turn = subject.mechanism.whole_motion.name
    result = subject.evaluate([f"{signal.name}_max_{turn}"], turn, subject.mechanism.default_drive)
    return [int(design) for design in np.flatnonzero(np.isin(result["status"], COMPUTED))]


def _marks_at_extremes(subject: Subject, design: int, signal: Signal) -> list[str] | None:
    """The marks at which the signal has its smallest or largest value; None if one of these is elsewhere."""
    marks = {name: angle for name, angle in subject.marks(design).items() if name in signal.extremes_at}
    row = subject.signals.index(signal)
    values = subject.motion(design, np.concatenate([list(marks.values()), _ANGLES]))[row]
    at_marks, tolerance = values[: len(marks)], _ROUNDING * np.abs(values).max()
    is_least, is_greatest = at_marks <= values.min() + tolerance, at_marks >= values.max() - tolerance
    if not (is_least.any() and is_greatest.any()):
        return None
    return [name for name, at_one in zip(marks, is_least | is_greatest, strict=True) if at_one]
