"""The contract of methods: the same assertions for every method on the same linkages.

A new method needs a line in the registry and one in `BOUNDS`.
"""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from exact_linkage import ExactLinkage
from loop_cases import FOUR_BAR, four_bars, largest_gap

from explore.base.errors import RequestError
from explore.comparison.methods import dyads
from explore.comparison.methods.closed_form import geometric_outcome, solve_screened
from explore.comparison.methods.contract import Capability, Level, Motion, Outcome, Task, method_label
from explore.comparison.methods.elimination import solve
from explore.comparison.methods.registry import METHODS, check_method, methods_for
from explore.comparison.scenes import bundled_scenes, load_scene

#: Marks that skip the methods whose package is not installed.
SKIPS = {
    "pylinkage": pytest.mark.skipif(
        not dyads.is_pylinkage_installed(), reason="pylinkage is not installed: extra peers"
    )
}
#: One setting of each method, the finest: they differ in a tolerance or a number of steps.
EACH = [
    pytest.param(methods[-1], id=method_label(methods[-1]), marks=SKIPS.get(methods[-1].name, ()))
    for methods in METHODS.values()
    if methods
]
#: One of each kind: independent angles, iterations in both languages, fixed and adaptive steps, the solver of a peer.
KINDS = [case for case in EACH if case.values[0].name in
         ("closed-form", "textbook", "newton", "newton-compiled", "fsolve", "rk4-projected", "dop853")]  # fmt: skip
#: Crank, coupler, rocker, ground of benign crank-rockers.
BENIGN = np.array([
    [100.0, 1083.4236, 541.7118, 691.7118],
    [50.0, 940.62, 211.79, 869.44],
    [1.0, 3.0, 3.5, 4.0],
    [20.0, 50.0, 45.0, 40.0],
])  # fmt: skip
#: Lengths without a full turn, and their geometric outcome.
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
#: Largest error in angle (rad), velocity (1) and acceleration (1/rad) on the benign linkages, by label.
BOUNDS = {
    # Rounding of a few operations on numbers of size 1.
    "closed-form": (2e-15, 5e-15, 5e-14),
    # The same, and one cancelling sum under arccos, which is small far from the change point.
    "textbook": (2e-15, 5e-15, 1e-14),
    # The same without arccos; the differences that cancel under the root are not small here.
    "circles": (2e-15, 5e-15, 1e-14),
    # Tolerance times longest link over the shorter one and the sine of the transmission angle; velocities of size 1.
    **dict.fromkeys(
        ("newton(tolerance=1e-12)", "newton-unchecked(tolerance=1e-12)", "newton-compiled(tolerance=1e-12)"),
        (4e-12, 4e-12, 3e-12),
    ),
    # Rounding, accumulated over 73 steps of the crank.
    "pylinkage": (1.5e-14, 2e-14, 8e-14),
    # The tolerance bounds the last change of the angles; convergence is superlinear, so the error is smaller.
    "fsolve(tolerance=1e-10)": (1.3e-12, 5e-13, 5e-13),
    # Fourth order in the step, velocities as accurate as angles: two to three times the measured errors.
    "rk4(steps=1440)": (1.3e-11, 1.3e-11, 2e-11),
    # rtol bounds the error of a step; a turn accumulates up to 30 rtol. Two to three times the measured errors.
    "rk45(rtol=1e-12)": (5e-11, 1.3e-11, 6e-11),
    "dop853(rtol=1e-12)": (1.3e-11, 8e-12, 1.3e-11),
    "radau(rtol=1e-09)": (1e-9, 6e-10, 2e-9),
    # After Newton's corrections only the rounding of the textbook's sums remains, at any step size.
    **dict.fromkeys(
        ("rk4-projected(steps=360)", "rk45-projected(rtol=1e-06)", "dop853-projected(rtol=1e-06)",
         "radau-projected(rtol=0.001)"), (3e-15, 3e-15, 1e-14)
    ),
}  # fmt: skip


def turn(lengths, branch=1.0, count=73, level=Level.ACCELERATIONS, first=np.pi / 2):
    """A task of a full turn, `count` crank angles from `first` on."""
    lengths = np.atleast_2d(np.asarray(lengths, dtype=float))
    angles = np.tile(first + np.linspace(0.0, 2.0 * np.pi, count), (len(lengths), 1))
    return four_bars(lengths, float(branch), angles, level)


def exact(task):
    """The motion by mpmath with 60 digits, from Freudenstein's equation, shape (6, n, t)."""
    motion = np.empty((6, *task.crank_angle.shape))
    for i, (*lengths, branch) in enumerate(task.parameters):
        linkage = ExactLinkage(*lengths, branch=int(branch))
        for j, angle in enumerate(task.crank_angle[i]):
            theta = mpmath.mpf(angle)
            motion[:, i, j] = [float(x) for x in (*linkage.angles(theta), *linkage.motion(theta))]
    return motion


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


def test_every_method_has_an_error_bound():
    assert set(BOUNDS) == {method_label(methods[-1]) for methods in METHODS.values() if methods}


@pytest.mark.parametrize("method", EACH)
def test_errors_on_benign_linkages_are_within_their_bounds(method, benign):
    task, reference = benign
    motion = solve_screened(method, task)
    assert [Outcome(o).label for o in motion.outcome] == ["ok"] * len(task)
    errors = differences(motion, reference)
    assert all(error <= bound for error, bound in zip(errors, BOUNDS[method_label(method)], strict=True)), errors


@pytest.mark.parametrize("method", KINDS)
@pytest.mark.parametrize("level", [Level.POSITIONS, Level.VELOCITIES, Level.ACCELERATIONS])
def test_a_lower_level_gives_the_same_signals(method, level):
    full, lower = solve_screened(method, turn(BENIGN)), solve_screened(method, turn(BENIGN, level=level))
    assert lower.signals.shape == (2 * level, len(BENIGN), 73)
    # compiled code may order sums differently at another level
    assert np.allclose(lower.signals, full.signals[: 2 * level], rtol=0, atol=5e-15)


@pytest.mark.parametrize("method", KINDS)
def test_a_double_crank_is_solved_too(method):
    task = turn([4.0, 5.0, 4.5, 2.0])
    motion, closed = solve_screened(method, task), METHODS["closed-form"][0].solve(task)
    assert motion.outcome.tolist() == [Outcome.OK]
    assert largest_gap(task, closed.signals).max() < 1e-14
    assert largest_gap(task, motion.signals).max() < 20.0 * max(BOUNDS[method_label(method)])


@pytest.mark.parametrize("method", EACH)
def test_every_method_reports_the_geometric_outcome(method):
    lengths = np.array(list(IMPOSSIBLE))
    motion = solve_screened(method, turn(lengths))
    assert motion.outcome.tolist() == list(IMPOSSIBLE.values())
    assert np.isnan(motion.signals).all()
    assert motion.evaluations.sum() == 0


@pytest.mark.parametrize("method", KINDS)
@pytest.mark.parametrize("name", list(bundled_scenes()))
def test_on_every_scene_ok_means_a_closed_loop(method, name):
    """No method reports ok where no motion exists; where it reports ok, the gap in its loop is small."""
    scene = load_scene(bundled_scenes()[name])
    designs = scene.designs
    if method not in [other for settings in methods_for(designs.loop).values() for other in settings]:
        with pytest.raises(RequestError, match="solves one loop with two unknown"):
            check_method(method, designs.loop)
        return
    possible = geometric_outcome(designs.task(np.zeros((len(designs), 1)))) == Outcome.OK
    rows = np.concatenate([np.flatnonzero(possible)[:3], np.flatnonzero(~possible)[:1]])
    angles = np.tile(np.pi / 2 + np.linspace(0.0, 2.0 * np.pi, 25), (len(rows), 1))
    task = designs.part(rows).task(angles, Level.VELOCITIES)
    motion = solve_screened(method, task)
    ok = motion.outcome == Outcome.OK
    assert not (ok & ~possible[rows]).any()
    gap = largest_gap(task, motion.signals)
    # integrators accept gaps up to a tenth of the longest link, Newton up to its tolerance
    assert (gap[ok] <= 0.1 * task.size[ok, None]).all()


@pytest.mark.parametrize("method", EACH)
def test_a_method_without_screening_never_raises(method):
    """Linkages that cannot turn give an outcome, not an exception or a warning."""
    motion = method.solve(turn(np.array(list(IMPOSSIBLE)), count=13))
    assert isinstance(motion, Motion)
    ok = motion.outcome == Outcome.OK
    assert np.isfinite(motion.signals[:, ok]).all(), "NaN reported as OK"


@pytest.mark.parametrize("method", KINDS)
def test_a_linkage_without_motion_does_not_change_the_others(method):
    mixed = np.vstack([BENIGN[:2], [list(k) for k in list(IMPOSSIBLE)[:4]], BENIGN[2:]])
    motion, alone = solve_screened(method, turn(mixed)), solve_screened(method, turn(BENIGN))
    has_motion = geometric_outcome(turn(mixed)) == Outcome.OK
    assert np.array_equal(motion.signals[:, has_motion], alone.signals)
    assert np.array_equal(motion.outcome[has_motion], alone.outcome)
    assert np.array_equal(motion.evaluations[has_motion], alone.evaluations)
    assert np.array_equal(motion.iterations[has_motion], alone.iterations)


@pytest.mark.parametrize("method", KINDS)
def test_evaluations_are_counted(method):
    motion = solve_screened(method, turn(BENIGN))
    iterates = Capability.ANY_ANGLE not in method.capabilities
    assert (motion.evaluations >= (1 if iterates else 73)).all()
    assert motion.evaluations.dtype == motion.iterations.dtype == np.int64
    assert motion.outcome.dtype == np.int8


@pytest.mark.parametrize("method", [p for p in EACH if Capability.ANY_ANGLE in p.values[0].capabilities])
def test_the_order_of_angles_does_not_matter_to_independent_methods(method):
    task = turn(BENIGN)
    reversed_task = replace(task, crank_angle=task.crank_angle[:, ::-1].copy())
    assert np.array_equal(
        solve_screened(method, task).signals, solve_screened(method, reversed_task).signals[:, :, ::-1]
    )


@pytest.mark.parametrize("method", KINDS)
def test_the_layout_of_the_arrays_in_memory_does_not_matter(method):
    task = turn(BENIGN, count=13)
    column_major = Task(FOUR_BAR, np.asfortranarray(task.parameters), np.asfortranarray(task.crank_angle))
    assert np.array_equal(method.solve(task).signals, method.solve(column_major).signals)


def test_shapes_are_checked():
    with pytest.raises(ValueError, match="a task needs parameters"):
        Task(FOUR_BAR, np.ones((1, 5)), np.ones((2, 3)))
    with pytest.raises(ValueError, match="no method solves the level geometry"):
        Task(FOUR_BAR, np.ones((2, 5)), np.ones((2, 3)), Level.GEOMETRY)


def test_derivatives_of_the_loop_agree_with_finite_differences():
    """Velocities and accelerations of the loop against central differences of exact angles, 60 digits."""
    mpmath.mp.dps = 60
    lengths, theta, step = BENIGN[0], mpmath.mpf("1.234"), mpmath.mpf(10) ** -15
    linkage = ExactLinkage(*lengths)
    below, here, above = (linkage.angles(theta + k * step) for k in (-1, 0, 1))
    first = [float((a - b) / (2 * step)) for a, b in zip(above, below, strict=True)]
    second = [float((a - 2 * m + b) / step**2) for a, m, b in zip(above, here, below, strict=True)]
    angles = [float(x) for x in here]
    signals, task = np.empty((6, 1, 1)), four_bars(lengths[None], 1.0, np.array([[1.234]]))
    FOUR_BAR.fill_signals(signals, task.upright, task.crank_angle, np.array(angles)[:, None, None])
    assert signals[2:4, 0, 0] == pytest.approx(first, rel=1e-14)
    assert signals[4:, 0, 0] == pytest.approx(second, rel=1e-13)
    assert largest_gap(task, signals).max() < 5e-13  # rounding of 1083


def test_newtons_step_solves_the_linear_system():
    lengths, angles = BENIGN[0], (0.3, 0.9)
    about = FOUR_BAR.about(FOUR_BAR.columns([*lengths, 1.0]), 1.234, angles)
    step, determinant = solve(about.columns, about.gap)
    _, r2, r3, _ = lengths
    jacobian = np.array([
        [-r2 * np.sin(0.3), r3 * np.sin(0.9)],
        [r2 * np.cos(0.3), -r3 * np.cos(0.9)],
    ])  # fmt: skip
    gap = [about.gap[0].real, about.gap[0].imag]
    assert step == pytest.approx(np.linalg.solve(jacobian, gap), rel=1e-12)
    assert determinant == pytest.approx(np.linalg.det(jacobian), rel=1e-12)
