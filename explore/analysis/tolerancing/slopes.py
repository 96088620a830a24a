"""First derivatives of metrics by parameters from ball arithmetic, exact to the rounding of a double.

A central difference with a step h of 2^-48 of the parameter, in balls of 128 bits and more, of which cancellation takes
48. Its error is of the order of (h/R)^2 where R is the distance to the nearest singularity of the metric. Half of the
difference of both one-sided slopes, their bend, is of the order of h/R of the slope, so that its square shows the
error. Where the bend is as large as the slope, the metric has a fold at the design and no derivative.
"""

from collections.abc import Mapping
from functools import partial

import numpy as np
from flint import fmpq

from explore.analysis.certifying.balls import UnprovedError, exact, with_more_bits
from explore.analysis.certifying.designs import Design
from explore.analysis.certifying.targets import is_searched
from explore.analysis.tolerancing.derivatives import Derivatives, parameter_scale
from explore.analysis.tolerancing.outcomes import TolerancedRequest
from explore.model.quantities import AnyMetric

#: Step over the magnitude of the parameter.
_STEP = fmpq(1, 1 << 48)
#: Rounding of a double, relative.
_ROUNDING = 2.0**-53
#: Largest radius and bend of a slope over its usual size: a sixteenth of the rounding of a double.
_NARROW = 2.0**-57
#: Bend over slope from which on the metric has a fold.
_FOLD = 2.0**-20


def sharpen(derivatives: Derivatives, request: TolerancedRequest, nominal: Mapping[str, float]) -> Derivatives:
    """The derivatives, exact where the metric can be enclosed; the mechanism has a table."""
    free = request.exact.request
    defaults = {p.name: float("nan" if p.default is None else p.default) for p in free.mechanism.parameters}
    complete = defaults | dict(nominal)
    centre = Design(complete, free)
    stencils = []
    for tolerance in request.tolerances:
        name = tolerance.parameter
        step = exact(parameter_scale(free.mechanism, nominal, name)) * _STEP
        before, after = (Design({**complete, name: exact(complete[name]) + move}, free) for move in (-step, step))
        stencils.append((step, [before, centre, after]))
    slopes, errors = dict(derivatives.slopes), dict(derivatives.errors)
    for metric in free.metrics:
        if metric.name not in slopes or is_searched(metric):
            continue
        try:
            pairs = np.array([_slope(metric, step, designs) for step, designs in stencils])
        except UnprovedError:
            continue
        # Where a step of 2^-48 stays within a tie, such as of both strokes, only the differences see the fold.
        pairs[np.isnan(slopes[metric.name])] = np.nan
        slopes[metric.name], errors[metric.name] = pairs.T
    return Derivatives(slopes, errors)


def _slope(metric: AnyMetric, step: fmpq, designs: list[Design]) -> tuple[float, float]:
    """The derivative of a metric and its error, from a design between two others; NaN where there is none."""
    return with_more_bits(partial(_difference, metric, step, designs), f"the slope of {metric.name}")


def _difference(metric: AnyMetric, step: fmpq, designs: list[Design], bits: int) -> tuple[float, float] | None:
    enclosures = [design.enclosure(metric, bits) for design in designs]
    if any(enclosure is None for enclosure in enclosures):
        return np.nan, np.nan
    before, centre, after = (enclosure.ball for enclosure in enclosures if enclosure is not None)
    slope, bend = (after - before) / (2 * step), abs(after - 2 * centre + before) / (2 * step)
    natural = abs(slope).max(abs(centre) * _STEP / step)
    if natural.is_zero():
        return 0.0, 0.0
    if not slope.rad() + bend.rad() < natural.abs_lower() * _NARROW:
        return None
    if bend > natural * _FOLD:
        return np.nan, np.nan
    truncation = 4 * bend * bend / natural
    return float(slope), float((slope.rad() + truncation).abs_upper()) + _ROUNDING * abs(float(slope))
