"""Certificates of targets: errors of functions and of paths are proved, false rows refuted, the others open."""

import numpy as np
import pytest
from test_linkage_targets import COUPLER

import explore
from explore.analysis.certifying.certification import certify_designs
from explore.analysis.certifying.rows import ROUNDING
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

LENGTHS = {"crank": 100.0, "coupler": 400.0, "rocker": 350.0, "ground": 420.0}
POINT = {"M_along": 200.0, "M_across": 120.0}
PATHS = ["path_error_rms", "path_error_max", "path_crank_span"]
FUNCTIONS = ["output_error_rms", "output_error_max"]
PAIRS = [[0, 0], [10, 4], [20, 7], [30, 9]]


def proofs_of(source, design, metrics, target, change=None):
    """The row of a design, and what is proved of it; `change` moves its first metric by so many allowed errors."""
    options = {"metrics": metrics, "window": "cycle"}
    points = ["M"] if isinstance(source, str) and target["kind"] in ("path", "poses") else []
    frame = explore.evaluate(source, design, target=target, points=points, **options)
    (row,) = frame.astype(float).to_dict(orient="records")
    mechanism = find_mechanism(source, points, target)
    request = make_request(mechanism, **options)
    if change is not None:
        metric = next(metric for metric in request.metrics if metric.name == metrics[0])
        given = {parameter.name: parameter.default for parameter in mechanism.parameters} | row
        columns = [np.array([float(given.get(name, 0.0))]) for name in metric.formula.inputs]
        row[metrics[0]] += change * (row["error"] + ROUNDING) * metric.formula.scale(*columns)[0]
    proof, enclosed = certify_designs(request, {0: row}, [], is_front=False)[0]
    return row, proof, enclosed


def traced(turns, noise=0.0):
    """Points of the curve of M at crank angles, deg, and near it."""
    motion = explore.simulate("crank-rocker", LENGTHS, points={"M": tuple(POINT.values())}, angles=np.mod(turns, 360))
    points = motion[["M_x", "M_y"]].to_numpy()
    return (points + noise * np.random.default_rng(1).standard_normal(points.shape)).tolist()


TURNS = np.array([10.0, 50.0, 93.0, 140.0, 201.0, 260.0])
#: Keys of path targets: in order, closed and not; with crank angles from anywhere, and from the frame.
KINDS = {
    "closed": {"closed": True},
    "open": {},
    "weighted": {"weights": [1.0, 2.0, 0.5, 1.0, 3.0, 1.0]},
    "free": {"crank_angles": (TURNS - 3.0).tolist()},
    "frame": {"crank_angles": TURNS.tolist(), "angles_from": "frame"},
}


@pytest.mark.parametrize("kind", KINDS)
def test_errors_of_paths_are_proved(kind):
    target = {"kind": "path", "point": "M", "points": traced(TURNS, 0.5), **KINDS[kind]}
    for metrics in (PATHS, PATHS[1:]):
        _, proof, _ = proofs_of("crank-rocker", LENGTHS | POINT, metrics, target)
        assert (proof.verdict, proof.reason) == ("proved", "")
        _, proof, _ = proofs_of("crank-rocker", LENGTHS | POINT, metrics, target, change=1.5)
        assert (proof.verdict, proof.reason.startswith(metrics[0])) == ("refuted", True)


def test_rounding_is_what_the_error_says_where_the_curve_meets_the_points():
    """There the error is rounding only, and its bound is relative to the size of the coordinates, not to it."""
    target = {"kind": "path", "point": "M", "points": traced(TURNS), "closed": True}
    row, proof, _ = proofs_of("crank-rocker", LENGTHS | POINT, PATHS, target)
    assert row["path_error_rms"] < 1e-12 < row["error"] * 1e4 < 1e-9
    assert (proof.verdict, proof.reason) == ("proved", "")


def test_shifts_of_crank_angles_are_known_to_the_last_digit():
    """The largest distance moves with them: of designs with noise the best shift by sums alone was off by 1e-8 rad."""
    rng = np.random.default_rng(1)
    for _ in range(8):
        design = LENGTHS | POINT | {"ground": rng.uniform(400, 440), "ground_angle": 36_000.1, "crank_pivot_x": 1e4}
        target = {"kind": "path", "point": "M", "points": traced(TURNS, rng.uniform(0, 5)), **KINDS["free"]}
        _, proof, _ = proofs_of("crank-rocker", design, PATHS, target)
        assert (proof.verdict, proof.reason) == ("proved", "")


@pytest.mark.parametrize("share", [0.1, 0.03])
def test_points_near_the_centre_of_curvature_are_proved(share):
    """The path of a point beside the crank's joint is nearly a circle: the nearest place depends much on the point."""
    beside = {"M_along": 2.0, "M_across": 1.0}
    motion = explore.simulate("crank-rocker", LENGTHS, points={"M": (2.0, 1.0)}, angles=[20.0, 100.0, 190.0, 260.0])
    points = (share * motion[["M_x", "M_y"]].to_numpy()).tolist()
    _, proof, _ = proofs_of("crank-rocker", LENGTHS | beside, PATHS, {"kind": "path", "point": "M", "points": points})
    assert (proof.verdict, proof.reason) == ("proved", "")


def test_a_span_that_both_senses_may_have_is_open():
    """The point between the ends is the centre of a circle: as near everywhere."""
    pin = {"M_along": 0.0, "M_across": 0.0}
    target = {"kind": "path", "point": "M", "points": [[0, 150], [0, 0], [200, 0]]}
    _, proof, _ = proofs_of("crank-rocker", LENGTHS | pin, ["path_crank_span"], target)
    assert proof.verdict == "open"


def test_a_path_of_a_double_crank_has_errors_beside_metrics_that_lack_strokes():
    double = {"crank": 300.0, "coupler": 280.0, "rocker": 260.0, "ground": 100.0} | POINT
    target = {"kind": "path", "point": "M", "points": [[300, 200], [200, 400], [-100, 300], [0, -200]], "closed": True}
    row, proof, _ = proofs_of("crank-rocker", double, ["path_error_rms", "time_ratio"], target)
    assert (np.isnan(row["time_ratio"]), proof.verdict, proof.reason) == (True, "proved", "")


def test_a_path_against_the_order_is_open():
    """Its points are not nearest to the curve where the crank passes them in their order."""
    points = traced(TURNS)
    points[1], points[2] = points[2], points[1]
    _, proof, _ = proofs_of(
        "crank-rocker", LENGTHS | POINT, PATHS[:2], {"kind": "path", "point": "M", "points": points}
    )
    assert proof.verdict == "open"
    assert proof.reason == "the target cannot be certified: its order keeps it from where the curve is nearest"


def test_what_two_places_share_is_open():
    """A point on the axis of a symmetric path has two nearest places, so that the span is not told."""
    symmetric = {"crank": 100.0, "coupler": 400.0, "rocker": 400.0, "ground": 420.0, "M_along": 400.0, "M_across": 0.0}
    target = {"kind": "path", "point": "M", "points": [[0, 300], [100, 300], [200, 300]]}
    _, proof, _ = proofs_of("crank-rocker", symmetric, ["path_crank_span"], target)
    assert proof.verdict == "open"


def posed(noise, turned=0.0):
    """Poses of the coupler at crank angles, with noise, of a body that is turned on it."""
    motion = explore.simulate("crank-rocker", LENGTHS, points={"M": tuple(POINT.values())}, angles=TURNS)
    poses = np.add(motion[["M_x", "M_y", "coupler_angle"]], [0.0, 0.0, turned]).to_numpy()
    return (poses + noise * np.random.default_rng(2).standard_normal(poses.shape)).tolist()


@pytest.mark.parametrize("order", ["given", "any"])
@pytest.mark.parametrize("noise", [0.0, 2.0])
def test_errors_of_poses_are_proved(order, noise):
    target = {"kind": "poses", "poses": posed(noise, 250.0), "order": order}
    metrics = ["position_error_max", "angle_error_max", "pose_error_rms"]
    metrics += ["pose_crank_span"] if order == "given" else []
    design = LENGTHS | POINT | {"body_angle": 250.0}
    for first in range(len(metrics)):
        chosen = metrics[first:] + metrics[:first]
        _, proof, _ = proofs_of("crank-rocker", design, chosen, target)
        assert (proof.verdict, proof.reason) == ("proved", "")
        _, proof, _ = proofs_of("crank-rocker", design, chosen, target, change=1.5)
        assert (proof.verdict, proof.reason.startswith(chosen[0])) == ("refuted", True)


def test_errors_of_poses_are_proved_where_the_link_turns_fully():
    """There the error of the angle jumps by a turn, at a crank angle far from the pose."""
    double = {"crank": 300.0, "coupler": 280.0, "rocker": 260.0, "ground": 100.0}
    motion = explore.simulate("crank-rocker", double, points={"M": tuple(POINT.values())}, angles=TURNS)
    poses = np.add(motion[["M_x", "M_y", "coupler_angle"]], [1.0, 2.0, 0.5]).to_numpy()
    target = {"kind": "poses", "poses": poses.tolist()}
    _, proof, _ = proofs_of("crank-rocker", double | POINT, ["position_error_max", "pose_error_rms"], target)
    assert (proof.verdict, proof.reason) == ("proved", "")


def test_errors_of_functions_are_proved_also_where_the_crank_does_not_turn():
    """Such a row has numbers, whatever its status says."""
    for crank, code in ((30.0, 1), (90.0, 4)):
        design = {"crank": crank, "coupler": 100.0, "rocker": 80.0, "ground": 110.0}
        design |= {"input_start": 60.0, "output_start": 100.0}
        target = {"kind": "function", "table": PAIRS}
        row, proof, _ = proofs_of("crank-rocker", design, FUNCTIONS, target)
        assert (row["status"], proof.verdict, proof.reason) == (code, "proved", "")
        _, proof, _ = proofs_of("crank-rocker", design, FUNCTIONS, target, change=-1.5)
        assert (proof.verdict, proof.reason.startswith("output_error_rms")) == ("refuted", True)


@pytest.mark.parametrize("crank", [60.0, 400.0])
def test_errors_of_functions_are_proved_to_be_undefined_where_no_linkage_assembles(crank):
    """At one pair, where the crank is blocked, and at all."""
    lengths = {"r1": crank, "r2": 100.0, "r3": 80.0, "r4": 200.0}
    named, point = dict(zip(LENGTHS, lengths.values(), strict=True)), {"along": 0.0, "across": 0.0}
    target = {"kind": "function", "table": [[0, 0], [10, 4], [110, 7]]}
    for source, design in (("crank-rocker", named), (explore.Linkage(COUPLER), lengths | point)):
        row, proof, _ = proofs_of(source, design | {"input_start": 10.0, "output_start": 100.0}, FUNCTIONS, target)
        assert np.isnan(row["output_error_rms"])
        assert (proof.verdict, proof.reason) == ("proved", "")


def test_an_error_of_a_function_beside_a_dead_point_is_not_refuted():
    """A pair is missed by a rounding, which the program does not tell."""
    lengths = {"crank": 30.0, "coupler": 34.6147439960248, "rocker": 15.385256003975199, "ground": 40.0}
    target = {"kind": "function", "table": [[0, 0], [-10, 4], [-30, 7]]}
    row, proof, _ = proofs_of("crank-rocker", lengths | {"input_start": 90.0, "output_start": 100.0}, FUNCTIONS, target)
    assert np.isnan(row["output_error_rms"]) or proof.verdict == "open"


def test_targets_of_tables_are_proved():
    names = {"r1": 100.0, "r2": 400.0, "r3": 350.0, "r4": 420.0}
    table = explore.Linkage(COUPLER)
    path = {"kind": "path", "point": "M", "points": traced(TURNS, 0.5), "closed": True}
    _, proof, _ = proofs_of(table, names | {"along": 200.0, "across": 120.0}, PATHS, path)
    assert (proof.verdict, proof.reason) == ("proved", "")
    function = {"kind": "function", "table": PAIRS}
    starts = {"input_start": 60.0, "output_start": 100.0, "along": 0.0, "across": 0.0}
    _, proof, _ = proofs_of(table, names | starts, FUNCTIONS, function)
    assert (proof.verdict, proof.reason) == ("proved", "")
