"""The published configurations from their study file to results, ranking and figures."""

from pathlib import Path

import numpy as np
import pytest

import explore
from explore import charts
from explore.results.store.open_results import open_results

CONFIG = Path(__file__).parent.parent / "configs" / "rig_published.toml"
#: Swing, deg, and largest pin force, N, of the specification, with 45 digits rounded to 12.
SWING = [20.0084547984949, 7.13046301519252, 7.13093248730, 2.61561999497497, 2.61616375630382, 0.962969720551156]
FORCE = [161440.628505253, 42237.0524618121, 126333.295952793, 42050.2784346507, 118177.214449755, 42022.6252770867]


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    path = tmp_path_factory.mktemp("rig") / "rig_published.h5"
    explore.sweep(explore.load_study(CONFIG), path, workers=1)
    return path


def test_the_published_configurations(swept):
    frame = explore.read_results(swept)
    assert (frame["status"] == 1).all()
    assert frame["swing_angle"].to_numpy() == pytest.approx(SWING, rel=1e-11)
    assert frame["pin_force_peak"].to_numpy() == pytest.approx(FORCE, rel=1e-11)
    # the shortest couplers are near centric, 105 deg away from the longest
    assert frame["mid_angle"].max() - frame["mid_angle"].min() == pytest.approx(104.924, abs=1e-3)
    assert list(explore.rank(swept).index) == [5]


@pytest.mark.parametrize("kind", ["motion", "mechanism", "pareto", "parallel"])
def test_figures(swept, kind):
    figure = getattr(charts, f"{kind}_chart")(open_results(swept))
    drawn = [line for axes in figure.axes for line in axes.lines]
    assert drawn or any(axes.collections for axes in figure.axes)
    if kind == "motion":
        motion = explore.simulate(
            "test-rig",
            {"crank": 5.0, "coupler": 460.0, "rocker": 595.0, "ground": 751.0, "constant_torque": 25e3},
            angles=[0.0],
        )
        curves = [line.get_ydata()[0] for line in drawn if len(line.get_ydata()) > 100]
        for name, factor in (("rocker_angle", 1.0), ("pin_force_d", 1e-3), ("drive_torque", 1.0)):
            assert np.isclose(curves, motion[name].iloc[0] * factor, rtol=1e-12).any()
        # the work of a constant torque over a turn is 0; the trapezoidal rule would give 1e-6 N m
        assert [line.get_label() for line in drawn if str(line.get_label()).startswith("mean")] == ["mean 0"] * 2
