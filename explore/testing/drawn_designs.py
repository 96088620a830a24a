"""Random designs around those of a study."""

from __future__ import annotations

import numpy as np

from explore.model.columns import Arrays
from explore.model.quantities import FloatArray, Parameter
from explore.studies.config.study import Study
from explore.studies.designs.spaces import BLOCK_SIZE

#: Factor by which the range of drawn values exceeds the study's at each end.
_WIDENING = 3.0


def draw_designs(study: Study, count: int, seed: int) -> Arrays:
    """Draw designs around those of a study, (count,) by parameter.

    A parameter with choices takes any of them. One that the study gives is drawn from a third of the study's smallest
    value to three times its largest, uniformly in the logarithm, as far as the declaration allows. All others are at
    their defaults.
    """
    random = np.random.default_rng(seed)
    space = study.space
    # the last design has the last value also of the axis that varies slowest
    parts = space.designs(0, min(space.n_designs, BLOCK_SIZE)), space.designs(space.n_designs - 1, space.n_designs)
    given = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return {
        parameter.name: _draw(parameter, given.get(parameter.name), count, random)
        for parameter in study.request.mechanism.parameters
        if parameter.choices or parameter.name in given
    }


def _draw(parameter: Parameter, given: FloatArray | None, count: int, random: np.random.Generator) -> FloatArray:
    """Draw values of one parameter, shape (count,)."""
    if parameter.choices or given is None:
        return random.choice(parameter.choices, count)
    low, high = float(given.min()), float(given.max())
    if low > 0.0:
        values = np.exp(random.uniform(np.log(low / _WIDENING), np.log(high * _WIDENING), count))
    else:
        values = random.uniform(low, high, count)
    return np.where(parameter.allows(values), values, random.choice(given, count))
