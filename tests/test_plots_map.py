"""Maps: every cell compared with a loop over its designs."""

import numpy as np
import pytest
from studies import sweep_text, swept

import explore
from explore.base.errors import RequestError
from explore.figures.charts.cells import cell_axes, cell_rectangles
from explore.figures.charts.map import map_chart
from explore.figures.charts.pareto import pareto_chart
from explore.figures.charts.reasons import reason_columns, reason_masks

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
grid = swept(GRID, "grid")


def mesh_of(chart, dimensions=2):
    """Values in the cells; with 3 dimensions the colours of the shades."""
    arrays = [part.get_array() for part in chart.collections]
    (mesh,) = [array for array in arrays if array is not None and array.ndim == dimensions]
    return mesh


def test_a_cell_is_darker_the_nearer_its_designs_are_to_feasible(grid):
    shades = mesh_of(map_chart(grid, x="crank", y="ground").axes[0], dimensions=3)[..., 3]
    table = grid.to_pandas()
    table["violation"] = explore.nearest(grid, len(table))["violation"].reindex(table.index)
    for i, crank in enumerate(sorted(set(table["crank"]))):
        for j, ground in enumerate(sorted(set(table["ground"]))):
            cell = table[(table["crank"] == crank) & (table["ground"] == ground)]
            known = not cell["feasible"].any() and cell["violation"].notna().any()
            expected = 0.3 / (1.0 + cell["violation"].min() / 0.2) if known else 0.0
            assert shades[j, i] == pytest.approx(expected, rel=1e-14)
    assert len(set(shades.ravel().tolist())) > 3


def test_feasible_designs_without_a_value_are_told(tmp_path):
    """Rods that are never compressed have an infinite buckling factor: these designs are feasible."""
    rig = """mechanism = "test-rig"
    [parameters]
    crank = 5
    coupler = 460
    rocker = [590, 600]
    ground = 751
    constant_torque = [-25e3, 25e3]
    allowed_stress = 100
    [evaluate]
    metrics = ["buckling_factor", "rod_diameter"]
    [rank]
    metrics = ["buckling_factor:max", "rod_diameter"]
    """
    results = sweep_text(tmp_path, rig, "rig")
    assert "4 feasible (2 without buckling_factor) of 4 designs" in map_chart(results).get_suptitle().replace("\n", " ")
    assert "2 Pareto-optimal of 4 feasible of 4 designs" in pareto_chart(results).get_suptitle().replace("\n", " ")
    tension = sweep_text(tmp_path, rig.replace(", 25e3]", ", -20e3]"), "tension")
    texts = [text.get_text() for text in map_chart(tension).axes[0].texts]
    assert texts == ["no feasible design has a value"]


@pytest.mark.parametrize(("metric", "aggregate"), [("cv", "min"), ("swing_angle", "max"), ("time_ratio", "mean")])
def test_a_cell_is_the_best_of_its_feasible_designs(grid, metric, aggregate):
    table = grid.to_pandas()
    chart, bar = map_chart(grid, x="crank", y="ground", metric=metric).axes
    mesh = mesh_of(chart)
    assert mesh.shape == (7, 9)
    for i, crank in enumerate(sorted(set(table["crank"]))):
        for j, ground in enumerate(sorted(set(table["ground"]))):
            within = table[(table["crank"] == crank) & (table["ground"] == ground) & table["feasible"]]
            assert bool(mesh.mask[j, i]) == (len(within) == 0)
            if len(within):
                assert mesh[j, i] == pytest.approx(within[metric].agg(aggregate), rel=1e-15)
    assert 0 < mesh.mask.sum() < mesh.size
    assert bar.get_ylabel().endswith("[deg]" if metric == "swing_angle" else "[1]")


def test_the_hatch_of_a_cell_is_its_most_common_cause(grid):
    table = grid.to_pandas()
    status = {column.name: column.labels for column in grid.columns}["status"]
    figure = map_chart(grid, x="crank", y="ground")
    chart = figure.axes[0]
    names = [patch.get_label() for patch in figure.legends[0].get_patches()]
    hatches = [part for part in chart.collections if part.get_array() is None]
    assert len(names) == len(hatches) >= 2
    n_cells = 0
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
                n_cells += 1
    assert n_cells == mesh_of(chart).mask.sum()


def test_a_design_fixes_the_other_parameters(grid):
    number = int(explore.rank(grid).index[0])
    rocker = grid.design(number)["rocker"]
    chart, _ = map_chart(grid, x="crank", y="ground", design=number).axes
    table = grid.to_pandas()
    slice_ = table[(table["rocker"] == rocker) & table["feasible"]]
    assert mesh_of(chart).count() == len(slice_)
    assert np.allclose(sorted(mesh_of(chart).compressed()), sorted(slice_["cv"]), rtol=1e-15)
    assert f"rocker {rocker:.6g} mm" in chart.figure.get_suptitle()


def test_sampled_values_have_cells_of_equal_width():
    values = np.random.default_rng(1).uniform(5.0, 9.0, (2, 5000))
    axes = cell_axes(*values)
    for axis, own in zip(axes, values, strict=True):
        assert np.all((axis.edges[axis.cell] <= own) & (own <= axis.edges[axis.cell + 1]))
        assert np.ptp(np.diff(axis.edges)) < 1e-12
        assert axis.count == 28  # six designs in each cell


def test_cells_grow_until_most_hold_designs():
    values = np.random.default_rng(1).uniform(0.0, 1.0, (2, 20_000)) ** 8  # most are near 0
    x, y = cell_axes(*values)
    held = len(set(zip(x.cell.tolist(), y.cell.tolist(), strict=True)))
    assert x.count == y.count < 57  # what six designs in each cell of an even spread would need
    assert held > x.count * y.count / 2


def test_cells_stay_small_where_designs_are_on_a_line():
    values = np.linspace(0.0, 1.0, 20_000)
    x, y = cell_axes(values, values)
    assert x.count == y.count == 12


def test_each_grid_value_has_its_own_cell():
    for axis in cell_axes(np.tile([1.0, 2.0, 4.0], 5), np.tile([1.0, 2.0, 4.0], 5)):
        assert axis.edges.tolist() == [0.5, 1.5, 3.0, 5.0]
        assert axis.cell[:3].tolist() == [0, 1, 2]


def test_rectangles_cover_their_mask():
    mask = np.random.default_rng(2).random((6, 8)) < 0.5
    x, y = cell_axes(np.tile(np.arange(8.0), 6), np.tile(np.arange(6.0), 8))
    corners = cell_rectangles(x, y, mask)
    sizes = np.ptp(corners, axis=1)
    assert np.prod(sizes, axis=1).sum() == mask.sum()


def test_a_map_needs_two_parameters(tmp_path):
    (tmp_path / "one.toml").write_text(GRID.replace("[480, 541.7118, 600]", "500").replace(
        "{ start = 620, stop = 830, num = 7 }", "700"))  # fmt: skip
    results = explore.sweep(explore.load_study(tmp_path / "one.toml"), tmp_path / "one.h5")
    with pytest.raises(RequestError, match="a map needs two parameters that vary; .*one.h5 has crank"):
        map_chart(results)


def test_a_cut_needs_designs_with_the_same_other_parameters(tmp_path):
    text = GRID.replace("[480, 541.7118, 600]", "{ min = 480, max = 600 }")
    text = text.replace("{ start = 620, stop = 830, num = 7 }", "{ min = 620, max = 830 }")
    text = text.replace("{ start = 60, stop = 180, num = 9 }", "{ min = 60, max = 180 }")
    results = sweep_text(tmp_path, text + '[sampling]\nmethod = "sobol"\ncount = 500\nseed = 1\n', "drawn")
    with pytest.raises(RequestError, match="too few designs .* share ground .* mm; leave out `design`"):
        map_chart(results, design=5)
    assert mesh_of(map_chart(results).axes[0]).count() > 10


def test_designs_without_a_solved_length_and_bare_numbers_are_told(tmp_path):
    """Where no crank gives the swing the design has no place; phases have no unit."""
    parameters = 'crank = { solve = "swing_angle", value = "40 deg" }\nground = [700, 2000]\nphases = [1, 3]'
    text = f'mechanism = "crank-rocker"\n[parameters]\n{parameters}\ncoupler = [1000, 1100]\nrocker = 500\n'
    results = sweep_text(tmp_path, text, "solved")
    without = int(results.to_pandas()["crank"].isna().sum())
    assert 0 < without < 8
    assert f" of 8 designs ({without} without a place)" in map_chart(results, x="crank", y="coupler").get_suptitle()
    cut = map_chart(results, x="crank", y="coupler", design=0)
    assert "phases 1" in cut.get_suptitle()
    assert "phases 1 1" not in cut.get_suptitle()


def test_axis_labels_name_their_parameters(grid):
    chart, _ = map_chart(grid, x="crank", y="ground").axes
    assert chart.get_xlabel() == "crank length [mm]"
    assert chart.get_ylabel() == "distance of the ground pivots [mm]"


def test_a_margin_of_exactly_zero_is_no_reason(grid):
    frame = grid.to_pandas(reason_columns(grid)).iloc[:3]
    frame["status"], frame["swing_angle_margin"] = 1, [0.0, -1e-300, 1.0]
    assert reason_masks(grid, frame)["misses swing_angle"].tolist() == [False, True, False]
