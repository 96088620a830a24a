"""The contract of a mechanism: designs are drawn, and checks find broken promises."""

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import numpy.typing as npt

from explore.mechanisms.registry import MECHANISMS
from explore.model.columns import Arrays
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray, Parameter
from explore.studies.config.study import Study
from explore.studies.config.study_file import load_study, starter
from explore.studies.designs.spaces import BLOCK_SIZE
from explore.studies.request.parameters import parameter_columns
from explore.testing.commands import failing_commands
from explore.testing.derivatives import wrong_derivatives
from explore.testing.drawing import broken_links
from explore.testing.extremes import wrong_extremes
from explore.testing.invariance import changes_with_the_anchor, changes_with_the_block, changes_with_units
from explore.testing.statistics import wrong_statistics
from explore.testing.statuses import wrong_statuses
from explore.testing.subject import Subject

_CHECKS = (
    wrong_statuses,
    wrong_derivatives,
    wrong_statistics,
    changes_with_units,
    changes_with_the_block,
    changes_with_the_anchor,
    broken_links,
)
#: Factor by which the range of drawn values exceeds the study's at each end.
_WIDENING = 3.0


def check_mechanism(
    mechanism: Mechanism,
    *,
    study: str | None = None,
    designs: Mapping[str, npt.ArrayLike] | int = 24,
    seed: int = 0,
) -> None:
    """Check that a mechanism keeps every promise of its results, for use in the tests of a mechanism.

    Parameters
    ----------
    mechanism
        The mechanism. While it is checked it is registered under its name.
    study
        Text of a study file of the mechanism, small enough to sweep in a test; None for that of `explore init`. Its
        points are checked too.
    designs
        The designs to check, parameters by name in declared units; or the number of designs to draw. A parameter that
        the study gives is drawn uniformly in its logarithm, from a third of the study's smallest value to three times
        its largest, as far as its range allows. A parameter with choices takes any of them, others their defaults.
    seed
        Seed of the draw.

    Raises
    ------
    AssertionError
        With one line for each broken promise.

    Notes
    -----
    The promises:

    - each design has a status that fits its row, and values outside a declared range are refused by one;
    - a signal declared as `derivative_of` another integrates to its changes;
    - a metric declared as `closed_form_of` a statistic, or as `worst_of` a signal, is that by dense sampling;
    - a signal with `extremes_at` has its extremes at these marks; designs are drawn until each mark was one ten times;
    - mean, variance, standard deviation, rms, cv and extremes of each signal over each window are within the bound
      `error` of those by dense sampling, which uses the signals at plain input angles alone;
    - all columns change as their units say when lengths, times and masses are given in other units, also the speed;
    - no bit depends on the block of a design or its place in it;
    - signals at an input angle are the same about the anchor and about its opposite;
    - links of the drawing keep their lengths;
    - the study loads and sweeps, and every command works on its results.

    Signals that exist only in some windows, as behind clutches, and derived metrics are not sampled densely.
    """
    with MECHANISMS.including(mechanism), TemporaryDirectory() as folder:
        file = Path(folder) / "study.toml"
        file.write_text(starter(mechanism) if study is None else study, encoding="utf-8")
        loaded = load_study(file)
        with_points = mechanism.with_points(loaded.request.mechanism.points)

        def draw(number: int) -> Arrays:
            drawn = draw_designs(loaded, designs, seed + number) if isinstance(designs, int) else designs
            return parameter_columns(with_points, drawn)

        subject = Subject(with_points, draw(0))
        broken = [sentence for check in _CHECKS for sentence in check(subject)]
        broken += wrong_extremes(subject, draw if isinstance(designs, int) else None)
        broken += failing_commands(mechanism.name, file)
    if broken:
        raise AssertionError("\n".join(f"{mechanism.name}: {sentence}" for sentence in broken))


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
