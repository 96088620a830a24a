"""Task "slider-path": the rows' own errors are those of the search, and mistakes are refused."""

import numpy as np
import pytest
from studies import synthesize_text
from synthesis_cases import pressure_angle_max

from explore.base.errors import ConfigError
from explore.synthesis.slider_cranks import SliderCrank
from explore.synthesis.tasks.task_files import parse_task, task_starter


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    folder = tmp_path_factory.mktemp("slider")
    return synthesize_text(folder, task_starter("slider-path")).to_pandas()


def test_the_direct_linkage_is_the_best_row(rows):
    """Ten times the published path: the mechanism's own metric finds the error that the search minimised."""
    assert rows["path_error_rms"].min() == pytest.approx(0.0194206, abs=1e-7)
    assert rows.iloc[0]["path_error_rms"] == rows["path_error_rms"].min()
    assert rows["feasible"].all()
    assert (rows["pressure_angle_max"] <= 50 + 1e-6).all()


def test_the_guide_offset_method_is_a_surrogate(rows):
    """At the same pivot its linkage is 13 times farther off, near that of the published design, 0.274."""
    (surrogate,) = rows.loc[rows["method"] == 2].itertuples()
    assert surrogate.crank_pivot_x == rows.iloc[0]["crank_pivot_x"]
    assert 0.1 < surrogate.path_error_rms < 0.3


def test_a_row_draws_the_path(rows):
    row = rows.iloc[0]
    linkage = SliderCrank(
        complex(row["crank_pivot_x"], row["crank_pivot_y"]), row["crank"], row["rod"], row["offset"],
        np.radians(row["ground_angle"]), complex(row["M_along"], row["M_across"]) / row["rod"],
    )  # fmt: skip
    curve = linkage.points(np.linspace(0, 2 * np.pi, 20_000))
    assert np.abs(curve - (78.8 + 62.2j)).min() < 0.03
    assert np.abs(curve - (53.8 + 49.6j)).min() < 0.03
    assert np.degrees(pressure_angle_max(linkage)) == pytest.approx(row["pressure_angle_max"], rel=1e-12)


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ("points = [[0, 0], [1, 1], [2, 0]]", "target.points: a path for a slider-crank has from 5 to 2000 points"),
        ("points = [[0, 0], [1, 1], [2, 0], [3, 1], [3, 1]]", "points 4 and 5 are equal"),
        ("points = [[0, 0], [1, 1], [2, 0], [3, 1], [4, 4]]\n[bounds]\npressure_angle_max = 95", "below 89"),
        ("points = [[0, 0], [1, 1], [2, 0], [3, 1], [4, 4]]\n[bounds]\ncrank_pivot = 3", "crank_pivot: must be"),
    ],
)
def test_paths_that_are_refused(entries, message):
    with pytest.raises(ConfigError, match=message):
        parse_task(f'task = "slider-path"\n[target]\n{entries}\n', "task.toml")
