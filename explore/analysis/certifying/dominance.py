"""Whether a design of a Pareto set dominates another."""

import math
from collections.abc import Hashable, Iterator, Mapping, Sequence

import numpy as np
from flint import arb, ctx

from explore.analysis.certifying.balls import (
    PRECISIONS,
    UndecidedError,
    UnprovedError,
    bounds,
    with_more_bits,
)
from explore.analysis.certifying.designs import Design
from explore.analysis.certifying.rows import Proof
from explore.evaluation.kinematics import speed_power
from explore.model.quantities import FloatArray
from explore.model.request import Objective

#: Number of designs that are compared with all others at once.
_CHUNK = 256


def compare(proofs: Mapping[int, tuple[Proof, Design]], objectives: Sequence[Objective]) -> None:
    """Note the designs that others dominate, or perhaps dominate."""
    numbers = [number for number, (_, design) in proofs.items() if design.is_usable]
    dominated, perhaps = dict[int, int](), dict[int, int]()
    for first, second, is_certain in find_dominance([proofs[number][1] for number in numbers], objectives):
        (dominated if is_certain else perhaps).setdefault(numbers[first], numbers[second])
    for number, other in dominated.items():
        proofs[number][0].refuted.append(f"design {other} dominates it")
    for number, other in perhaps.items():
        proofs[number][0].open.append(f"whether design {other} dominates it")


def find_dominance(designs: Sequence[Design], objectives: Sequence[Objective]) -> Iterator[tuple[int, int, bool]]:
    """Pairs of designs of which the first may be dominated by the second, and whether it certainly is.

    All other pairs are proved: in some objective the first is strictly better than the second, or both are the same in
    all parameters that the objectives depend on.
    """
    intervals = np.array([[interval_of(design, objective) for objective in objectives] for design in designs])
    if not len(intervals):
        return
    keys = [_key(design, objectives) for design in designs]
    for first, second in _doubtful(intervals[..., 0], intervals[..., 1]):
        if keys[first] != keys[second]:
            try:
                is_dominated = _is_dominated(designs[first], designs[second], objectives)
            except UnprovedError:
                yield first, second, False
                continue
            if is_dominated:
                yield first, second, True


def interval_of(design: Design, objective: Objective) -> tuple[float, float]:
    """Doubles around an objective, the better the lower; infinite where it is not proved."""
    if objective not in design.intervals:
        design.intervals[objective] = _find_interval(design, objective)
    return design.intervals[objective]


def _find_interval(design: Design, objective: Objective) -> tuple[float, float]:
    for bits in PRECISIONS[:2]:
        with ctx.workprec(bits):
            try:
                ball = _ball(design, objective, bits)
            except UndecidedError:
                continue
            except UnprovedError:
                break
            return bounds(ball)
    return -math.inf, math.inf


def _ball(design: Design, objective: Objective, bits: int) -> arb:
    ball = design.column(objective.metric, bits)
    if ball is None:
        raise UnprovedError(f"{objective.metric} is undefined")
    return ball if objective.sense == "min" else -ball


def _doubtful(low: FloatArray, high: FloatArray) -> Iterator[tuple[int, int]]:
    """Pairs of rows of which the first is not certainly better than the second in any column."""
    for start in range(0, len(low), _CHUNK):
        better = np.zeros((len(low[start : start + _CHUNK]), len(low)), dtype=np.bool_)
        for column_low, column_high in zip(low.T, high.T, strict=True):
            better |= column_high[start : start + _CHUNK, None] < column_low
        for first, second in np.argwhere(~better).tolist():
            if first + start != second:
                yield first + start, second


def _key(design: Design, objectives: Sequence[Objective]) -> Hashable:
    """The parameters that the objectives may depend on."""
    metrics = {metric.name: metric for metric in design.request.all_metrics}
    names = {objective.metric.removesuffix("_margin") for objective in objectives}
    ignores_speed = all(name in metrics and speed_power(metrics[name]) == 0 for name in names)
    speed = design.request.mechanism.speed
    ignored = speed.name if ignores_speed and speed else ""
    return tuple(sorted((name, value) for name, value in design.parameters.items() if name != ignored))


def _is_dominated(first: Design, second: Design, objectives: Sequence[Objective]) -> bool:
    """Whether the second design is nowhere worse and somewhere better."""

    def find(bits: int) -> tuple[bool] | None:
        pairs = [(_ball(first, objective, bits), _ball(second, objective, bits)) for objective in objectives]
        if any(a < b for a, b in pairs):
            return (False,)
        if all(b <= a for a, b in pairs):
            return (True,) if any(b < a for a, b in pairs) else None
        return None

    return with_more_bits(find, "dominance")[0]
