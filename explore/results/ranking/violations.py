"""By how much designs miss their constraints, on a scale that does not depend on units.

The violation of a constraint is the distance of its metric from the allowed range, divided by the distance between the
quartiles of its margin among the designs that have a motion. That distance depends neither on units nor on how narrow a
constraint is, and a few extreme designs do not change it, as they do the largest margin and the standard deviation.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from explore.model.columns import Arrays
from explore.model.quantities import FloatArray
from explore.model.status import Status
from explore.results.ranking.limits import Limit

#: Statuses of designs whose constraints were checked.
CHECKED = (int(Status.OK), int(Status.SCREENED))
#: Approximate number of designs whose quartiles are taken where there are more.
_LARGEST_SAMPLE = 2**20
#: Largest distance of quartiles that is rounding, over the largest violation.
_LEAST_SPREAD = 1e-9


def find_margins(columns: Arrays, metrics: Sequence[str], limits: Sequence[Limit]) -> dict[str, FloatArray]:
    """Margin of each constrained metric, (n,): signed distance to the nearer bound, NaN where it is not known.

    The columns have ``METRIC_margin`` for each of `metrics`, which the sweep constrains. `limits` are narrower than its
    constraints, or on other metrics.
    """
    margins = {metric: np.asarray(columns[f"{metric}_margin"], dtype=np.float64) for metric in metrics}
    for limit in limits:
        own = limit.margin(columns)
        margins[limit.metric] = np.minimum(margins[limit.metric], own) if limit.metric in margins else own
    return margins


def is_measured(status: npt.NDArray[np.int8] | None, margins: Mapping[str, FloatArray]) -> npt.NDArray[np.bool_]:
    """Whether the distance of each design from feasible is known, at least in part, (n,).

    It is not where the design has no motion or misses the error bound, or where a constrained metric is undefined
    though it was computed.
    """
    undefined = np.logical_or.reduce([np.isnan(margin) for margin in margins.values()])
    if status is None:
        return np.asarray(~undefined)
    return np.asarray(np.isin(status, CHECKED) & ~((status == Status.OK) & undefined))


def find_scales(blocks: Iterable[Mapping[str, FloatArray]], n_designs: int) -> dict[str, float]:
    """The distance between the quartiles of each margin: a violation of this size counts as 1.

    Where it is 0, but for rounding, the scale is the largest violation; where there is none, 1. The blocks have the
    margins by metric of consecutive designs, those with a motion; of more than a million designs of all blocks, a
    random sample is used, the same each time.
    """
    share = _LARGEST_SAMPLE / max(n_designs, 1)
    generator = np.random.default_rng(0)
    samples: dict[str, list[FloatArray]] = {}
    worst: dict[str, float] = {}
    for margins in blocks:
        n = len(next(iter(margins.values())))
        chosen = slice(None) if share >= 1.0 else generator.random(n) < share
        for metric, margin in margins.items():
            known = margin[np.isfinite(margin)]
            worst[metric] = max(worst.get(metric, 0.0), float(-known.min(initial=0.0)))
            sample = margin[chosen]
            samples.setdefault(metric, []).append(sample[np.isfinite(sample)])
    spreads = {metric: _quartile_distance(np.concatenate(parts)) for metric, parts in samples.items()}
    return {
        metric: spread if spread > _LEAST_SPREAD * worst[metric] else worst[metric] or 1.0
        for metric, spread in spreads.items()
    }


def _quartile_distance(values: FloatArray) -> float:
    if len(values) == 0:
        return 0.0
    low, high = np.quantile(values, [0.25, 0.75])
    return float(high - low)


def total_violations(margins: Mapping[str, FloatArray], scales: Mapping[str, float]) -> FloatArray:
    """Sum of the violations of all constraints in units of their scales, (n,); what is not known counts as 0."""
    return np.asarray(sum(np.fmax(-margin, 0.0) / scales[metric] for metric, margin in margins.items()))
