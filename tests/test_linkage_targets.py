"""Targets of linkages of tables: paths of any point, poses of any link, functions of the output."""

import json
import pickle
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from command_line import run
from linkage_cases import CASES, FOUR_BAR, linkage_of, values_of

import explore
from explore.base.errors import RequestError

#: A four-bar whose coupler has a point.
COUPLER = FOUR_BAR | {
    "output": "rocker",
    "links": FOUR_BAR["links"] | {"coupler": {"A": 0, "B": "r2", "M": ["along", "across"]}},
}
#: Lengths of the table and of the mechanism, by the names of the latter.
NAMES = {"crank": "r1", "coupler": "r2", "rocker": "r3", "ground": "r4", "M_along": "along", "M_across": "across"}
PATHS = ["path_error_rms", "path_error_max", "path_crank_span", "path_error_hausdorff", "path_error_chamfer"]
POSES = ["position_error_max", "angle_error_max", "pose_error_rms"]


def four_bars(count=200, seed=3):
    """Crank-rockers anywhere in the plane, as columns of the mechanism."""
    rng = np.random.default_rng(seed)
    lengths = {"crank": 30.0, "coupler": 100.0, "rocker": 80.0, "ground": 110.0, "M_along": 60.0, "M_across": 20.0}
    designs = {name: value * np.exp(rng.normal(0.0, 0.05, count)) for name, value in lengths.items()}
    pose = {"crank_pivot_x": rng.normal(0, 20, count), "crank_pivot_y": rng.normal(0, 20, count)}
    return designs | pose | {"ground_angle": rng.uniform(0, 360, count)}


def both(designs, target, metrics):
    """The same designs as a mechanism and as a table."""
    point = {"points": "M"} if "point" in target else {}
    built_in = explore.evaluate("crank-rocker", designs, target=target, metrics=metrics, **point)
    renamed = {NAMES.get(name, name): column for name, column in designs.items()}
    table = explore.evaluate(explore.Linkage(COUPLER), renamed, target=target, metrics=metrics)
    return built_in[metrics].to_numpy(), table[metrics].to_numpy()


@pytest.mark.parametrize("timed", [False, True])
def test_paths_of_a_four_bar_are_those_of_the_mechanism(timed):
    angles = np.radians(np.arange(0, 360, 45.0))
    points = np.column_stack([40 + 25 * np.cos(angles), 60 + 14 * np.sin(angles)]).tolist()
    target = {"kind": "path", "point": "M", "points": points, "closed": True}
    target |= {"crank_angles": np.degrees(angles).tolist()} if timed else {}
    built_in, table = both(four_bars(), target, PATHS)
    assert np.isfinite(built_in).all()
    # the same search from curves that differ by roundings; where two orders are nearly as good, the better one counts
    assert np.median(np.abs(table - built_in)) < 1e-11
    assert np.mean(np.abs(table - built_in) <= 1e-6 * np.abs(built_in) + 1e-9) > 0.97


def test_functions_of_a_four_bar_are_those_of_the_mechanism():
    """Also where the crank does not turn fully."""
    designs = {name: column for name, column in four_bars().items() if name in NAMES}
    designs["ground"][::4] = 160.0
    rng = np.random.default_rng(5)
    starts = {"input_start": rng.uniform(0, 360, 200), "output_start": rng.uniform(0, 360, 200)}
    target = {"kind": "function", "table": [[0, 0], [30, 12], [60, 31]]}
    lengths = {name: column for name, column in designs.items() if not name.startswith("M_")}
    metrics = ["output_error_rms", "output_error_max"]
    built_in = explore.evaluate("crank-rocker", lengths | starts, target=target, metrics=metrics)[metrics]
    renamed = {NAMES[name]: column for name, column in designs.items()}
    table = explore.evaluate(explore.Linkage(COUPLER), renamed | starts, target=target, metrics=metrics)[metrics]
    assert (np.isnan(table) == np.isnan(built_in)).all(axis=None)
    assert np.nanmax(np.abs(table - built_in)) < 1e-12, "roundings of angles up to 180 deg"


def test_functions_of_a_group_are_undefined_where_the_crank_does_not_turn():
    """A group of four links is followed where it turns fully; what other designs had was that of no assembly."""
    linkage = explore.load_linkage(Path(explore.__file__).parent / "data" / "linkages" / "stephenson-2.toml")
    designs = {"r4": 150.0, "r1": np.linspace(10, 40, 61), "l1": 71.0, "l2": 100.0}
    target = {"kind": "function", "table": [[0, 0], [30, 12], [60, 31]]}
    table = explore.evaluate(linkage, designs, target=target, metrics=["output_error_rms", "output_error_max"])
    turns = (table["status"] == 1).to_numpy()
    assert 5 < turns.sum() < 56
    for name in ("output_error_rms", "output_error_max"):
        np.testing.assert_array_equal(np.isfinite(table[name]), turns)
    window = {"from": 0, "to": 60}
    within = explore.evaluate(linkage, designs, target=target, metrics=["output_error_rms"], window=window)
    np.testing.assert_array_equal(np.isfinite(within["output_error_rms"]), within["feasible"])
    design = {name: float(np.atleast_1d(column)[0]) for name, column in designs.items()}
    angles = explore.simulate(linkage, design, angles=[0, 30, 60])["rocker_angle"].to_numpy()
    missed = (angles - [0, 12, 31] + 180) % 360 - 180
    assert table["output_error_max"][0] == pytest.approx(np.abs(missed).max(), abs=1e-9)


@pytest.mark.parametrize("order", ["given", "any"])
def test_poses_of_the_motion_itself_are_met(order):
    """Those of the coupler, anywhere in the plane, with the body turned from it."""
    linkage, lengths = explore.Linkage(COUPLER), {"r1": 30, "r2": 100, "r3": 80, "r4": 110, "along": 40, "across": 25}
    motion = explore.simulate(linkage, lengths, angles=np.arange(20, 300, 31.0))
    x, y, turned = (motion[name].to_numpy() for name in ("M_x", "M_y", "coupler_angle"))
    cosine, sine = np.cos(np.radians(37.0)), np.sin(np.radians(37.0))
    poses = np.column_stack([5 + cosine * x - sine * y, -9 + sine * x + cosine * y, turned + 107.0])
    design = lengths | {"crank_pivot_x": 5, "crank_pivot_y": -9, "ground_angle": 37, "body_angle": 70}
    target = {"kind": "poses", "point": "M", "poses": poses.tolist(), "order": order}
    found = explore.evaluate(linkage, design, target=target, metrics=POSES)[POSES]
    assert found.to_numpy() == pytest.approx(0.0, abs=2e-12), "roundings of numbers up to 150"


@pytest.mark.parametrize(("name", "point"), [("jansen", "T"), ("klann", "F"), ("watt-2", "")])
def test_paths_of_the_motion_itself_are_met(name, point):
    """Of a point behind several dyads, by its crank angles and by its order."""
    linkage, parameters = linkage_of(CASES[name]), values_of(CASES[name])
    point = point or linkage.mechanism.targets["path"].points[-1]
    motion = explore.simulate(linkage, parameters, angles=np.arange(7.0, 360.0, 30.0))
    points = motion[[f"{point}_x", f"{point}_y"]].to_numpy().tolist()
    for timing in ({}, {"crank_angles": np.arange(7.0, 360.0, 30.0).tolist(), "angles_from": "frame"}):
        target = {"kind": "path", "point": point, "points": points, "closed": True} | timing
        found = explore.evaluate(linkage, parameters, target=target, metrics=PATHS[:2])[PATHS[:2]].to_numpy()
        assert found == pytest.approx(0.0, abs=1e-10), "roundings of lengths up to 100, behind five dyads"


def test_designs_that_do_not_turn_have_no_path():
    designs = {"r1": 30, "r2": 100, "r3": [80, 30], "r4": 110, "along": 40, "across": 25}
    target = {"kind": "path", "point": "M", "points": [[0, 0], [10, 5], [20, 0]]}
    found = explore.evaluate(explore.Linkage(COUPLER), designs, target=target)
    assert np.isfinite(found["path_error_rms"]).tolist() == [True, False]


@pytest.mark.parametrize("metric", ["path_error_rms", "pose_error_rms", "doubled", "dwell_error", "dwell_start"])
def test_cranks_that_move_over_an_interval_alone_have_no_errors_and_are_not_feasible(metric):
    places = [[40, 30, 0], [60, 40, 5], [80, 20, 10]]
    target = {"kind": "path", "point": "M", "points": [place[:2] for place in places]}
    if metric == "pose_error_rms":
        target = {"kind": "poses", "point": "M", "poses": places}
    if metric.startswith("dwell"):
        target = {"kind": "dwell", "angle": 60}
    request = {"window": {"from": -20, "to": 20}, "target": target, "metrics": [metric, "rocker_velocity_peak"]}
    if metric == "doubled":
        request["formulas"] = {"doubled": {"formula": "2 * path_error_rms", "unit": "mm"}}
    designs = {"r1": [30, 60], "r2": 85, "r3": 50, "r4": 100, "along": 20, "across": 10}
    found = explore.evaluate(explore.Linkage(COUPLER), designs, **request)
    assert np.isfinite(found[metric]).tolist() == found["feasible"].tolist() == [True, False]
    assert found.attrs["labels"]["status"][found["status"][1]] == "crank_blocked_at_B"


def test_a_linkage_with_a_target_is_pickled():
    linkage = explore.Linkage(COUPLER)
    target = {"kind": "path", "point": "M", "points": [[0, 0], [10, 5], [20, 0]]}
    mechanism = explore.studies.request.names.find_mechanism(linkage, target=target)
    other = pickle.loads(pickle.dumps(mechanism.for_signals(["path_error_rms"])))
    assert other.target == mechanism.target
    assert "path_error_rms" in {formula.name for formula in other.formulas}


@pytest.mark.parametrize(
    ("target", "reason"),
    [
        (
            {"kind": "path", "points": [[0, 0], [1, 1], [2, 0]]},
            "which point follows it? Write point = 'A' or 'B' or 'M'",
        ),
        ({"kind": "path", "point": "N", "points": [[0, 0], [1, 1], [2, 0]]}, "unknown point 'N'"),
        ({"kind": "poses", "point": "A", "poses": [[0, 0, 0], [1, 1, 5]]}, "unknown point 'A'; available: M"),
        (
            {"kind": "path", "point": "M", "points": [[1e300, 0], [1, 1], [2, 0]]},
            "point 1 is too far away: at most 1e+12",
        ),
        ({"kind": "cam"}, "the kind of target is missing or unknown"),
    ],
)
def test_targets_that_a_linkage_cannot_have(target, reason):
    with pytest.raises(RequestError, match=re.escape(reason)):
        explore.evaluate(explore.Linkage(COUPLER), {"r1": 30, "r2": 100, "r3": 80, "r4": 110}, target=target)


def test_a_length_with_the_name_of_a_metric_of_the_target_is_refused():
    linkage = explore.Linkage(json.loads(json.dumps(COUPLER).replace('"r1"', '"path_crank_span"')))
    target = {"kind": "path", "point": "M", "points": [[0, 0], [1, 1], [2, 0]]}
    reason = "target: its metric path_crank_span would have the name of another column"
    with pytest.raises(RequestError, match=reason):
        explore.evaluate(linkage, {"path_crank_span": 30, "r2": 100, "r3": 80, "r4": 110}, target=target)


def test_the_place_of_a_linkage_is_swept_with_its_target():
    study = explore.Study(
        mechanism=explore.Linkage(COUPLER),
        parameters={"r1": 30, "r2": 100, "r3": 80, "r4": 110, "along": 40, "across": 25,
                    "crank_pivot_x": [0, 5], "ground_angle": {"start": 0, "stop": 20, "num": 2}},
        target={"kind": "path", "point": "M", "points": [[0, 0], [10, 5], [20, 0]]},
        metrics=["path_error_rms"],
    )  # fmt: skip
    assert study.space.n_designs == 4
    with pytest.raises(explore.ConfigError, match="ground_angle"):
        explore.Study(
            mechanism=explore.Linkage(FOUR_BAR), parameters={"r1": 1, "r2": 2, "r3": 2, "r4": 2, "ground_angle": 0}
        )


def test_a_limited_crank_meets_no_targets():
    limited = explore.Linkage(COUPLER | {"range": [-50, 50]})
    with pytest.raises(RequestError, match="with a range meets no targets; leave out the target or the range"):
        explore.evaluate(limited, {"r1": 30}, target={"kind": "path"})


def test_a_study_of_a_linkage_with_a_target_is_swept_improved_and_drawn(tmp_path):
    study = run("init", "walk.toml", "--linkage", "jansen", cwd=tmp_path) and tmp_path / "walk.toml"
    text, _, _ = study.read_text().partition("[sampling]")
    points = "[[-52, -91], [-36, -91], [-20, -91], [-4, -91], [12, -91]]"
    target = f'[target]\nkind = "path"\npoint = "T"\npoints = {points}\n'
    study.write_text(f'{text}{target}[sampling]\nmethod = "sobol"\ncount = 64\nseed = 1\n')
    run("sweep", "walk.toml", "-o", "walk.h5", cwd=tmp_path)
    assert "path_error_rms (min), transmission_angle_min (max)" in run("rank", "walk.h5", cwd=tmp_path).stderr
    run("polish", "walk.h5", "-o", "polished.csv", cwd=tmp_path)
    first = np.nanmin(explore.rank(tmp_path / "walk.h5")["path_error_rms"])
    assert pd.read_csv(tmp_path / "polished.csv")["path_error_rms"].min() < first
    run("plot", "path", "walk.h5", "-o", "path.png", cwd=tmp_path)
    run("export", "walk.h5", "-o", "walk.dxf", cwd=tmp_path)
