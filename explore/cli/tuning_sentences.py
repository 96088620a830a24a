"""Sentences about a control curve: where its metric is within bounds, and which of them it does not reach."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from explore.cli.output import number, shown_unit

if TYPE_CHECKING:
    from explore.analysis.tuning.control_curve import Tuning
    from explore.analysis.tuning.intervals import End


def describe_tuning(tuning: Tuning, sentences: Mapping[str, str]) -> list[str]:
    """Where the metric is within its bounds, which of them it does not reach, and which values are inexact."""
    lines = []
    for interval in tuning.intervals:
        places = [_place(tuning, end, sentences) for end in dict.fromkeys((interval.start, interval.stop))]
        lines.append(f"{tuning.metric} {wanted_values(tuning)}: {tuning.parameter} {' to '.join(places)}")
    least, most = tuning.reach
    bounds = [bound for bound in dict.fromkeys(tuning.bounds) if math.isfinite(bound)]
    for extreme, words, missed in (
        (most, "at most", [bound for bound in bounds if bound > most.value]),
        (least, "at least", [bound for bound in bounds if bound < least.value]),
    ):
        if missed:
            names = " and ".join(_amount(tuning, bound) for bound in missed)
            reason = f"{tuning.metric} is {words} {_amount(tuning, extreme.value)}, at {tuning.parameter}"
            verb = "is" if len(missed) == 1 else "are"
            lines.append(f"{names} {verb} not reached: {reason} {_place(tuning, extreme, sentences)}")
    if not lines:
        lines.append(f"no {tuning.parameter} gives {tuning.metric} {wanted_values(tuning)}: it jumps across")
    errors, tolerance = tuning.curve["error"], tuning.curve.attrs["tolerance"]
    if n_missed := int((errors > tolerance).sum()):
        values = f"{n_missed:,} of {len(errors):,} values of the curve"
        lines.append(f"{values} may miss the tolerance of {tolerance:g}; see the column error")
    return lines


def wanted_values(tuning: Tuning) -> str:
    """The bounds of the metric, in words."""
    low, high = tuning.bounds
    if low == high:
        return _amount(tuning, low)
    parts = [f"from {_amount(tuning, low)}"] if math.isfinite(low) else []
    parts += [f"to {_amount(tuning, high)}"] if math.isfinite(high) else []
    return " ".join(parts) or "exists"


def _amount(tuning: Tuning, value: float) -> str:
    return f"{number(value)} {shown_unit(tuning.curve.attrs['units'][tuning.metric])}".rstrip()


def _place(tuning: Tuning, end: End, sentences: Mapping[str, str]) -> str:
    """The parameter at an end, and why the curve ends there if it does."""
    from explore.analysis.tuning.curves import END_OF_RANGE
    from explore.analysis.tuning.intervals import JUMP

    place = f"{number(end.parameter, 13)} {shown_unit(tuning.curve.attrs['units'][tuning.parameter])}".rstrip()
    reasons = {"": "", END_OF_RANGE: "the end of the range looked at", JUMP: "where it jumps"}
    reason = reasons.get(end.cause, f"where the curve ends: {sentences.get(end.cause, end.cause)}")
    return f"{place} ({reason})" if reason else place
