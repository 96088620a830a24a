"""The contract of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy.typing as npt

from explore.mechanisms.registry import MECHANISMS
from explore.model.columns import Arrays
from explore.model.mechanism import Mechanism
from explore.studies.config.study_file import load_study, starter
from explore.studies.request.parameters import parameter_columns
from explore.testing.commands import failing_commands
from explore.testing.derivatives import wrong_derivatives
from explore.testing.drawing import broken_links
from explore.testing.drawn_designs import draw_designs
from explore.testing.extremes import wrong_extremes
from explore.testing.invariance import changes_with_the_block, changes_with_units
from explore.testing.statistics import wrong_statistics, wrong_zero_means
from explore.testing.statuses import wrong_statuses
from explore.testing.subject import Subject

_CHECKS = (
    wrong_statuses,
    wrong_derivatives,
    wrong_statistics,
    wrong_zero_means,
    changes_with_units,
    changes_with_the_block,
    broken_links,
)


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
