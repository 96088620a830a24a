"""Least squares of the motions of sliders over dwells, many starts at once.

Limits are residuals too where they are missed; `explore.synthesis.dwell_polishing` then meets them exactly.
"""

from dataclasses import dataclass

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.columns import Columns
from explore.synthesis.dwell_motions import (
    ACROSS,
    ALONG,
    COUPLER,
    GROUND,
    LINK,
    N_NUMBERS,
    ROCKER,
    Motions,
    slider_motions,
)
from explore.synthesis.levenberg_marquardt import Kept, Rows, Stepped, gauss_newton, improve

#: Number of crank angles over the dwell.
_N_DWELL = 25
#: Number of crank angles over the turn.
_N_TURN = 48
#: Damping added to that of each number, as a share of the damping of the most influential one.
_FLOOR = 1e-3
#: Relative gain of a step that counts as little.
_LITTLE = 1e-9
#: Least length of the link to the slider, in cranks.
_LEAST_LINK = 0.05


@dataclass(frozen=True)
class DwellTask:
    """A dwell of a slider.

    The crank turns by the span, rad, while the slider rests. Limits over the turn are the least travel of the slider,
    the angles, rad, and the largest length of a link and of the coupler point's distance from the crank's pin. Lengths
    are in cranks.
    """

    span: float
    stroke: float = 1.0
    transmission_angle_min: float = float(np.radians(30.0))
    pressure_angle_max: float = float(np.radians(50.0))
    link_ratio_max: float = 6.0

    @property
    def lower(self) -> FloatArray:
        """Least values of the nine numbers."""
        found = np.full(N_NUMBERS, -np.inf)
        found[[COUPLER, ROCKER, GROUND]], found[LINK] = 1.0, _LEAST_LINK
        return found

    @property
    def upper(self) -> FloatArray:
        """Largest values of the nine numbers."""
        found = np.full(N_NUMBERS, np.inf)
        found[[COUPLER, ROCKER, GROUND, LINK]] = self.link_ratio_max
        return found


@dataclass(frozen=True)
class Fits(Columns):
    """Starts, or what became of them.

    Numbers, (n, 9), and sides, (n,), as of `slider_motions`; errors are mean squares of the slider's motion in the
    dwell and of missed limits.
    """

    numbers: FloatArray
    sides: FloatArray
    errors: FloatArray


def excesses_of_lengths(task: DwellTask, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
    """By how much cosines of transmission angles and the arm exceed their limits, (n, 3), and slopes (n, 9, 3)."""
    coupler, rocker, ground, along, across = numbers[:, :5].T
    largest = np.cos(task.transmission_angle_min)
    values, slopes = np.empty((len(numbers), 3)), np.zeros((len(numbers), N_NUMBERS, 3))
    for at, (side, sign) in enumerate(((ground - 1.0, 1.0), (ground + 1.0, -1.0))):
        # The cosine is largest with the crank along the ground, and least against it.
        product = 2.0 * coupler * rocker
        cosine = (coupler**2 + rocker**2 - side**2) / product
        values[:, at] = sign * cosine - largest
        slopes[:, COUPLER, at] = sign * (2.0 * coupler - 2.0 * rocker * cosine) / product
        slopes[:, ROCKER, at] = sign * (2.0 * rocker - 2.0 * coupler * cosine) / product
        slopes[:, GROUND, at] = -sign * 2.0 * side / product
    arm = np.maximum(np.hypot(along, across), 1e-12)
    values[:, 2] = arm - task.link_ratio_max
    slopes[:, ALONG, 2], slopes[:, ACROSS, 2] = along / arm, across / arm
    return values, slopes


def _excesses_of_turns(task: DwellTask, turns: Motions) -> tuple[FloatArray, FloatArray]:
    """By how much strokes fall short and sines of both signs exceed their limit, (n, 3), and slopes (n, 9, 3)."""
    every, largest = np.arange(len(turns.positions)), np.sin(task.pressure_angle_max)
    far, near = turns.positions.argmax(axis=1), turns.positions.argmin(axis=1)
    left, right = turns.sines.argmax(axis=1), turns.sines.argmin(axis=1)
    values = [
        task.stroke - turns.positions[every, far] + turns.positions[every, near],
        turns.sines[every, left] - largest,
        -turns.sines[every, right] - largest,
    ]
    slopes = [
        turns.position_slopes[every, :, near] - turns.position_slopes[every, :, far],
        turns.sine_slopes[every, :, left],
        -turns.sine_slopes[every, :, right],
    ]
    return np.stack(values, axis=1), np.stack(slopes, axis=2)


@dataclass(frozen=True)
class _Angles:
    """Crank angles from the begin of the dwell, over the dwell and over the turn, rad."""

    dwell: FloatArray
    turn: FloatArray


def _residuals(
    task: DwellTask, angles: _Angles, numbers: FloatArray, sides: FloatArray, weight: float
) -> tuple[FloatArray, FloatArray]:
    """Residuals, shape (n, r), and their slopes, shape (n, 9, r)."""
    n_dwell = len(angles.dwell)
    both = slider_motions(numbers, sides, np.concatenate([angles.dwell, angles.turn]))
    rest = both.positions[:, :n_dwell]
    rest = (rest - rest.mean(axis=1, keepdims=True)) / np.sqrt(n_dwell)
    turns = Motions(*(part[..., n_dwell:] for part in both))
    values, slopes = excesses_of_lengths(task, numbers)
    others, other_slopes = _excesses_of_turns(task, turns)
    excesses = np.concatenate([values, others], axis=1)
    residuals = np.concatenate([rest, weight * np.maximum(excesses, 0.0)], axis=1)
    by_rest = both.position_slopes[..., :n_dwell]
    by_rest = (by_rest - by_rest.mean(axis=2, keepdims=True)) / np.sqrt(n_dwell)
    by_excesses = np.concatenate([slopes, other_slopes], axis=2) * (weight * (excesses > 0.0))[:, None]
    return residuals, np.concatenate([by_rest, by_excesses], axis=2)


def fit(task: DwellTask, starts: Fits, n_steps: int, weight: float) -> Fits:
    """Starts after a number of steps within the bounds of their numbers."""
    angles = _Angles(np.linspace(0.0, task.span, _N_DWELL), np.linspace(0.0, 2.0 * np.pi, _N_TURN, endpoint=False))
    bounds = task.lower, task.upper

    def evaluate(numbers: FloatArray, rows: Rows) -> tuple[FloatArray, Kept]:
        residuals, slopes = _residuals(task, angles, numbers, starts.sides[rows], weight)
        return np.square(residuals).sum(axis=1), (residuals, slopes)

    def step(numbers: FloatArray, kept: Kept, _: Rows, damping: FloatArray) -> Stepped:
        return gauss_newton(numbers, kept[0], kept[1], damping, bounds, floor=_FLOOR, keeps_direction=True)

    numbers, errors = improve(np.clip(starts.numbers, *bounds), evaluate, step, n_steps, _LITTLE)
    return Fits(numbers, starts.sides, errors)
