"""Methods on the loops with a slider: the slider-crank, and the crank of variable length."""

import re
import warnings

import mpmath
import numpy as np
import pytest
from exact_slider_crank import ExactSliderCrank
from exact_variable_crank import ExactVariableCrank
from loop_cases import SLIDER_CRANK, VARIABLE_CRANK, largest_gap

import explore
from explore.comparison.methods.closed_form import find_sides, geometric_outcome
from explore.comparison.methods.contract import Capability, Level, Outcome, Task, method_label
from explore.comparison.methods.design_equations import DesignEquations
from explore.comparison.methods.elimination import solve
from explore.comparison.methods.fsolve import Fsolve
from explore.comparison.methods.newton import Newton
from explore.comparison.methods.ode import VelocityIntegration
from explore.comparison.methods.registry import METHODS, find_method, methods_for
from explore.comparison.reference import ExactDesign, exact_motion, multiple_precision
from explore.comparison.verdicts import Verdict, judge, signal_errors
from explore.mechanisms.variable_crank.loop import singular_angle

#: Crank, rod, offset; rod, slider's speed, speed, reversal time, blend order.
SLIDERS = np.array([[100.0, 260.0, 30.0], [50.0, 180.0, -40.0], [1.0, 3.0, 0.5]])
SLICERS = np.array([
    [500.0, 800.0, 100.0 * np.pi / 30.0, 0.1, 2.0],
    [500.0, 800.0, 100.0 * np.pi / 30.0, 0.2, 1.0],
    [300.0, 500.0, 8.0, 0.12, 3.0],
])  # fmt: skip
#: Each method at its finest setting, on each loop that it solves.
CASES = [
    pytest.param(loop, settings[-1], id=f"{loop.name}-{method_label(settings[-1])}")
    for loop in (SLIDER_CRANK, VARIABLE_CRANK)
    for settings in methods_for(loop).values()
]
_NEWTON = ("newton(tolerance=1e-12)", "newton-unchecked(tolerance=1e-12)", "newton-compiled(tolerance=1e-12)")
_PROJECTED = ("rk4-projected(steps=360)", "rk45-projected(rtol=1e-06)", "dop853-projected(rtol=1e-06)",
              "radau-projected(rtol=0.001)")  # fmt: skip
#: Largest error of positions (rad, over the longest link), velocities and accelerations (over their peak), by loop and
#: label: two to three times the measured ones, for the reasons of `test_methods.BOUNDS`. The turn of the slider-crank
#: is well conditioned. Of the variable crank it is the arc between the singular angles, up to 14 degrees from one,
#: where the velocity has a thirtieth, the acceleration a two hundredth of the digits' weight in the position.
BOUNDS = {
    "slider-crank": {
        **dict.fromkeys(_NEWTON, (2e-12, 5e-14, 4e-13)),
        **dict.fromkeys(_PROJECTED, (7e-16, 6e-16, 7e-16)),
        "closed-form": (7e-16, 8e-16, 3e-15),
        "textbook": (5e-16, 6e-16, 6e-16),
        "fsolve(tolerance=1e-10)": (6e-14, 5e-15, 8e-15),
        "rk4(steps=1440)": (1e-12, 4e-13, 9e-13),
        "rk45(rtol=1e-12)": (2.5e-11, 5e-12, 1.5e-11),
        "dop853(rtol=1e-12)": (3e-12, 1.5e-12, 1.5e-12),
        "radau(rtol=1e-09)": (6e-10, 1.5e-10, 4e-10),
    },
    "variable-crank": {
        **dict.fromkeys(_NEWTON, (1.5e-12, 1.5e-10, 9e-10)),
        **dict.fromkeys(_PROJECTED, (1.5e-15, 1.2e-13, 7e-13)),
        "closed-form": (3e-16, 1.5e-14, 1.5e-14),
        "textbook": (1.2e-15, 1e-13, 5e-13),
        "fsolve(tolerance=1e-10)": (2e-13, 4e-12, 9e-12),
        "rk4(steps=1440)": (1e-11, 7e-11, 4e-10),
        "rk45(rtol=1e-12)": (7e-11, 7e-9, 4e-8),
        # a rounding decides where its last steps beside the singular angle lie: the largest of twelve crank lengths
        "dop853(rtol=1e-12)": (2.5e-10, 8e-9, 2.5e-8),
        "radau(rtol=1e-09)": (1e-10, 6e-9, 4e-8),
    },
}


def turn(loop, level=Level.ACCELERATIONS):
    """A turn of the slider-cranks from 90 degrees on; of the slicers the arc between their singular angles."""
    if loop is SLIDER_CRANK:
        parameters, degrees = SLIDERS, np.linspace(90.0, 450.0, 73)
    else:
        parameters, degrees = SLICERS, np.linspace(95.0, 265.0, 35)
    angles = np.tile(np.deg2rad(degrees), (len(parameters), 1))
    return Task(loop, parameters, angles, level)


@pytest.fixture(scope="module")
def exact():
    """The exact motions by the name of the loop."""
    return {loop.name: exact_motion(turn(loop)) for loop in (SLIDER_CRANK, VARIABLE_CRANK)}


def test_every_method_has_an_error_bound():
    for loop in (SLIDER_CRANK, VARIABLE_CRANK):
        assert BOUNDS[loop.name].keys() == {method_label(case[-1]) for case in methods_for(loop).values()}


@pytest.mark.parametrize(("loop", "method"), CASES)
def test_errors_are_within_their_bounds(loop, method, exact):
    task = turn(loop)
    motion = method.solve(task)
    assert [Outcome(code) for code in motion.outcome] == [Outcome.OK] * len(task)
    errors = signal_errors(task, motion.signals, exact[loop.name])
    largest = [errors[2 * k : 2 * k + 2].max() for k in range(3)]
    bounds = BOUNDS[loop.name][method_label(method)]
    assert all(error <= bound for error, bound in zip(largest, bounds, strict=True)), largest


@pytest.mark.parametrize("loop", [SLIDER_CRANK, VARIABLE_CRANK], ids=lambda loop: loop.name)
def test_the_exact_motion_closes_its_loop_and_is_its_own_derivative(loop):
    """Rates of the reference by central differences; a step of 1e-12 leaves 24 digits."""
    context = multiple_precision()
    step = context.mpf(10) ** -12
    for parameters in turn(loop).parameters:
        design = ExactDesign(loop, parameters)
        for angle in (0.05, 1.2, 2.0, 3.0, 3.3, 4.5, 6.2):
            below, here, above = design.motions([context.mpf(angle) + k * step for k in (-1, 0, 1)])
            for k in range(4):
                difference = (above[k] - below[k]) / (2 * step)
                assert abs(difference - here[k + 2]) < 1e-20 * (1 + abs(here[k + 2]))
            task = Task(loop, parameters[None], np.array([[angle]]))
            gap = largest_gap(task, np.array([float(value) for value in here])[:, None, None])
            assert gap.max() < 4e-16 * task.size[0]  # rounding of two sums


def test_the_reference_agrees_with_that_of_the_mechanisms():
    """60 digits of the slider-crank; the variable crank by integrals of its speed."""
    theta = 2.2
    slider, slicer = ExactSliderCrank(*SLIDERS[0]), ExactVariableCrank(*SLICERS[0])
    x, v, a, angle, w, dw = (float(value) for value in slider.motion(mpmath.mpf(theta))[:6])
    task = Task(SLIDER_CRANK, SLIDERS[:1], np.array([[theta]]))
    assert exact_motion(task)[:, 0, 0].tolist() == [angle, x, w, v, dw, a]
    task = Task(VARIABLE_CRANK, SLICERS[:1], np.array([[theta]]))
    with mpmath.workdps(40):
        expected = [float(slicer.crank(mpmath.mpf(theta))), float(slicer.crank_slope(mpmath.mpf(theta)))]
    assert exact_motion(task)[[1, 3], 0, 0] == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("loop", [SLIDER_CRANK, VARIABLE_CRANK], ids=lambda loop: loop.name)
def test_the_rates_of_one_design_are_those_of_all(loop):
    task = turn(loop)
    signals = exact_motion(task)
    for i, parameters in enumerate(task.parameters):
        rates = DesignEquations(loop, parameters).rates(float(task.crank_angle[i, 3]), signals[:2, i, 3])
        # the rounding of the unknowns, by the condition of the loop at 14 degrees from the singular angle
        assert rates == pytest.approx(signals[2:4, i, 3], rel=1e-12)


def test_the_determinant_of_the_variable_crank_changes_its_sign_at_the_singular_angle_not_at_90_deg():
    """Between both the determinant of its closed form has the same sign as beyond 90 deg."""
    regular = np.rad2deg(regular_of(SLICERS)).max()
    angles = np.tile(np.deg2rad([10.0, *np.linspace(regular + 0.5, 89.5, 7), 120.0]), (len(SLICERS), 1))
    task = Task(VARIABLE_CRANK, SLICERS, angles, Level.POSITIONS)
    about = VARIABLE_CRANK.about(task.upright, angles, METHODS["closed-form"][0].solve(task).signals)
    assert (solve(about.columns, about.gap)[1] * find_sides(task) > 0.0).all()
    assert (find_sides(task)[:, 0] * find_sides(task)[:, 1] < 0.0).all()


def regular_of(parameters):
    """The crank angle of each slicer at which crank and rod are perpendicular."""
    return singular_angle(VARIABLE_CRANK.columns(parameters.T))


def test_outcomes_known_from_the_geometry():
    sliders = np.array([[100.0, 260.0, 30.0], [1.0, 2.0, 4.0], [100.0, 120.0, 30.0], [100.0, 130.0, 30.0],
                        [0.0, 1.0, 0.0], [1.0, np.nan, 0.0]])  # fmt: skip
    expected = [Outcome.OK, Outcome.CANNOT_ASSEMBLE, Outcome.CRANK_BLOCKED, Outcome.CHANGE_POINT, Outcome.NOT_FINITE,
                Outcome.NOT_FINITE]  # fmt: skip
    assert geometric_outcome(Task(SLIDER_CRANK, sliders, np.zeros((6, 1)))).tolist() == expected
    slicers = np.array([SLICERS[0], [500.0, 800.0, 100.0 * np.pi / 30.0, 0.29, 2.0], [60.0, 800.0, 10.0, 0.1, 2.0]])
    expected = [Outcome.OK, Outcome.NO_MOTION, Outcome.NO_MOTION]
    assert geometric_outcome(Task(VARIABLE_CRANK, slicers, np.zeros((3, 1)))).tolist() == expected


@pytest.mark.parametrize(("loop", "method"), CASES)
def test_a_design_without_motion_gives_an_outcome(loop, method):
    """Without screening no method raises, or reports NaN as solved."""
    blocked = [100.0, 120.0, 30.0] if loop is SLIDER_CRANK else [60.0, 800.0, 10.0, 0.1, 2.0]
    for parameters in (blocked, [np.nan] * len(blocked)):
        angles = np.linspace(0.0, 2.0 * np.pi, 13)[None]
        motion = method.solve(Task(loop, np.array([parameters]), angles))
        assert motion.outcome[0] != Outcome.OK or np.isfinite(motion.signals).all()


def test_the_integrated_equation_ends_at_the_singular_angle_and_the_closed_form_does_not():
    """The published way: rod and crank are perpendicular at 81.4 degrees; steps of adaptive integrators collapse."""
    parameters = SLICERS[:1]
    regular = float(np.rad2deg(regular_of(parameters)[0]))
    assert regular == pytest.approx(81.40903717447330, rel=1e-14)
    degrees = np.arange(0.0, 361.0)
    task = Task(VARIABLE_CRANK, parameters, np.deg2rad(degrees)[None], Level.VELOCITIES)
    reference = exact_motion(task)
    for solver, rtol in (("RK45", 1e-9), ("DOP853", 1e-9), ("Radau", 1e-6)):
        motion = VelocityIntegration(solver, rtol).solve(task)
        assert motion.outcome[0] in (Outcome.GAVE_UP, Outcome.NOT_FINITE, Outcome.WRONG_BRANCH)
        errors = signal_errors(task, motion.signals, reference)[:, 0].max(axis=0)
        assert errors[degrees <= 75.0].max() < 1e-4  # 6 degrees ahead the velocity has lost two of its six digits
        behind = (degrees > regular) & (degrees < 360.0 - regular)  # Radau changes the branch there, and back later
        assert not (errors[behind] <= 1e-6).any()
    closed = METHODS["closed-form"][0].solve(task)
    assert signal_errors(task, closed.signals, reference).max() < 2e-14


@pytest.mark.parametrize(("error", "expected"), [(1e-3, 1.94439e-3), (1.0, 6.099e-2)])
def test_a_start_length_that_is_wrong_ends_ahead_of_the_singular_angle(error, expected):
    """Ahead by the square root of the error; 1.94439e-3 and 6.099e-2 rad for 1e-3 and 1 mm, from the specification."""
    parameters = SLICERS[:1]
    regular = float(regular_of(parameters)[0])
    angles = np.concatenate([[0.0], regular - expected + np.linspace(-1e-3, 1e-3, 401) * expected * 50.0])[None]
    first = Task(VARIABLE_CRANK, parameters, angles[:, :1], Level.POSITIONS)
    start = exact_motion(first)[:2, 0, 0] + [0.0, error]
    task = Task(VARIABLE_CRANK, parameters, angles, Level.POSITIONS, start[None])
    motion = VelocityIntegration("DOP853", 1e-11).solve(task)
    reached = angles[0, np.isfinite(motion.signals[0, 0])].max()
    # within a hundredth: the four digits of the specification, and the last output angle before the end
    assert regular - reached == pytest.approx(expected, rel=1e-2)


def test_at_the_singular_angle_newton_stops_and_the_textbook_loses_the_velocity():
    regular = float(regular_of(SLICERS)[0])
    angles = np.array([[0.5 * regular, 0.75 * regular, regular - 1e-7]])
    task = Task(VARIABLE_CRANK, SLICERS[:1], angles, Level.VELOCITIES)
    reference = exact_motion(task)
    textbook = judge(task, METHODS["textbook"][0].solve(task), reference, 1e-6)
    assert textbook.verdict.tolist() == [Verdict.INACCURATE]
    closed = judge(task, METHODS["closed-form"][0].solve(task), reference, 1e-13)
    assert closed.verdict.tolist() == [Verdict.ACCURATE]
    # the gap within the tolerance does not determine the length any more
    assert judge(task, Newton(1e-12).solve(task), reference, 1e-6).verdict[0] != Verdict.ACCURATE
    assert judge(task, Fsolve(1e-10).solve(task), reference, 1e-6).verdict[0] != Verdict.ACCURATE


@pytest.mark.parametrize("method", ["newton", "newton-compiled", "fsolve", "textbook", "rk4-projected"])
def test_simulate_by_another_method(method):
    slider = {"crank": 100.0, "rod": 260.0, "offset": 30.0, "speed": 3.0}
    exact_frame = explore.simulate("slider-crank", slider, angles=72)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        motion = explore.simulate("slider-crank", slider, angles=72, method=method)
    assert list(motion.columns) == list(exact_frame.columns)
    for name in exact_frame:
        assert np.abs(motion[name] - exact_frame[name]).max() <= 1e-9 * exact_frame[name].abs().max(), name


def test_simulate_the_variable_crank_by_another_method_gives_what_its_loop_determines():
    slicer = {"rod": 500.0, "slider_speed": 800.0, "speed": 10.0, "reversal_time": 0.1}
    angles = np.linspace(95.0, 265.0, 35)
    exact_frame = explore.simulate("variable-crank", slicer, angles=angles)
    motion = explore.simulate("variable-crank", slicer, angles=angles, method="textbook")
    names = ["crank", "crank_rate", "rod_angle", "groove_pressure_angle", "groove_curvature"]
    assert list(motion.columns) == names
    for name in names:  # the curvature has the digits of the acceleration
        assert np.abs(motion[name] - exact_frame[name]).max() <= 1e-11 * exact_frame[name].abs().max(), name
    assert motion.attrs["units"] == {name: exact_frame.attrs["units"][name] for name in names}


def test_simulate_over_the_singular_angle_warns():
    slicer = {"rod": 500.0, "slider_speed": 800.0, "speed": 10.0, "reversal_time": 0.1}
    with pytest.warns(RuntimeWarning, match=r"rk45\(rtol=1e-09\) failed for this design: "):
        motion = explore.simulate("variable-crank", slicer, angles=360, method="rk45(rtol=1e-09)")
    assert motion["crank"].isna().any()
    assert motion["crank"].iloc[:75].notna().all()


@pytest.mark.parametrize("name", ["circles", "pylinkage"])
def test_methods_for_four_bars_alone_say_so(name):
    if not METHODS[name]:
        pytest.skip("pylinkage is not installed: extra peers")
    assert Capability.TWO_ANGLES in find_method(name).capabilities
    message = f"method {name!r} solves one loop with two unknown angles; available here: closed-form"
    with pytest.raises(explore.RequestError, match=re.escape(message)):
        explore.simulate("slider-crank", {"crank": 1.0, "rod": 3.0}, method=name)
