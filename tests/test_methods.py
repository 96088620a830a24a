"""Contract of all methods of solving the motion: one list of methods, one list of linkages, the same questions to each.

A new method joins by its line in the registry and one in `BOUNDS`.
"""

import mpmath
import numpy as np
import pytest
from exact_linkage import ExactLinkage

from explore.comparison.scenes import bundled_scenes, load_scene
from explore.methods import dyads, loop
from explore.methods.contract import Capability, Level, Motion, Outcome, Task, label
from explore.methods.driver import solve
from explore.methods.geometry import geometric_outcome
from explore.methods.registry import METHODS

#: Methods that another package makes possible.
NEEDS = {"pylinkage": pytest.mark.skipif(not dyads.available(), reason="pylinkage is not installed: extra peers")}
ALL = [
    pytest.param(method, id=label(method), marks=NEEDS.get(method.name, ()))
    for methods in METHODS.values()
    for method in methods
]
#: Crank, coupler, rocker, ground of benign crank-rockers.
BENIGN = np.array([
    [100.0, 1083.4236, 541.7118, 691.7118],
    [50.0, 940.62, 211.79, 869.44],
    [1.0, 3.0, 3.5, 4.0],
    [20.0, 50.0, 45.0, 40.0],
])  # fmt: skip
#: Lengths that cannot make the turn, and what the geometry says of them.
IMPOSSIBLE = {
    (150.0, 1083.4236, 541.7118, 691.7118): Outcome.CHANGE_POINT,
    (200.0, 1083.4236, 541.7118, 691.7118): Outcome.CRANK_BLOCKED,
    (150.0 + 2.0**-30, 1083.5, 541.75, 691.75): Outcome.CRANK_BLOCKED,
    (100.0, 2000.0, 541.7118, 691.7118): Outcome.CANNOT_ASSEMBLE,
    (1.0, 1.0, 1.0, 4.0): Outcome.CANNOT_ASSEMBLE,
    (5.0, 3.0, 4.0, 3.5): Outcome.CRANK_BLOCKED,
    (1.0, 1.0, 1.0, 1.0): Outcome.CHANGE_POINT,
    (np.nan, 1.0, 1.0, 1.0): Outcome.NOT_FINITE,
    (0.0, 1.0, 1.0, 1.0): Outcome.NOT_FINITE,
    (1.0, np.inf, 1.0, 1.0): Outcome.NOT_FINITE,
}
#: Largest error in angle (rad), velocity and acceleration (1, 1/rad) on the benign linkages, by label.
BOUNDS = {
    # Rounding of a few operations on numbers of size 1.
    "closed-form": (2e-15, 5e-15, 5e-14),
    # The same, and one cancelling sum under arccos, harmless far from the change point.
    "textbook": (2e-15, 5e-15, 1e-14),
    # Tolerance times longest link over the shorter one and the sine of the transmission angle; velocities of size 1.
    **{
        f"{name}(tolerance={tolerance:g})": bound
        for name in ("newton", "newton-unchecked")
        for tolerance, bound in {
            1e-2: (0.1, 0.04, 0.05),
            1e-4: (1e-3, 5e-4, 1e-3),
            1e-8: (1e-7, 5e-8, 8e-8),
            1e-12: (4e-12, 4e-12, 3e-12),
        }.items()
    },
    # Rounding, and 73 steps of the crank added up.
    "pylinkage": (1.5e-14, 2e-14, 8e-14),
    # It stops by the change of the angles; its convergence is faster than linear, so that the error is smaller.
    "fsolve(tolerance=0.0001)": (2e-5, 1e-5, 2e-5),
    "fsolve(tolerance=1e-06)": (1e-7, 7e-8, 1e-7),
    "fsolve(tolerance=1.49012e-08)": (4e-10, 8e-11, 1.5e-10),
    "fsolve(tolerance=1e-10)": (1.3e-12, 5e-13, 5e-13),
    # Fourth order in the step, rates as good as the angles: twice to three times what was measured. The crank angles
    # asked for are 5 deg apart, so 36 steps a turn become 72.
    "rk4(steps=36)": (2e-6, 2e-6, 4e-6),
    "rk4(steps=72)": (2e-6, 2e-6, 4e-6),
    "rk4(steps=180)": (2.5e-8, 2.5e-8, 4e-8),
    "rk4(steps=360)": (3e-9, 3e-9, 5e-9),
    "rk4(steps=1440)": (1.3e-11, 1.3e-11, 2e-11),
    # The solvers keep the error of a step at rtol; a turn gathers up to 30 rtol. Two to three times what was measured.
    "rk45(rtol=0.001)": (4e-2, 1.5e-2, 5e-2),
    "rk45(rtol=1e-06)": (3e-5, 1.5e-5, 3e-5),
    "rk45(rtol=1e-09)": (6e-8, 1.5e-8, 6e-8),
    "rk45(rtol=1e-12)": (5e-11, 1.3e-11, 6e-11),
    "dop853(rtol=0.001)": (2e-3, 1e-3, 2e-3),
    "dop853(rtol=1e-06)": (3e-5, 7e-6, 8e-6),
    "dop853(rtol=1e-09)": (8e-9, 5e-9, 7e-9),
    "dop853(rtol=1e-12)": (1.3e-11, 8e-12, 1.3e-11),
    "radau(rtol=0.001)": (1e-3, 4e-4, 1.3e-3),
    "radau(rtol=1e-06)": (1e-6, 1e-6, 2e-6),
    "radau(rtol=1e-09)": (1e-9, 6e-10, 2e-9),
    # Newton has the last word: rounding of the textbook's sums, at any step.
    "rk4-projected(steps=36)": (3e-15, 3e-15, 1e-14),
    "rk4-projected(steps=360)": (3e-15, 3e-15, 1e-14),
    "rk45-projected(rtol=0.001)": (3e-15, 3e-15, 1e-14),
    "rk45-projected(rtol=1e-06)": (3e-15, 3e-15, 1e-14),
    "dop853-projected(rtol=0.001)": (3e-15, 3e-15, 1e-14),
    "dop853-projected(rtol=1e-06)": (3e-15, 3e-15, 1e-14),
    "radau-projected(rtol=0.001)": (3e-15, 3e-15, 1e-14),
}


def turn(lengths, branch=1.0, count=73, level=Level.ACCELERATIONS, first=np.pi / 2):
    """A full turn from a crank angle on."""
    lengths = np.atleast_2d(np.asarray(lengths, dtype=float))
    angles = np.tile(first + np.linspace(0.0, 2.0 * np.pi, count), (len(lengths), 1))
    return Task(lengths, np.broadcast_to(float(branch), len(lengths)), angles, level)


def exact(task):
    """The motion by mpmath with 60 digits, from Freudenstein's equation, shape (6, n, t)."""
    found = np.empty((6, *task.crank_angle.shape))
    for i, (lengths, branch) in enumerate(zip(task.lengths, task.branch, strict=True)):
        linkage = ExactLinkage(*lengths, branch=int(branch))
        for j, angle in enumerate(task.crank_angle[i]):
            theta = mpmath.mpf(angle)
            found[:, i, j] = [float(x) for x in (*linkage.angles(theta), *linkage.motion(theta))]
    return found


def differences(motion, reference):
    """Largest errors of angles, velocities and accelerations; angles modulo a turn."""
    difference = motion.signals - reference[: len(motion.signals)]
    difference[:2] = np.remainder(difference[:2] + np.pi, 2.0 * np.pi) - np.pi
    return [np.abs(difference[2 * k : 2 * k + 2]).max() for k in range(len(motion.signals) // 2)]


@pytest.fixture(scope="module", params=[1.0, -1.0])
def benign(request):
    """A task and its exact solution."""
    task = turn(BENIGN, request.param)
    return task, exact(task)


def test_every_setting_has_its_bound():
    assert set(BOUNDS) == {label(method) for methods in METHODS.values() for method in methods}


@pytest.mark.parametrize("method", ALL)
def test_benign_linkages_are_solved_as_well_as_stated(method, benign):
    task, reference = benign
    motion = solve(method, task)
    assert [Outcome(o).label for o in motion.outcome] == ["ok"] * len(task)
    errors = differences(motion, reference)
    assert all(error <= bound for error, bound in zip(errors, BOUNDS[label(method)], strict=True)), errors


@pytest.mark.parametrize("method", ALL)
@pytest.mark.parametrize("level", [Level.POSITIONS, Level.VELOCITIES, Level.ACCELERATIONS])
def test_a_lower_level_gives_the_same_and_no_more(method, level):
    full, part = solve(method, turn(BENIGN)), solve(method, turn(BENIGN, level=level))
    assert part.signals.shape == (2 * level, len(BENIGN), 73)
    # compiled code may order sums differently at another level
    assert np.allclose(part.signals, full.signals[: 2 * level], rtol=0, atol=5e-15)


@pytest.mark.parametrize("method", ALL)
def test_a_double_crank_is_solved_too(method):
    task = turn([4.0, 5.0, 4.5, 2.0])
    motion, closed = solve(method, task), METHODS["closed-form"][0].solve(task)
    assert motion.outcome.tolist() == [Outcome.OK]
    assert np.abs(loop.residual(task.lengths.T[:, :, None], task.crank_angle, *closed.signals[:2])).max() < 1e-14
    assert np.abs(loop.residual(task.lengths.T[:, :, None], task.crank_angle, *motion.signals[:2])).max() < (
        20.0 * max(BOUNDS[label(method)])
    )


@pytest.mark.parametrize("method", ALL)
def test_no_method_says_ok_where_the_linkage_cannot_close(method):
    lengths = np.array(list(IMPOSSIBLE))
    motion = solve(method, turn(lengths))
    assert motion.outcome.tolist() == list(IMPOSSIBLE.values())
    assert np.isnan(motion.signals).all()
    assert motion.evaluations.sum() == 0


@pytest.mark.parametrize("method", ALL)
@pytest.mark.parametrize("name", list(bundled_scenes()))
def test_on_every_scene_ok_means_a_motion_that_closes(method, name):
    """Where the geometry says that there is none the outcome says so too; where a method says ok, its links meet."""
    scene = load_scene(bundled_scenes()[name])
    possible = geometric_outcome(scene.lengths) == Outcome.OK
    few = np.concatenate([np.flatnonzero(possible)[:3], np.flatnonzero(~possible)[:1]])
    lengths, branch = scene.lengths[few], scene.branch[few]
    task = Task(lengths, branch, turn(lengths, count=25).crank_angle, Level.VELOCITIES)
    motion = solve(method, task)
    ok = motion.outcome == Outcome.OK
    assert not (ok & ~possible[few]).any()
    gap = np.linalg.norm(loop.residual(lengths.T[:, :, None], task.crank_angle, *motion.signals[:2]), axis=0)
    # an integrator refuses gaps of a tenth of the longest link, Newton those beyond its tolerance
    assert (gap[ok] <= 0.1 * lengths[ok].max(axis=1, keepdims=True)).all()


@pytest.mark.parametrize("method", ALL)
def test_a_method_alone_never_raises(method):
    """Whatever it says of linkages that cannot turn, it says it as an outcome, warnings being errors here."""
    motion = method.solve(turn(np.array(list(IMPOSSIBLE)), count=13))
    assert isinstance(motion, Motion)
    ok = motion.outcome == Outcome.OK
    assert np.isfinite(motion.signals[:, ok]).all(), "a silent NaN"


@pytest.mark.parametrize("method", ALL)
def test_a_bad_member_does_not_change_the_others(method):
    mixed = np.vstack([BENIGN[:2], [list(k) for k in list(IMPOSSIBLE)[:4]], BENIGN[2:]])
    motion, alone = solve(method, turn(mixed)), solve(method, turn(BENIGN))
    good = geometric_outcome(mixed) == Outcome.OK
    assert np.array_equal(motion.signals[:, good], alone.signals)
    assert np.array_equal(motion.outcome[good], alone.outcome)
    assert np.array_equal(motion.evaluations[good], alone.evaluations)
    assert np.array_equal(motion.iterations[good], alone.iterations)


@pytest.mark.parametrize("method", ALL)
def test_work_is_counted(method):
    motion = solve(method, turn(BENIGN))
    iterates = Capability.ANY_ANGLE not in method.capabilities
    assert (motion.evaluations >= (1 if iterates else 73)).all()
    assert motion.evaluations.dtype == motion.iterations.dtype == np.int64
    assert motion.outcome.dtype == np.int8


@pytest.mark.parametrize("method", [p for p in ALL if Capability.ANY_ANGLE in p.values[0].capabilities])
def test_the_order_of_angles_does_not_matter_to_those_that_say_so(method):
    task = turn(BENIGN)
    backwards = Task(task.lengths, task.branch, task.crank_angle[:, ::-1].copy(), task.level)
    assert np.array_equal(solve(method, task).signals, solve(method, backwards).signals[:, :, ::-1])


@pytest.mark.parametrize("method", ALL)
def test_the_layout_of_the_arrays_in_memory_does_not_matter(method):
    task = turn(BENIGN, count=13)
    columns = Task(np.asfortranarray(task.lengths), task.branch, np.asfortranarray(task.crank_angle))
    assert np.array_equal(method.solve(task).signals, method.solve(columns).signals)


def test_shapes_are_checked():
    with pytest.raises(ValueError, match="a task needs lengths"):
        Task(np.ones((2, 4)), np.ones(1), np.ones((2, 3)))
    with pytest.raises(ValueError, match="geometry needs no method"):
        Task(np.ones((2, 4)), np.ones(2), np.ones((2, 3)), Level.GEOMETRY)


def test_the_loop_by_finite_differences():
    """Velocities and accelerations of the loop against central differences of exact angles, 60 digits."""
    mpmath.mp.dps = 60
    lengths, theta, step = BENIGN[0], mpmath.mpf("1.234"), mpmath.mpf(10) ** -15
    linkage = ExactLinkage(*lengths)
    below, here, above = (linkage.angles(theta + k * step) for k in (-1, 0, 1))
    first = [float((a - b) / (2 * step)) for a, b in zip(above, below, strict=True)]
    second = [float((a - 2 * m + b) / step**2) for a, m, b in zip(above, here, below, strict=True)]
    angles = [float(x) for x in here]
    rates = loop.velocities(lengths, 1.234, *angles)
    assert rates == pytest.approx(first, rel=1e-14)
    assert loop.accelerations(lengths, 1.234, *angles, rates) == pytest.approx(second, rel=1e-13)
    assert np.abs(loop.residual(lengths, 1.234, *angles)).max() < 5e-13  # rounding of 1083


def test_newtons_step_solves_the_linear_system():
    lengths, angles = BENIGN[0], (0.3, 0.9)
    gap = loop.residual(lengths, 1.234, *angles)
    _, r2, r3, _ = lengths
    jacobian = np.array([
        [-r2 * np.sin(0.3), r3 * np.sin(0.9)],
        [r2 * np.cos(0.3), -r3 * np.cos(0.9)],
    ])  # fmt: skip
    assert loop.correction(lengths, gap, *angles) == pytest.approx(np.linalg.solve(jacobian, -gap), rel=1e-12)
    assert loop.determinant(lengths, *angles) == pytest.approx(np.linalg.det(jacobian), rel=1e-12)
