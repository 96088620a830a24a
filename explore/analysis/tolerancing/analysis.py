"""All that is computed of one design with tolerances."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from explore.analysis.tolerancing.box import WorstCase, find_worst_case, searched_parts
from explore.analysis.tolerancing.derivatives import Derivatives, differentiate
from explore.analysis.tolerancing.failures import Failure, estimate_failure, most_parts
from explore.analysis.tolerancing.outcomes import BoolArray, TolerancedRequest
from explore.analysis.tolerancing.spreads import PartCounts
from explore.model.quantities import FloatArray


@dataclass(frozen=True)
class Analysis:
    """The tolerances of one design: parts drawn, probability of a failure, first order, worst case over the box."""

    parts: PartCounts
    failure: Failure
    derivatives: Derivatives
    worst_case: WorstCase

    def worst(self, metric: str, sense: str) -> float:
        """The worst value of a metric over the box."""
        return (self.worst_case.high if sense == "min" else self.worst_case.low)[metric].value


def most_analysed(request: TolerancedRequest, parts: PartCounts | None) -> int:
    """Largest number of parts that `analyse` evaluates, but for derivatives; None for parts that are not drawn yet."""
    return searched_parts(request) + most_parts(parts.count - parts.feasible if parts else 0)


def analyse(request: TolerancedRequest, nominal: Mapping[str, float], parts: PartCounts, seed: int) -> Analysis:
    """Analyse a design whose parts were drawn; the seed is that of the search of the box and of importance sampling."""
    random = np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(2,))))

    def fails(scores: FloatArray) -> BoolArray:
        return ~request.outcomes(nominal, request.deviations(scores)).is_feasible

    failure = estimate_failure(fails, len(request.tolerances), parts.count - parts.feasible, parts.count, random)
    return Analysis(parts, failure, differentiate(request, nominal), find_worst_case(request, nominal, seed))
