"""A control curve in the units that were chosen to show it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from explore.analysis.tuning.control_curve import Tuning
from explore.analysis.tuning.intervals import End, Interval
from explore.base.units.shown import PLAIN, Scale, headings


def show_tuning(tuning: Tuning, scales: Mapping[str, Scale]) -> Tuning:
    """The result with all values in shown units; the names in `design` have those that are not the declared ones."""
    place, amount = scales.get(tuning.parameter, PLAIN), scales.get(tuning.metric, PLAIN)

    def show_end(end: End) -> End:
        return replace(end, parameter=place.show(end.parameter), value=amount.show(end.value))

    names = [str(name) for name in tuning.curve if name in scales]
    curve = tuning.curve.assign(**{name: scales[name].show_all(tuning.curve[name].to_numpy()) for name in names})
    curve.attrs["units"] = {**tuning.curve.attrs["units"], **{name: scales[name].shown for name in names}}
    named = headings(scales, tuning.design)
    least, most = tuning.reach
    low, high = tuning.bounds
    return replace(
        tuning,
        curve=curve,
        intervals=tuple(Interval(show_end(interval.start), show_end(interval.stop)) for interval in tuning.intervals),
        reach=(show_end(least), show_end(most)),
        bounds=(amount.show(low), amount.show(high)),
        design={named.get(name, name): scales.get(name, PLAIN).show(value) for name, value in tuning.design.items()},
        own=place.show(tuning.own),
    )
