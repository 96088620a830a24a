"""How near the designs of a report are to feasible, where little is feasible."""

from __future__ import annotations

import math
from typing import Any

from explore.results.labels import unit_text
from explore.results.ranking.nearest import find_nearest, is_little
from explore.results.store.results import Results

#: Largest number of designs that a page lists.
_MOST_DESIGNS = 10
#: Largest number of combinations of constraints that a page lists.
_MOST_COMBINATIONS = 5
#: Numbers of designs to let in by relaxing a constraint.
_LET_IN = (1, 10, 100)


def describe_nearest(results: Results, n_feasible: int | None) -> dict[str, Any] | None:
    """The designs nearest to feasible and what excludes the others, as JSON; None where enough is feasible.

    Results of the front alone have no infeasible designs.
    """
    if n_feasible is None or results.keep != "all" or not results.constraints:
        return None
    if not is_little(n_feasible, results.n_committed):
        return None
    nearness = find_nearest(results, _MOST_DESIGNS)
    exclusions = nearness.exclusions
    units = {metric: unit_text(results.units.get(f"{metric}_margin", "")) for metric in nearness.scales}
    designs = []
    for design, row in zip(nearness.frame.index, nearness.frame.to_dict(orient="records"), strict=True):
        margins = {metric: float(row[f"{metric}_margin"]) for metric in nearness.scales}
        missed = [[metric, -margin, units[metric]] for metric, margin in margins.items() if margin < 0.0]
        unknown = [metric for metric, margin in margins.items() if math.isnan(margin)]
        designs.append([int(design), float(row["violation"]), missed, unknown])
    widths = {metric: [[n, exclusions.relaxation(metric, n)] for n in _LET_IN] for metric in nearness.scales}
    return {
        "designs": designs,
        "alone": {metric: exclusions.alone(metric) for metric in nearness.scales},
        "lets_in": {metric: [pair for pair in pairs if pair[1] is not None] for metric, pairs in widths.items()},
        "together": [[list(metrics), count] for metrics, count in exclusions.together()[:_MOST_COMBINATIONS]],
    }
