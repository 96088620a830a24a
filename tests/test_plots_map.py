"""Maps: every cell against a loop over the designs in it."""

import numpy as np
import pytest

import explore
from explore.charts.cells import axis_of, rectangles
from explore.charts.map import map_chart
from explore.errors import RequestError

GRID = """mechanism = "crank-rocker"
[parameters]
crank = { start = 60, stop = 180, num = 9 }
coupler = 1083.4236
rocker = [480, 541.7118, 600]
ground = { start = 620, stop = 830, num = 7 }
[evaluate]
metrics = ["cv", "swing_angle", "time_ratio", "transmission_angle_min"]
[constraints]
transmission_angle_min = { min = 20 }
swing_angle = { min = 15 }
[rank]
metrics = ["cv", "swing_angle:max"]
"""


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    folder = tmp_path_factory.mktemp("map")
    (folder / "grid.toml").write_text(GRID)
    return explore.sweep(explore.load_study(folder / "grid.toml"), folder / "grid.h5")


def mesh_of(chart):
    (mesh,) = [part for part in chart.collections if part.get_array() is not None]
    return mesh.get_array()


@pytest.mark.parametrize(("metric", "gathered"), [("cv", "min"), ("swing_angle", "max"), ("time_ratio", "mean")])
def test_a_cell_is_the_best_of_its_feasible_designs(grid, metric, gathered):
    table = grid.to_pandas()
    chart, bar = map_chart(grid, "crank", "ground", metric).axes
    shown = mesh_of(chart)
    assert shown.shape == (7, 9)
    for i, crank in enumerate(sorted(set(table["crank"]))):
        for j, ground in enumerate(sorted(set(table["ground"]))):
            within = table[(table["crank"] == crank) & (table["ground"] == ground) & table["feasible"]]
            assert bool(shown.mask[j, i]) == (len(within) == 0)
            if len(within):
                assert shown[j, i] == pytest.approx(within[metric].agg(gathered), rel=1e-15)
    assert 0 < shown.mask.sum() < shown.size
    assert bar.get_ylabel().endswith("[deg]" if metric == "swing_angle" else "[1]")


def test_hatches_say_the_most_common_reason(grid):
    table = grid.to_pandas()
    status = {column.name: column.labels for column in grid.columns}["status"]
    figure = map_chart(grid, "crank", "ground")
    chart = figure.axes[0]
    names = [patch.get_label() for patch in figure.legends[0].get_patches()]
    hatches = [part for part in chart.collections if part.get_array() is None]
    assert len(names) == len(hatches) >= 2
    checked = 0
    for name, part in zip(names, hatches, strict=True):
        for path in part.get_paths():
            low, high = path.vertices.min(axis=0), path.vertices.max(axis=0)
            within = table[table["crank"].between(low[0], high[0]) & table["ground"].between(low[1], high[1])]
            for _, cell in within.groupby("crank"):
                counts = {}
                for _, row in cell.iterrows():
                    if status[row["status"]] not in ("ok", "screened"):
                        label = status[row["status"]].replace("_", " ")
                        counts[label] = counts.get(label, 0) + 1
                    for metric in ("transmission_angle_min", "swing_angle"):
                        if row[f"{metric}_margin"] < 0.0 and status[row["status"]] in ("ok", "screened"):
                            counts[f"misses {metric}"] = counts.get(f"misses {metric}", 0) + 1
                assert not cell["feasible"].any()
                assert counts[name] == max(counts.values())
                checked += 1
    assert checked == mesh_of(chart).mask.sum()


def test_a_design_fixes_the_other_parameters(grid):
    number = int(explore.rank(grid).index[0])
    rocker = grid.design(number)["rocker"]
    chart, _ = map_chart(grid, "crank", "ground", design=number).axes
    table = grid.to_pandas()
    slice_ = table[(table["rocker"] == rocker) & table["feasible"]]
    assert mesh_of(chart).count() == len(slice_)
    assert np.allclose(sorted(mesh_of(chart).compressed()), sorted(slice_["cv"]), rtol=1e-15)
    assert f"rocker {rocker:.6g} mm" in chart.figure.get_suptitle()


def test_drawn_values_have_even_cells():
    values = np.random.default_rng(1).uniform(5.0, 9.0, 5000)
    axis = axis_of(values)
    assert np.all((axis.edges[axis.cell] <= values) & (values <= axis.edges[axis.cell + 1]))
    assert np.ptp(np.diff(axis.edges)) < 1e-12
    assert 2 <= axis.count < 90


def test_swept_values_lie_in_cells_of_their_own():
    axis = axis_of(np.tile([1.0, 2.0, 4.0], 5))
    assert axis.edges.tolist() == [0.5, 1.5, 3.0, 5.0]
    assert axis.cell[:3].tolist() == [0, 1, 2]


def test_rectangles_cover_their_mask():
    mask = np.random.default_rng(2).random((6, 8)) < 0.5
    x, y = axis_of(np.tile(np.arange(8.0), 2)), axis_of(np.tile(np.arange(6.0), 2))
    corners = rectangles(x, y, mask)
    sizes = np.ptp(corners, axis=1)
    assert np.prod(sizes, axis=1).sum() == mask.sum()


def test_a_map_needs_two_parameters(tmp_path):
    (tmp_path / "one.toml").write_text(GRID.replace("[480, 541.7118, 600]", "500").replace(
        "{ start = 620, stop = 830, num = 7 }", "700"))  # fmt: skip
    results = explore.sweep(explore.load_study(tmp_path / "one.toml"), tmp_path / "one.h5")
    with pytest.raises(RequestError, match="a map needs two parameters that vary; .*one.h5 has crank"):
        map_chart(results)


def test_drawn_designs_share_no_other_parameters(tmp_path):
    text = GRID.replace("[480, 541.7118, 600]", "{ min = 480, max = 600 }")
    text = text.replace("{ start = 620, stop = 830, num = 7 }", "{ min = 620, max = 830 }")
    text = text.replace("{ start = 60, stop = 180, num = 9 }", "{ min = 60, max = 180 }")
    (tmp_path / "drawn.toml").write_text(text + '[sampling]\nmethod = "sobol"\ncount = 500\nseed = 1\n')
    results = explore.sweep(explore.load_study(tmp_path / "drawn.toml"), tmp_path / "drawn.h5")
    with pytest.raises(RequestError, match="too few designs .* share ground .* mm; leave out --design"):
        map_chart(results, design=5)
    assert mesh_of(map_chart(results).axes[0]).count() > 10
