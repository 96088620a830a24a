"""Parallel coordinates and ratio curves: each line is a design of the results."""

import numpy as np
import pytest

import explore
from explore.charts.parallel import parallel_chart, spread
from explore.charts.ratio import ratio_chart
from explore.charts.style import save
from explore.errors import RequestError

GRID = """mechanism = "crank-rocker"
[parameters]
crank = { start = 40, stop = 200, num = 17 }
coupler = 1083.4236
rocker = [541.7118, 600]
ground = [691.7118, 760, 800]
[evaluate]
metrics = ["cv", "mean_output_ratio", "transmission_angle_min"]
[constraints]
transmission_angle_min = { min = 20 }
mean_output_ratio = { max = 0.12 }
[rank]
metrics = ["cv", "transmission_angle_min:max"]
"""


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    """Results of a study by its text."""

    def swept(text):
        folder = tmp_path_factory.mktemp("lines")
        (folder / "study.toml").write_text(text)
        return explore.sweep(explore.load_study(folder / "study.toml"), folder / "study.h5")

    return swept


@pytest.fixture(scope="module")
def grid(sweep):
    return sweep(GRID)


def lines_of(chart, label):
    (part,) = [part for part in chart.collections if part.get_label() == label]
    return np.array([path.vertices[:, 1] for path in part.get_paths()])


def test_each_line_is_a_design(grid):
    names = ["crank", "rocker", "ground", "cv", "transmission_angle_min"]
    chart = parallel_chart(grid).axes[0]
    front, table = explore.rank(grid), grid.to_pandas()
    others = table[table["feasible"] & ~table.index.isin(front.index)][names].to_numpy()
    drawn = {label: lines_of(chart, label) for label in ("Pareto set", "others")}
    assert len(drawn["Pareto set"]) == len(front) > 2
    assert len(drawn["others"]) == len(others) > 2
    assert f"{len(front)} Pareto-optimal; {len(others)} of {len(others)} other" in chart.figure.get_suptitle()
    # The axes are linear: heights and values correlate fully, design by design.
    ordered = front.sort_values("cv", ascending=False, kind="stable")[names].to_numpy()
    heights, values = np.vstack([drawn["Pareto set"], drawn["others"]]), np.vstack([ordered, others])
    for height, value in zip(heights.T, values.T, strict=True):
        assert np.corrcoef(height, value)[0, 1] == pytest.approx(1.0, abs=1e-12)
    assert drawn["Pareto set"].min() >= 0.0
    assert drawn["Pareto set"].max() <= 1.0
    texts = " ".join(text.get_text() for text in chart.texts)
    assert "[mm]" in texts
    assert "▼ better" in texts
    assert "▲ better" in texts


def test_a_sample_is_even_and_holds_both_ends():
    assert spread(10, 20).tolist() == list(range(10))
    assert spread(1, 5).tolist() == [0]
    many = spread(1_000_000, 300)
    assert (len(many), many[0], many[-1]) == (300, 0, 999_999)
    assert set(np.diff(many)) <= {3344, 3345}


def test_many_designs_are_sampled_and_said(sweep):
    text = GRID.replace("{ start = 40, stop = 200, num = 17 }", "{ min = 40, max = 200 }")
    text = text.replace("[691.7118, 760, 800]", "{ min = 600, max = 800 }")
    results = sweep(text + '[sampling]\nmethod = "sobol"\ncount = 20000\nseed = 1\n')
    table, front = results.to_pandas(["feasible"]), explore.rank(results)
    figure = parallel_chart(results)
    assert f"300 of {table['feasible'].sum() - len(front):,} other feasible designs" in figure.get_suptitle()
    assert len(lines_of(figure.axes[0], "others")) == 300


def test_one_design_is_one_line(sweep, tmp_path):
    one = GRID.replace("{ start = 40, stop = 200, num = 17 }", "80").replace("[541.7118, 600]", "600")
    one = one.replace("[691.7118, 760, 800]", "760")
    figure = parallel_chart(sweep(one))
    assert "1 Pareto-optimal; no other feasible design" in figure.get_suptitle()
    save(figure, tmp_path / "one.png")
    with pytest.raises(RequestError, match="no design of .* is feasible"):
        parallel_chart(sweep(one.replace("crank = 80", "crank = 400")))
    with pytest.raises(RequestError, match="one objective and no parameter that varies"):
        parallel_chart(sweep(one.replace('["cv", "transmission_angle_min:max"]', '["cv"]')))


def test_curves_over_the_crank_are_those_of_the_designs(grid):
    number = int(explore.rank(grid).index[0])
    own, table = grid.design(number), grid.to_pandas()
    slice_ = table[(table["rocker"] == own["rocker"]) & (table["ground"] == own["ground"])].sort_values("crank")
    figure = ratio_chart(grid)
    for chart, name in zip(figure.axes, ("mean_output_ratio", "cv"), strict=True):
        curve = chart.get_lines()[0]
        assert np.array_equal(curve.get_xdata(), slice_["crank"])
        assert np.array_equal(curve.get_ydata(), slice_[name], equal_nan=True)
        (star,) = [line for line in chart.get_lines() if line.get_marker() == "*"]
        assert np.ravel(star.get_data()).tolist() == [own["crank"], own[name]]
        shaded = sum(patch.get_width() for patch in chart.patches)
        assert shaded == pytest.approx(10.0 * slice_["cv"].isna().sum(), rel=1e-12)
        assert chart.get_ylabel().endswith("[1]")
    (bound,) = [line for line in figure.axes[0].get_lines() if line.get_linestyle() == "-."]
    assert set(bound.get_ydata()) == {0.12}
    labels = " ".join(text.get_text() for text in figure.legends[0].get_texts())
    assert "no value: misses" in labels
    assert "infeasible: misses" in labels


def test_a_ratio_needs_a_swept_crank(grid, sweep):
    with pytest.raises(RequestError, match="differs from design 0 in the crank only; sweep the crank"):
        ratio_chart(sweep(GRID.replace("{ start = 40, stop = 200, num = 17 }", "80")), 0)
    text = GRID.replace('"cv", "mean_output_ratio", "tr', '"mean_output_ratio", "tr')
    without = sweep(text.replace('["cv", "transmission_angle_min:max"]', '["transmission_angle_min:max"]'))
    with pytest.raises(RequestError, match="no metric 'cv'; "):
        ratio_chart(without, 0)
