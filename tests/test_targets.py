"""Paths as targets: errors of linkages at the best crank angles, and studies with them."""

import itertools
import json
import tomllib

import numpy as np
import pandas as pd
import pytest
from command_line import run
from numba import njit, types
from scipy.spatial import cKDTree
from synthesis_cases import PROBLEMS, least_ordered
from target_studies import SQUARE, study_of

import explore
from explore.base.compiling import LANES
from explore.base.errors import ConfigError, RequestError
from explore.mechanisms.linkages.motions import TableMotion
from explore.mechanisms.registry import MECHANISMS
from explore.mechanisms.targets.path_errors import metrics as path_metrics
from explore.mechanisms.targets.path_errors.curve import CURVE, CURVE_SIZE, ROWS, fill_rows
from explore.mechanisms.targets.path_errors.metrics import measure_paths
from explore.model.targets import target_from_content
from explore.studies.config.study_file import linkage_starter
from explore.studies.request.names import find_mechanism


def published(name):
    """A published linkage as a design, and its path as a target."""
    problem = PROBLEMS[name]
    own = problem["published"]
    distance, angle = own["coupler_point_distance"], own["coupler_point_angle_rad"]
    x, y = own["crank_pivot"]
    design = {length: own[length] for length in ("crank", "coupler", "rocker", "ground")}
    design |= {"M_along": distance * np.cos(angle), "M_across": distance * np.sin(angle)}
    design |= {"crank_pivot_x": x, "crank_pivot_y": y, "ground_angle": f"{own['ground_angle_rad']!r} rad"}
    return design, {"kind": "path", "points": problem["points"], "closed": True}


@pytest.mark.parametrize(("name", "printed"), [("mkh1", 4.96e-3), ("yu1", 3.43), ("ullah", 0.975)])
def test_published_linkages_have_their_sums_of_squares(name, printed):
    design, target = published(name)
    table = explore.evaluate(
        "crank-rocker", design, points="M", target=target, metrics=["path_error_rms", "path_error_max"]
    )
    n = len(target["points"])
    # printed with three digits
    assert table["path_error_rms"][0] ** 2 * n == pytest.approx(printed, rel=1.5e-3)
    assert table["path_error_rms"][0] < table["path_error_max"][0] < np.sqrt(n) * table["path_error_rms"][0]
    assert table.attrs["units"]["path_error_max"] == "mm"
    assert table.attrs["senses"]["path_error_rms"] == "min"


def test_a_motion_is_exported_in_the_plane_of_the_target(tmp_path):
    results = explore.sweep(study_of("path"), tmp_path / "square.h5", workers=1)
    best = int(explore.rank(results).index[0])
    row = results.design(best)
    explore.export(results, tmp_path / "best.csv", design=best)
    table = pd.read_csv(tmp_path / "best.csv")
    angle = np.deg2rad(table["crank_angle [deg]"] + row["ground_angle"])
    # some roundings of numbers up to 100
    for axis, along in (("x", np.cos(angle)), ("y", np.sin(angle))):
        joint = row[f"crank_pivot_{axis}"] + row["crank"] * along
        assert table[f"crank joint {axis} [mm]"].to_numpy() == pytest.approx(joint.to_numpy(), abs=1e-12)


def test_the_target_is_part_of_the_identity():
    other = {"kind": "path", "points": [*SQUARE[:3], [0, 11]], "closed": True}
    assert study_of("path") == study_of("path", target={"kind": "path", "point": "M", "points": SQUARE, "closed": True})
    assert study_of("path") != study_of("path", target=other)
    assert "target" not in json.loads(explore.Study(mechanism="crank-rocker", parameters=LENGTHS).identity)


LENGTHS = {"crank": 30, "coupler": 100, "rocker": 80, "ground": 110}


def test_the_error_moves_with_the_linkage_and_scales_with_it():
    """A motion of path and linkage changes nothing; a scale scales; a reversed path is the same path."""
    rng = np.random.default_rng(3)
    path = rng.normal(0.0, 30.0, (8, 2))
    turn, shift, scale = 0.7, np.array([4.0, -9.0]), 2.5
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])

    def errors(path, factor=1.0, **pose):
        design = {name: factor * value for name, value in LENGTHS.items()} | pose
        design |= {"M_along": factor * 40, "M_across": factor * 25}
        target = {"kind": "path", "points": path.tolist()}
        metrics = ["path_error_rms", "path_error_max", "path_crank_span"]
        return explore.evaluate("crank-rocker", design, points="M", target=target, metrics=metrics)[metrics].to_numpy()

    plain = errors(path)
    moved = errors(path @ rotation.T + shift, crank_pivot_x=4.0, crank_pivot_y=-9.0, ground_angle=np.degrees(turn))
    # angles of pooled points are where a sum is flat: its error is the square of theirs
    np.testing.assert_allclose(moved, plain, rtol=1e-9)
    np.testing.assert_allclose(errors(scale * path, scale), plain * [[scale, scale, 1.0]], rtol=1e-9)
    np.testing.assert_allclose(errors(path[::-1]), plain, rtol=1e-9)


def test_points_of_the_path_itself_have_no_error():
    """Both branches, cranks and double-cranks, either sense: points of a motion lie on it, in the crank's order."""
    for lengths in (LENGTHS, {"crank": 110, "coupler": 100, "rocker": 90, "ground": 30}):
        for branch in (1, -1):
            design = lengths | {"branch": branch}
            motion = explore.simulate("crank-rocker", design, points={"M": (40, 25)}, angles=np.arange(20, 300, 31.0))
            for step in (1, -1):
                path = motion[["M_x", "M_y"]].to_numpy()[::step].tolist()
                table = explore.evaluate(
                    "crank-rocker", design | {"M_along": 40, "M_across": 25}, points="M",
                    target={"kind": "path", "points": path}, metrics=["path_error_rms", "path_crank_span"],
                )  # fmt: skip
                assert table["feasible"][0]
                assert table["path_error_rms"][0] < 1e-11
                assert table["path_crank_span"][0] == pytest.approx(279.0, abs=1e-6)


def test_slider_cranks_follow_paths():
    """Points of a motion of a rod, posed in the plane; the published slider-crank for twelve points."""
    lengths = {"crank": 30, "rod": 100, "offset": 12}
    motion = explore.simulate("slider-crank", lengths, points={"M": (40, 25)}, angles=np.arange(5, 340, 23.0))
    turn = np.radians(30.0)
    path = motion[["M_x", "M_y"]].to_numpy() @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]] + [7, -5]
    pose = {"crank_pivot_x": 7, "crank_pivot_y": -5, "ground_angle": 30}
    table = explore.evaluate(
        "slider-crank", lengths | pose | {"M_along": 40, "M_across": 25}, points="M",
        target={"kind": "path", "points": path.tolist()}, metrics=["path_error_rms", "path_crank_span"],
    )  # fmt: skip
    assert table["path_error_rms"][0] < 1e-11
    assert table["path_crank_span"][0] == pytest.approx(322.0, abs=1e-6)

    x = [7.88, 7.05, 6.21, 5.62, 5.38, 5.49, 5.92, 6.59, 7.37, 8.07, 8.47, 8.41]
    y = [6.22, 6.00, 5.65, 5.29, 4.96, 4.69, 4.58, 4.66, 4.96, 5.42, 5.88, 6.18]
    design = {
        "crank": 1.64, "rod": 5.92, "offset": -2.58, "M_along": 3.41 * np.cos(0.270526),
        "M_across": 3.41 * np.sin(0.270526), "crank_pivot_x": 3.64, "crank_pivot_y": 4.56,
        "ground_angle": "0.441743 rad",
    }  # fmt: skip
    table = explore.evaluate(
        "slider-crank", design, points="M", metrics=["path_error_rms", "path_error_max"],
        target={"kind": "path", "points": np.column_stack([x, y]).tolist(), "closed": True},
    )  # fmt: skip
    assert table["path_error_rms"][0] == pytest.approx(0.027418, abs=1e-5)
    assert table["path_error_max"][0] == pytest.approx(0.048328, abs=1e-5)


@pytest.mark.parametrize("mechanism", ["crank-rocker", "slider-crank"])
def test_timed_points(mechanism):
    """Distances at given angles from the frame; a free shift is found again, and beats every tried one."""
    lengths = LENGTHS if mechanism == "crank-rocker" else {"crank": 30, "rod": 100, "offset": 12}
    angles = np.array([10.0, 55, 70, 160, 200, 290])
    motion = explore.simulate(mechanism, lengths, points={"M": (40, 25)}, angles=angles)
    exact = motion[["M_x", "M_y"]].to_numpy()
    noisy = exact + np.random.default_rng(2).normal(0, 3.0, exact.shape)
    design = lengths | {"M_along": 40, "M_across": 25}

    def errors(path, crank_angles, angles_from, closed=False):
        target = {"kind": "path", "points": path.tolist(), "crank_angles": list(crank_angles), "closed": closed}
        metrics = ["path_error_rms", "path_error_max", "path_crank_span"]
        return explore.evaluate(
            mechanism, design, points="M", target=target | {"angles_from": angles_from}, metrics=metrics
        ).loc[0, metrics]

    assert errors(exact, angles + 77.0, "free")["path_error_rms"] < 1e-11
    assert errors(exact, angles, "frame")["path_crank_span"] == pytest.approx(280.0)
    assert errors(exact, angles, "frame", closed=True)["path_crank_span"] == 360.0
    distances = np.hypot(*(noisy - exact).T)
    found = errors(noisy, angles, "frame")
    assert found["path_error_rms"] == pytest.approx(np.sqrt(np.mean(distances**2)), rel=1e-12)
    assert found["path_error_max"] == pytest.approx(distances.max(), rel=1e-12)
    tried = [errors(noisy, angles + shift, "frame")["path_error_rms"] for shift in range(0, 360, 15)]
    assert errors(noisy, angles, "free")["path_error_rms"] < min(tried)


def test_a_path_from_a_file(tmp_path):
    """With and without a heading, comma or semicolon; results hold the points, so that the file may go."""
    for text in ("x,y\n0,0\n10,0\n10,10\n0,10\n", "0;0\n1 cm;0\n10;10\n\n0;10\n"):
        (tmp_path / "square.csv").write_text(text)
        target = {"kind": "path", "file": str(tmp_path / "square.csv"), "closed": True}
        assert study_of("path", target=target) == study_of("path")
    (tmp_path / "study.toml").write_text(study_of("path").to_toml().replace(
        "points = [[0, 0], [10, 0], [10, 10], [0, 10]]", 'file = "square.csv"'))  # fmt: skip
    own = explore.load_study(tmp_path / "study.toml")
    assert own == study_of("path")
    results = explore.sweep(own, tmp_path / "square.h5", workers=1)
    (tmp_path / "square.csv").unlink()
    refined = explore.refine(results, tmp_path / "refined.h5", evaluations=300, workers=1)
    assert refined.target == own.request.mechanism.target
    (tmp_path / "timed.csv").write_text("x,y,crank_angle\n0,0,0\n10,0,30\n10,10,1 rad\n")
    mechanism = find_mechanism("crank-rocker", ("M",), {"kind": "path", "file": str(tmp_path / "timed.csv")})
    assert mechanism.target.crank_angles == (0.0, 30.0, pytest.approx(57.29577951308232))


def test_metrics_of_a_block_share_its_measures(monkeypatch):
    calls = []
    for name in ("measure_ordered", "measure_shapes"):
        own = getattr(path_metrics, name)
        monkeypatch.setattr(path_metrics, name, lambda *given, own=own: (calls.append(own), own(*given)))
    design = LENGTHS | {"M_along": 40, "M_across": 26}
    names = ["path_error_rms", "path_error_max", "path_error_hausdorff", "path_error_chamfer"]
    target = {"kind": "path", "points": SQUARE}
    explore.evaluate("crank-rocker", design, points="M", target=target, metrics=names)
    assert len(calls) == 2, "the order of the points and the traced path, each once"


def curve(angles):
    """The path of a point at crank angles, deg, (n, 2)."""
    motion = explore.simulate("crank-rocker", LENGTHS, points={"M": (40, 25)}, angles=angles)
    return motion[["M_x", "M_y"]].to_numpy()


def shapes_of_path(closed, noise):
    """A path beside that curve, its shape metrics and span, and the crank angles of its points, deg."""
    design, rng = LENGTHS | {"M_along": 40, "M_across": 25}, np.random.default_rng(8)
    path = curve(np.arange(0, 360, 24.0) if closed else np.arange(40, 200, 10.0))
    path = path + rng.normal(0.0, noise, path.shape)
    names = ["path_error_hausdorff", "path_error_chamfer", "path_crank_span"]
    target = {"kind": "path", "points": path.tolist(), "closed": closed}
    found = explore.evaluate("crank-rocker", design, points="M", target=target, metrics=names)
    mechanism = find_mechanism("crank-rocker", ("M",), target)
    columns = [np.array([design.get(name, default)], dtype=float) for name, default in (
        *((name, None) for name in LENGTHS), ("branch", 1), ("M_along", None), ("M_across", None),
        ("transmission_angle_min", 1), ("crank_pivot_x", 0), ("crank_pivot_y", 0), ("ground_angle", 0),
    )]  # fmt: skip
    motion = mechanism.targets["path"].formulas.motion_of("M")
    return path, found, np.degrees(measure_paths(motion, mechanism.target, tuple(columns))[1][0])


@pytest.mark.parametrize("noise", [2.0, 200.0])
@pytest.mark.parametrize("closed", [True, False])
def test_shapes_are_those_of_all_chords(closed, noise):
    """Near the curve most chords are skipped, far from it few are."""
    path, found, angles = shapes_of_path(closed, noise)
    first, span = angles.min(), 360.0 if closed else np.ptp(angles)
    traced = curve(np.linspace(first, first + span, 257))
    ends = np.vstack([path, path[:1]]) if closed else path
    sides = [np.linalg.norm(last - first) for first, last in itertools.pairwise(ends)]
    polygon = [ends[:1]]
    for one, other, side in zip(ends, ends[1:], sides, strict=False):
        parts = 1 + int(256 * side / sum(sides))
        polygon.append(one + np.arange(1, parts + 1)[:, None] / parts * (other - one))
    polygon = np.vstack(polygon)

    def distances(places, line):
        along = np.diff(line, axis=0)
        share = ((places[:, None] - line[:-1]) * along).sum(axis=2) / (along**2).sum(axis=1)
        return np.linalg.norm(places[:, None] - line[:-1] - np.clip(share, 0, 1)[..., None] * along, axis=2).min(axis=1)

    def mean(line, other):
        return np.average(
            distances(0.5 * (line[1:] + line[:-1]), other), weights=np.linalg.norm(np.diff(line, axis=0), axis=1)
        )

    middles = [distances(0.5 * (a[1:] + a[:-1]), b) for a, b in ((polygon, traced), (traced, polygon))]
    largest = max(
        *(each.max() for each in middles), distances(path, traced).max(), *distances(traced[[0, -1]], polygon)
    )
    # roundings of crank angles, by which the curve moves 1e-14 of its size
    assert found["path_error_hausdorff"][0] == pytest.approx(largest, rel=1e-12)
    assert found["path_error_chamfer"][0] == pytest.approx(
        0.5 * (mean(polygon, traced) + mean(traced, polygon)), rel=1e-12
    )


@pytest.mark.parametrize("closed", [True, False])
def test_hausdorff_and_chamfer(closed):
    """Of a curve and a path beside it, against both sampled densely; the traced arc ends where the path does."""
    path, found, angles = shapes_of_path(closed, 2.0)
    corners = np.vstack([path, path[:1]]) if closed else path
    share = np.linspace(0.0, 1.0, 200)[:, None]
    polygon = np.vstack([first + share * (last - first) for first, last in itertools.pairwise(corners)])
    if closed:
        traced = curve(np.arange(0, 360, 0.05))
    else:
        assert np.ptp(angles) == pytest.approx(found["path_crank_span"][0])
        traced = curve(np.linspace(angles.min(), angles.max(), 5000))
    there, _ = cKDTree(traced).query(polygon)
    back, _ = cKDTree(polygon).query(traced)
    lengths = np.linalg.norm(np.gradient(traced, axis=0), axis=1)  # of the curve that a sample stands for
    sides = np.linalg.norm(np.gradient(polygon, axis=0), axis=1)
    chamfer = 0.5 * (np.average(there, weights=sides) + np.average(back, weights=lengths))
    # 256 places of each, about 0.8 mm apart: the largest distance is seen to half of that along a slope
    assert found["path_error_hausdorff"][0] == pytest.approx(max(there.max(), back.max()), abs=0.2)
    corner = cKDTree(traced).query(path)[0].max()  # which is seen exactly, here between samples
    assert found["path_error_hausdorff"][0] > 0.999 * corner
    assert found["path_error_chamfer"][0] == pytest.approx(chamfer, rel=0.01)


def test_designs_whose_crank_does_not_turn_have_no_error():
    design = {"crank": 50, "coupler": 100, "rocker": 100, "ground": 260, "M_along": 1, "M_across": 2}
    target = {"kind": "path", "points": SQUARE}
    table = explore.evaluate("crank-rocker", design, points="M", target=target, metrics=["path_error_rms"])
    assert np.isnan(table["path_error_rms"][0])
    assert not table["feasible"][0]


def least_sum(design, path, count=360):
    """The least sum of squares over all orders of `count` crank angles in both senses, by brute force."""
    crank, coupler, rocker, ground, branch, along, across, x, y, angle = design
    pin = crank * np.exp(2j * np.pi * np.arange(count) / count)
    diagonal = ground - pin
    square = np.abs(diagonal) ** 2
    share = 0.5 * (square + (coupler - rocker) * (coupler + rocker)) / square
    height = np.sqrt(coupler**2 / square - share**2)
    curve = pin + (along + 1j * across) * diagonal * (share + 1j * branch * height) / coupler
    points = (path[:, 0] - x + 1j * (path[:, 1] - y)) * np.exp(-1j * np.radians(angle))
    return least_ordered(np.abs(curve - points[:, None]) ** 2)


def test_the_order_is_the_best_of_all():
    """Random linkages far off a path: no order of many samples has a smaller sum."""
    rng = np.random.default_rng(5)
    path = np.array(PROBLEMS["yu1"]["points"])
    n = 40
    designs = np.column_stack([
        np.full(n, 18.0), rng.uniform(30, 60, n), rng.uniform(50, 60, n), rng.uniform(45, 62, n),
        rng.choice([1, -1], n), rng.normal(0, 25, (n, 4)), rng.uniform(0, 360, n),
    ])  # fmt: skip
    names = ("crank", "coupler", "rocker", "ground", "branch", "M_along", "M_across", "crank_pivot_x", "crank_pivot_y",
             "ground_angle")  # fmt: skip
    table = explore.evaluate(
        "crank-rocker", dict(zip(names, designs.T, strict=True)), points="M",
        target={"kind": "path", "points": path.tolist()}, metrics=["path_error_rms"],
    )  # fmt: skip
    turns = table["path_error_rms"].notna().to_numpy()
    assert turns.sum() > 20
    least = np.array([least_sum(design, path) for design in designs[turns]])
    found = table["path_error_rms"].to_numpy()[turns] ** 2 * len(path)
    # arcs are divided until no order has a sum that is lower by more than a thousandth
    assert (found <= least * 1.001).all()
    assert np.mean(found <= least * (1.0 + 1e-9)) > 0.9


@pytest.fixture(scope="module")
def long_path():
    """A closed path of 147 points, 8 mm beside the curve of a linkage, and 20 linkages like it."""
    rng = np.random.default_rng(7)
    lengths = {"crank": 30.0, "coupler": 100.0, "rocker": 80.0, "ground": 110.0}
    motion = explore.simulate("crank-rocker", lengths, points={"M": (50, 20)}, angles=np.arange(147) * 360 / 147)
    path = motion[["M_x", "M_y"]].to_numpy() + rng.normal(0.0, 8.0, (147, 2))
    designs = {name: value * np.exp(rng.normal(0.0, 0.03, 20)) for name, value in lengths.items()}
    return path, designs | {"M_along": rng.normal(50, 3, 20), "M_across": rng.normal(20, 3, 20)}


def errors_of(long_path, factor=1.0):
    """The rms distances of the linkages to a long path."""
    path, designs = long_path
    target = {"kind": "path", "points": (factor * path).tolist(), "closed": True}
    table = explore.evaluate("crank-rocker", designs, points="M", target=target, metrics=["path_error_rms"])
    return table["path_error_rms"].to_numpy()


def test_the_order_of_many_points_is_the_best_of_all(long_path):
    """No order of 360 samples has a smaller sum, but for one in ten, by 0.5 % of the rms at most."""
    path, designs = long_path
    branch, place = np.ones(20), np.zeros((20, 3))
    columns = np.column_stack([
        *(designs[name] for name in ("crank", "coupler", "rocker", "ground")), branch, designs["M_along"],
        designs["M_across"], place,
    ])  # fmt: skip
    least = np.array([least_sum(design, path) for design in columns[:8]])
    found = errors_of(long_path)[:8] ** 2 * len(path)
    assert (found <= least * (1.0 + 1e-9)).sum() >= 7
    assert (found <= least * 1.01).all()


def test_rounding_does_not_choose_the_angles_of_many_points(long_path):
    """Points that move by 1e-13 of themselves change the errors by no more than 1e-9 of them."""
    np.testing.assert_allclose(errors_of(long_path, 1.0 + 1e-13), errors_of(long_path), rtol=1e-9)


def test_bad_targets_are_all_named(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text(
        'mechanism = "crank-rocker"\n[parameters]\ncrank = 1\ncoupler = 3\nrocker = 3\nground = 3\n'
        '[points]\nM = { along = 1, across = 1 }\n[target]\nkind = "path"\npoint = "N"\n'
        "points = [[0, 0], [1, 2, 3], [\"1 kg\", 3], [4, 5]]\nweights = [1, 0]\nclose = true\n"
    )  # fmt: skip
    with pytest.raises(ConfigError) as caught:
        explore.load_study(file)
    lines = caught.value.problems
    assert any(line.startswith(f"{file}:11: target.point: unknown point 'N'") for line in lines), lines
    assert any("point 2 must be [x, y], got" in line for line in lines)
    assert any("above 0" in line for line in lines)
    assert any("weights: 2 for 4 points" in line for line in lines)
    assert any("target.close: unknown key; did you mean 'closed'?" in line for line in lines)


def test_a_target_of_arrays_is_one_of_lists():
    lists = {"kind": "path", "points": SQUARE, "crank_angles": [0, 90, 180, 270]}
    arrays = {key: np.array(value) if isinstance(value, list) else value for key, value in lists.items()}
    assert find_mechanism("crank-rocker", ("M",), arrays) == find_mechanism("crank-rocker", ("M",), lists)
    assert study_of("path", target=arrays) == study_of("path", target=lists)


def test_mechanisms_and_points_that_meet_no_target():
    with pytest.raises(RequestError, match="has no point to follow it"):
        find_mechanism("crank-rocker", (), {"kind": "path", "points": SQUARE})
    with pytest.raises(RequestError, match="meets no targets"):
        find_mechanism("gears", (), {"kind": "path", "points": SQUARE})
    with pytest.raises(RequestError, match="Write point = 'M' or 'N'"):
        find_mechanism("crank-rocker", ("M", "N"), {"kind": "path", "points": SQUARE})


def test_commands_on_a_study_with_a_target(tmp_path):
    """Simulate takes the pose of a study's design; tune finds a length for an error; the motion is in the frame."""
    (tmp_path / "square.toml").write_text(study_of("path").to_toml())
    run("simulate", "square.toml", "--design", "3", "--set", "crank_pivot_x=2", "-o", "motion.csv", cwd=tmp_path)
    assert (tmp_path / "motion.csv").exists()
    results = explore.sweep(study_of("path"), tmp_path / "square.h5", workers=1)
    best = int(explore.rank(results).index[0])
    twice = 2.0 * results.design(best)["path_error_rms"]
    printed = run(
        "tune",
        "square.h5",
        "--parameter",
        "crank_pivot_x",
        "--metric",
        "path_error_rms",
        "--to",
        f"{twice}",
        cwd=tmp_path,
    ).stdout
    assert "crank_pivot_x" in printed


def test_a_record_without_a_kind_is_a_path():
    content = {"point": "M", "points": SQUARE}
    assert target_from_content(content) == target_from_content({"kind": "path", **content})


@njit(types.void(CURVE, types.float64[::1], types.float64, types.float64, types.float64[::1]))
def call_curve(curve, shape, cosine, sine, out):
    curve(shape, cosine, sine, out)


@pytest.mark.parametrize(
    ("mechanism", "design"),
    [
        ("crank-rocker", (30.0, 100.0, 80.0, 110.0, 1.0, 60.0, 20.0)),
        ("crank-rocker", (30.0, 100.0, 80.0, 110.0, -1.0, 60.0, 20.0)),
        ("slider-crank", (30.0, 100.0, 10.0, 60.0, 20.0)),
    ],
)
def test_derivatives_of_curves_are_those_of_finite_changes(mechanism, design):
    """Wrong ones would only make a polished point slower to find, or a little worse."""
    motion = MECHANISMS[mechanism].targets["poses"].formulas.motion_of("M")
    shape = motion.shapes(np.array([[*design, 1.0]]))[0]  # of a crank that turns

    def at(angle):
        out = np.empty(12)
        call_curve(motion.function(), shape, np.cos(angle), np.sin(angle), out)
        return out

    step = 1e-5  # errors of the square of it, and of roundings of 1e-14 mm over it
    for angle in np.linspace(0.1, 6.1, 13):
        changes = (at(angle + step) - at(angle - step)) / (2.0 * step)
        for first in (0, 6):  # of the point, then of the direction of its link
            assert at(angle)[first + 2 : first + 6] == pytest.approx(changes[first : first + 4], abs=1e-6)
        assert np.hypot(*at(angle)[6:8]) == pytest.approx(1.0, abs=1e-14)


@njit(types.void(ROWS, types.float64[::1], types.float64[:, ::1], types.float64[::1], types.float64[::1]))
def call_rows(rows_of_curve, shape, rays, shapes, out):
    fill_rows(rows_of_curve, shape, rays, shapes, out)


def motion_of_a_table(name, point, link):
    """The motion of a point of a starter, and its parameters at the lower ends of their ranges."""
    sections = tomllib.loads(linkage_starter(name))
    table, entries = explore.Linkage(sections).table, sections["parameters"]
    values = [entries[parameter.name] for parameter in table.parameters]
    return TableMotion(table, point, link), [each["min"] if isinstance(each, dict) else each for each in values]


def motion_of_a_crank_rocker():
    motion = MECHANISMS["crank-rocker"].targets["poses"].formulas.motion_of("M")
    return motion, [30.0, 100.0, 80.0, 110.0, -1.0, 60.0, 20.0, 1.0]


@pytest.mark.parametrize(
    ("motion", "values"),
    [
        motion_of_a_crank_rocker(),
        motion_of_a_table("watt-2", "D", "rod"),
        motion_of_a_table("stephenson-2", "D", "coupler"),
    ],
    ids=["built-in", "table", "group"],
)
def test_curves_at_rows_of_angles_are_those_at_each(motion, values):
    """The angles of each row are in both halves of the turn, which formulas tell apart."""
    (shape,) = motion.shapes(np.array([values]))
    assert not np.isnan(shape[0])
    angles = np.random.default_rng(3).permutation(np.linspace(0.0, 2.0 * np.pi, 3 * LANES, endpoint=False))
    rays, found = np.stack([np.cos(angles), np.sin(angles)]), np.empty((3, CURVE_SIZE, LANES))
    call_rows(motion.function_of_rows(), shape, rays, np.empty(LANES * len(shape)), found.ravel())
    each = np.empty((3 * LANES, CURVE_SIZE))
    for ray, out in zip(rays.T, each, strict=True):
        call_curve(motion.function(), shape, *ray, out)
    # The same operations, which may be contracted otherwise: some roundings of the largest number.
    assert found.transpose(0, 2, 1).reshape(-1, CURVE_SIZE) == pytest.approx(each, rel=0.0, abs=1e-14 * abs(each).max())
