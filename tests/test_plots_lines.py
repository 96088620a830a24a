"""Parallel coordinates and ratio curves: each line is a design of the results."""

import numpy as np
import pytest
from studies import sweep_text

import explore
from explore.base.errors import RequestError
from explore.figures.charts.parallel import opacity, parallel_chart, spread, tick_texts
from explore.figures.charts.ratio import ratio_chart
from explore.figures.charts.style import save_figure

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
    """A function that sweeps the study of a text."""
    return lambda text: sweep_text(tmp_path_factory.mktemp("lines"), text)


@pytest.fixture(scope="module")
def grid(sweep):
    return sweep(GRID)


def line_heights(chart, label):
    (part,) = [part for part in chart.collections if part.get_label() == label]
    return np.array([path.vertices[:, 1] for path in part.get_paths()])


def test_each_line_is_a_design(grid):
    names = ["crank", "rocker", "ground", "cv", "transmission_angle_min"]
    chart = parallel_chart(grid).axes[0]
    front, table = explore.rank(grid), grid.to_pandas()
    others = table[table["feasible"] & ~table.index.isin(front.index)][names].to_numpy()
    drawn = {label: line_heights(chart, label) for label in ("Pareto set", "others")}
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


def part_of(chart, label):
    (part,) = [part for part in chart.collections if part.get_label() == label]
    return part


def test_opacity_falls_with_the_number_of_lines():
    opacities = [opacity(count, 150.0) for count in (35, 300, 825)]
    assert opacities == sorted(opacities, reverse=True)
    assert opacities[-1] > 0.1
    # The picture is 830 pixels high: two of 825 lines cover a pixel, and more than half of the background shows.
    assert (1.0 - opacities[-1]) ** 2 > 0.5


def test_a_column_colours_the_lines(grid):
    """The best design is drawn last, over the others; the scale beside the chart is opaque."""
    front = explore.rank(grid)
    for metric, name, unit in ((None, "cv", "1"), ("crank", "crank", "mm"), ("mean_output_ratio",) * 2 + ("1",)):
        figure = parallel_chart(grid, metric=metric)
        assert part_of(figure.axes[0], "Pareto set").get_array().tolist() == front[name].tolist()[::-1]
        assert figure.axes[1].get_ylabel() == f"{name} of the Pareto set [{unit}]"
        assert all(part.get_alpha() in (None, 1.0) for part in figure.axes[1].collections)
    with pytest.raises(RequestError, match="no column of numbers 'rockr'; did you mean 'rocker'"):
        parallel_chart(grid, metric="rockr")


def test_infeasible_designs_are_paler_than_feasible_ones(grid):
    (chart, _) = ratio_chart(grid).axes
    (crosses,) = [line for line in chart.get_lines() if line.get_marker() == "x"]
    (dots,) = [line for line in chart.get_lines() if line.get_label() == "feasible"]
    assert crosses.get_alpha() < 0.5
    assert dots.get_alpha() is None
    assert crosses.get_markersize() < dots.get_markersize()


def test_a_sample_is_evenly_spaced_and_contains_both_ends():
    assert spread(10, 20).tolist() == list(range(10))
    assert spread(1, 5).tolist() == [0]
    rows = spread(1_000_000, 300)
    assert (len(rows), rows[0], rows[-1]) == (300, 0, 999_999)
    assert set(np.diff(rows)) <= {3344, 3345}


@pytest.mark.parametrize(
    ("ticks", "texts"),
    [
        ([100.0002, 100.0004, 100.0006], ["100.0002", "100.0004", "100.0006"]),
        ([-0.5, 0.0, 0.5], ["-0.5", "0", "0.5"]),
        ([1234567.0, 1234568.0], ["1234567", "1234568"]),
        ([0.0], ["0"]),
        ([], []),
    ],
)
def test_ticks_have_the_digits_that_tell_them_apart(ticks, texts):
    assert tick_texts(ticks) == texts


def test_the_heading_says_how_many_designs_are_sampled(sweep):
    text = GRID.replace("{ start = 40, stop = 200, num = 17 }", "{ min = 40, max = 200 }")
    text = text.replace("[691.7118, 760, 800]", "{ min = 600, max = 800 }")
    results = sweep(text + '[sampling]\nmethod = "sobol"\ncount = 20000\nseed = 1\n')
    table, front = results.to_pandas(["feasible"]), explore.rank(results)
    figure = parallel_chart(results)
    assert f"300 of {table['feasible'].sum() - len(front):,} other feasible designs" in figure.get_suptitle()
    assert len(line_heights(figure.axes[0], "others")) == 300


def test_one_design_is_one_line(sweep, tmp_path):
    single = GRID.replace("{ start = 40, stop = 200, num = 17 }", "80").replace("[541.7118, 600]", "600")
    single = single.replace("[691.7118, 760, 800]", "760")
    figure = parallel_chart(sweep(single))
    assert "1 Pareto-optimal; no other feasible design" in figure.get_suptitle()
    save_figure(figure, tmp_path / "one.png")
    with pytest.raises(RequestError, match="no design of .* is feasible"):
        parallel_chart(sweep(single.replace("crank = 80", "crank = 400")))
    with pytest.raises(RequestError, match="one objective and no parameter that varies"):
        parallel_chart(sweep(single.replace('["cv", "transmission_angle_min:max"]', '["cv"]')))


def test_ratio_curves_agree_with_the_designs(grid):
    number = int(explore.rank(grid).index[0])
    design, table = grid.design(number), grid.to_pandas()
    slice_ = table[(table["rocker"] == design["rocker"]) & (table["ground"] == design["ground"])].sort_values("crank")
    figure = ratio_chart(grid)
    for chart, name in zip(figure.axes, ("mean_output_ratio", "cv"), strict=True):
        curve = chart.get_lines()[0]
        assert np.array_equal(curve.get_xdata(), slice_["crank"])
        assert np.array_equal(curve.get_ydata(), slice_[name], equal_nan=True)
        (star,) = [line for line in chart.get_lines() if line.get_marker() == "*"]
        assert np.ravel(star.get_data()).tolist() == [design["crank"], design[name]]
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
        ratio_chart(sweep(GRID.replace("{ start = 40, stop = 200, num = 17 }", "80")), design=0)
    text = GRID.replace('"cv", "mean_output_ratio", "tr', '"mean_output_ratio", "tr')
    results = sweep(text.replace('["cv", "transmission_angle_min:max"]', '["transmission_angle_min:max"]'))
    with pytest.raises(RequestError, match="no metric 'cv'; "):
        ratio_chart(results, design=0)


def test_a_ratio_of_another_mechanism_says_what_there_is_instead(sweep):
    text = 'mechanism = "gears"\n[parameters]\ncentre_distance = 140\ngrowth = [1.2, 1.3]\n'
    with pytest.raises(RequestError) as caught:
        ratio_chart(sweep(text + '[evaluate]\nmetrics = ["cv"]\n'), design=0)
    assert str(caught.value).endswith(
        "study.h5 is of gears, which has no crank and no mean_output_ratio: a ratio chart is of crank-rockers; "
        "a map or a pareto chart shows any results"
    )


def test_arrows_point_to_the_better_end_of_each_objective(grid):
    chart = parallel_chart(grid).axes[0]
    arrows = {}
    for text in chart.texts:
        name, _, rest = text.get_text().replace("\n", "").partition("[")
        arrows[name] = "".join(letter for letter in rest if letter in "▲▼")
    assert {name: arrow for name, arrow in arrows.items() if arrow} == {"cv": "▼", "transmission_angle_min": "▲"}
