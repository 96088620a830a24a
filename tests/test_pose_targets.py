"""Poses as targets: errors of place and angle at the best crank angles."""

from pathlib import Path

import mpmath
import numpy as np
import pytest
from synthesis_cases import least_ordered
from target_studies import POSES

import explore
from explore.base.errors import RequestError
from explore.mechanisms.registry import MECHANISMS
from explore.mechanisms.targets.pose_errors.metrics import measure_posed
from explore.model.targets import FunctionTarget, PathTarget, PosesTarget, target_from_content
from explore.studies.request.names import find_mechanism
from explore.studies.request.targets import read_poses
from explore.synthesis.functions import wrapped

METRICS = ["position_error_max", "angle_error_max", "pose_error_rms", "pose_crank_span"]
LENGTHS = {"crank": 30, "coupler": 100, "rocker": 80, "ground": 110}
DOUBLE_CRANK = {"crank": 110, "coupler": 100, "rocker": 90, "ground": 30}
NAMES = ("crank", "coupler", "rocker", "ground", "branch", "M_along", "M_across", "crank_pivot_x", "crank_pivot_y",
         "ground_angle", "body_angle")  # fmt: skip


def errors(design, poses, mechanism="crank-rocker", **target):
    metrics = METRICS if target.get("order") != "any" else METRICS[:3]
    target = {"kind": "poses", "poses": poses} | target
    return explore.evaluate(mechanism, design, points="M", target=target, metrics=metrics)[metrics].to_numpy()


@pytest.mark.parametrize("step", [1, -1])
@pytest.mark.parametrize("lengths", [LENGTHS, DOUBLE_CRANK])
@pytest.mark.parametrize("branch", [1, -1])
def test_poses_of_the_motion_itself_are_met(lengths, branch, step):
    """In either sense, with the body turned from the coupler, anywhere in the plane."""
    angles = np.arange(20, 300, 31.0)[::step]
    motion = explore.simulate("crank-rocker", lengths | {"branch": branch}, points={"M": (40, 25)}, angles=angles)
    x, y, turned = (motion[name].to_numpy() for name in ("M_x", "M_y", "coupler_angle"))
    angle, cosine, sine = 37.0, np.cos(np.radians(37.0)), np.sin(np.radians(37.0))
    poses = np.column_stack([5 + cosine * x - sine * y, -9 + sine * x + cosine * y, turned + 37.0 + 70.0 + 360.0])
    design = lengths | {"branch": branch, "M_along": 40, "M_across": 25}
    design |= {"crank_pivot_x": 5, "crank_pivot_y": -9, "ground_angle": angle, "body_angle": 70}
    found = errors(design, poses.tolist())[0]
    # roundings of numbers up to 150, of the exact motion and of its poses
    assert found[:3] == pytest.approx(0.0, abs=2e-12)
    assert found[3] == pytest.approx(279.0, abs=1e-6)
    shuffled = poses[[0, 5, 2, 7, 1, 3, 9, 8, 4, 6]].tolist()
    assert errors(design, shuffled, order="any")[0] == pytest.approx(0.0, abs=2e-12)
    assert errors(design, shuffled)[0][0] > 1.0


def test_poses_of_the_rod_of_a_slider_crank():
    lengths = {"crank": 30, "rod": 100, "offset": 8}
    motion = explore.simulate("slider-crank", lengths, points={"M": (40, 25)}, angles=np.arange(20, 300, 31.0))
    poses = motion[["M_x", "M_y", "rod_angle"]].to_numpy().tolist()
    design = lengths | {"M_along": 40, "M_across": 25}
    assert errors(design, poses, "slider-crank")[0][:3] == pytest.approx(0.0, abs=2e-12)


def random_designs(count, seed):
    rng = np.random.default_rng(seed)
    designs = np.column_stack([
        np.full(count, 18.0), rng.uniform(30, 60, count), rng.uniform(50, 60, count), rng.uniform(45, 62, count),
        rng.choice([1, -1], count), rng.normal(0, 25, (count, 4)), rng.uniform(0, 360, (count, 2)),
    ])  # fmt: skip
    return dict(zip(NAMES, designs.T, strict=True))


def motion_of(design, angles):
    """Places and angles of the body, rad, by the triangle of diagonal, coupler and rocker."""
    crank, coupler, rocker, ground, branch, along, across, x, y, frame, body = design
    pin = crank * np.exp(1j * angles)
    diagonal = ground - pin
    square = np.abs(diagonal) ** 2
    share = 0.5 * (square + (coupler - rocker) * (coupler + rocker)) / square
    unit = diagonal * (share + 1j * branch * np.sqrt(coupler**2 / square - share**2)) / coupler
    place = x + 1j * y + np.exp(1j * np.radians(frame)) * (pin + (along + 1j * across) * unit)
    return place, np.angle(unit) + np.radians(frame + body)


def squares_of(design, poses, lever, angles):
    place, turned = motion_of(design, angles)
    gaps = np.abs(place - (poses[:, 0] + 1j * poses[:, 1])[:, None]) ** 2
    return gaps + (lever * wrapped(turned - np.radians(poses[:, 2])[:, None])) ** 2


def test_the_angles_are_the_best_of_all():
    """Random linkages far off random poses: no order of many samples has a smaller sum."""
    designs = random_designs(60, 5)
    poses = np.array(POSES) * [3.0, 3.0, 4.0]
    for order, least_of in (("given", least_ordered), ("any", lambda squares: squares.min(axis=1).sum())):
        table = errors(designs, poses.tolist(), lever=20, order=order)
        rows = np.flatnonzero(np.isfinite(table[:, 0]))
        assert len(rows) > 20
        found, least = [], []
        for row in rows:
            design = [column[row] for column in designs.values()]
            squares = squares_of(design, poses, 20.0, np.arange(720) * np.radians(0.5))
            least.append(least_of(squares))
            found.append(table[row, 2] ** 2 * len(poses))
        # chords decide between orders that are nearly as good
        assert (np.array(found) <= np.array(least) * 1.001).all()
        assert np.mean(np.array(found) <= np.array(least) * (1.0 + 1e-9)) > 0.9


def test_errors_are_those_of_the_motion_at_the_angles():
    designs = random_designs(60, 6)
    poses = np.array(POSES) * [3.0, 3.0, 4.0]
    for order in ("given", "any"):
        table = errors(designs, poses.tolist(), order=order)
        target = PosesTarget("M", tuple(map(tuple, poses.tolist())), order=order)
        own, pose = list(designs.values())[:7], list(designs.values())[7:]
        motion = MECHANISMS["crank-rocker"].targets["poses"].formulas.motion_of("M")
        angles = measure_posed(motion, target, (*own, table[:, 0], *pose))[1]
        lever = np.abs(poses[:, :2] - poses[:, :2].mean(axis=0)) @ [1, 1j]
        for row in np.flatnonzero(np.isfinite(table[:, 0])):
            place, turned = motion_of([column[row] for column in designs.values()], angles[row])
            gaps = np.abs(place - (poses[:, 0] + 1j * poses[:, 1]))
            missed = np.abs(wrapped(turned - np.radians(poses[:, 2])))
            total = np.sqrt(np.mean(gaps**2 + (np.abs(lever).max() * missed) ** 2))
            assert table[row, :3] == pytest.approx([gaps.max(), np.degrees(missed.max()), total], rel=1e-12)
            steps = np.diff(angles[row])
            if order == "given":
                assert (steps >= 0).all() or (steps <= 0).all()
                assert np.degrees(np.ptp(angles[row])) == pytest.approx(table[row, 3], rel=1e-12)
                assert table[row, 3] <= 360 * (1 + 1e-15)


def test_errors_scale_with_the_linkage_and_move_with_it():
    rng = np.random.default_rng(3)
    poses = np.column_stack([rng.normal(0, 30, (8, 2)), rng.uniform(0, 90, 8)])
    design = LENGTHS | {"M_along": 40, "M_across": 25, "body_angle": 12}
    plain = errors(design, poses.tolist())
    scaled = {name: value * (1 if name == "body_angle" else 2.5) for name, value in design.items()}
    bigger = errors(scaled, (poses * [2.5, 2.5, 1]).tolist())
    np.testing.assert_allclose(bigger, plain * [[2.5, 1, 2.5, 1]], rtol=1e-9)
    cosine, sine = np.cos(0.7), np.sin(0.7)
    places = poses[:, :2] @ np.array([[cosine, sine], [-sine, cosine]]) + [4, -9]
    moved = design | {"crank_pivot_x": 4, "crank_pivot_y": -9, "ground_angle": np.degrees(0.7)}
    turned = np.column_stack([places, poses[:, 2] + np.degrees(0.7)])
    # angles of pooled poses are where a sum is flat: its error is the square of theirs
    np.testing.assert_allclose(errors(moved, turned.tolist()), plain, rtol=1e-7)
    np.testing.assert_allclose(errors(design, poses[::-1].tolist()), plain, rtol=1e-7)


def test_designs_whose_crank_does_not_turn_have_no_error():
    design = {"crank": 50, "coupler": 100, "rocker": 100, "ground": 260, "M_along": 1, "M_across": 2}
    assert np.isnan(errors(design, POSES)).all()


@pytest.mark.parametrize(
    "target",
    [
        PosesTarget("M", ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)), lever=20.0, order="any"),
        PathTarget("M", ((1.0, 2.0), (3.0, 4.0), (5.0, 7.0)), True, (1.0, 2.0, 3.0), (10.0, 20.0, 30.0), "frame"),
        FunctionTarget(((0.0, 1.0), (2.0, 3.0))),
    ],
)
def test_the_content_of_a_target_has_all_of_it(target):
    """It is part of a study's identity."""
    assert target_from_content(target.to_content()) == target


def test_places_and_angles_may_have_units():
    entries = {"poses": [["1 cm", 2, "1 rad"], [3, "4 mm", "20 deg"], [5, 6, 30]]}
    assert read_poses(entries, Path(), []) == ((10.0, 2.0, np.degrees(1.0)), (3.0, 4.0, 20.0), (5.0, 6.0, 30.0))


def test_a_lever_makes_poses_at_one_place_a_target():
    find_mechanism("crank-rocker", ("M",), {"kind": "poses", "poses": [[1, 2, 3], [1, 2, 9]], "lever": "2 cm"})
    with pytest.raises(RequestError, match="has no point to follow it"):
        find_mechanism("crank-rocker", (), {"kind": "poses", "poses": POSES})


def test_the_error_of_poses_that_are_met_bounds_their_rounding():
    """It is relative to the size of the coordinates, not to what is left of them."""
    designs = {name: values[:1] for name, values in random_designs(1, 6).items()}
    first = [float(column[0]) for column in designs.values()]
    places, turned = motion_of(first, np.radians([20.0, 75.0, 140.0, 260.0]))
    poses = np.column_stack([places.real, places.imag, np.degrees(turned)])
    frame = explore.evaluate(
        "crank-rocker", designs, target={"kind": "poses", "poses": poses.tolist()}, points=["M"],
        metrics=["position_error_max", "angle_error_max", "pose_error_rms"],
    )  # fmt: skip
    met, size = frame.iloc[0], np.abs(places).max()
    assert met["status"] == 1
    assert met["error"] < 1e-12
    assert max(met["position_error_max"], met["pose_error_rms"]) < met["error"] * size
    assert met["angle_error_max"] < met["error"] * np.degrees(1.0)


def exact_body(angle):
    """Place and angle of a body in the numbers of mpmath; see `motion_of`."""
    pin = 100 * mpmath.expj(angle)
    diagonal = 420 - pin
    length = abs(diagonal)
    turned = mpmath.arg(diagonal) + mpmath.acos((mpmath.mpf(400) ** 2 + length**2 - 350**2) / (800 * length))
    return pin + mpmath.expj(turned) * mpmath.mpc(200, 120), turned


def exact_errors(pose, start, lever):
    """Distance and error of the angle at the crank angle near a start where both together are least, and this angle."""
    x, y, angle = map(mpmath.mpf, pose)

    def gaps(crank):
        place, turned = exact_body(crank)
        return abs(place - mpmath.mpc(x, y)), turned - mpmath.radians(angle)

    def slope(crank):
        return mpmath.diff(lambda at: gaps(at)[0] ** 2 + (lever * gaps(at)[1]) ** 2, crank)

    crank = mpmath.findroot(slope, start, tol=1e-20)
    return *gaps(crank), crank


@pytest.mark.parametrize("noise", [0.01, 0.3, 8.0])
def test_largest_errors_of_poses_have_the_digits_that_the_error_says(noise):
    """They are not stationary at the best crank angle, so that this is needed to its last digit.

    Each is asked for alone: the row has the largest bound.
    """
    rng, angles = np.random.default_rng(5), np.radians([20.0, 100.0, 190.0, 260.0])
    with mpmath.workdps(30):
        bodies = [exact_body(angle) for angle in angles]
        poses = np.array([[place.real, place.imag, mpmath.degrees(turned)] for place, turned in bodies], dtype=float)
        poses += noise * rng.standard_normal(poses.shape)
        gaps, turns, cranks = zip(*map(exact_errors, poses, angles, [150.0] * 4), strict=True)
        truth = [max(gaps), mpmath.degrees(max(map(abs, turns))), mpmath.degrees(cranks[-1] - cranks[0])]
    design = {"crank": 100, "coupler": 400, "rocker": 350, "ground": 420, "M_along": 200, "M_across": 120}
    target = {"kind": "poses", "poses": poses.tolist(), "lever": 150}
    names = ("position_error_max", "angle_error_max", "pose_crank_span")
    for name, true, scale in zip(names, truth, (500.0, np.degrees(1.0), 360.0), strict=True):
        met = explore.evaluate("crank-rocker", design, points=["M"], target=target, metrics=[name]).iloc[0]
        assert met["error"] < 1e-12
        assert abs(met[name] - float(true)) <= met["error"] * scale, name


@pytest.mark.parametrize("count", [4, 20])
def test_links_that_turn_fast_meet_poses_as_well_as_they_can(count):
    """Beside change points, and where poses hold each other up: many samples have no smaller sum in any order."""
    rng = np.random.default_rng(count)
    lengths = np.exp(rng.uniform(3.0, 5.3, (60, 3)))
    lengths.sort(axis=1)
    crank = (lengths[:, 0] + lengths[:, 1] - lengths[:, 2]) * (1.0 - 10.0 ** rng.uniform(-6, -2, 60))
    turns = (crank > 0.0) & (crank < lengths[:, 0])
    others = rng.permuted(lengths[turns], axis=1)
    n = len(others)
    designs = np.column_stack([
        crank[turns], others, rng.choice([1, -1], n), others[:, 0] * rng.uniform(-1, 2, n),
        others[:, 0] * rng.uniform(-1, 1, n), rng.uniform(-20, 20, (n, 2)), rng.uniform(0, 360, (n, 2)),
    ])  # fmt: skip
    poses = np.column_stack([rng.uniform(-100, 200, (count, 2)), rng.uniform(-180, 540, count)])
    table = errors(dict(zip(NAMES, designs.T, strict=True)), poses.tolist(), lever=80)
    assert np.isfinite(table).all()
    angles = np.arange(360) * np.radians(1.0)
    least = [np.sqrt(least_ordered(squares_of(design, poses, 80.0, angles)) / count) for design in designs]
    assert (table[:, 2] <= np.array(least) * 1.0005).all()
