"""Following solutions of the equations of nine points while the points move on straight lines.

The predictor is the classical Runge-Kutta method on the differential equation of the path, the corrector Newton's
method with at most three steps; the first correction measures the predictor's error and sets the next step.
"""

import numpy as np

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine
from explore.synthesis.nine_points.equations import N_PARAMETERS, N_UNKNOWNS, eliminate, linearise, magnitude

#: First step along a path.
_FIRST_STEP = 0.02
#: Error of the predictor over the wanted one beyond which a step is rejected at once.
_HOPELESS = 20.0
#: Error of the predictor over the wanted one beyond which a step is rejected after its correction.
_TOO_LARGE = 5.0
#: Correction below which it is the last.
_CONVERGED = 1e-7
#: Correction whose square, times 100, is below it is the last; larger ones must shrink.
_ROUNDING = 1e-11
#: Largest number of corrections of a step.
_N_CORRECTIONS = 3
#: Error of a predictor that fails.
_INFINITE = 1e10
#: Number of sides of the polygon around the target's parameters.
N_SIDES = 16
#: First step along a side.
_FIRST_STEP_OF_SIDE = 0.5
#: Largest number of steps along a side.
_MOST_STEPS_OF_SIDE = 500
#: Least step along a side.
_LEAST_STEP_OF_SIDE = 1e-6


@subroutine()
def _place(time, start, rates, parameters):
    for i in range(N_PARAMETERS):
        parameters[i] = start[i] + time * rates[i]


@subroutine()
def _relative_size(step, z):
    """The largest step over the largest unknown, of the hatted and the other unknowns; infinite for NaN."""
    step_plain, step_hatted, plain, hatted, total = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(0, N_UNKNOWNS, 2):
        step_plain, step_hatted = max(step_plain, magnitude(step[i])), max(step_hatted, magnitude(step[i + 1]))
        plain, hatted = max(plain, magnitude(z[i])), max(hatted, magnitude(z[i + 1]))
    for i in range(N_UNKNOWNS):  # a maximum would pass over NaN
        total += magnitude(step[i]) + magnitude(z[i])
    if not total < 1e200:
        return _INFINITE
    return max(step_plain / (plain + 1e-300), step_hatted / (hatted + 1e-300))


@subroutine()
def _slope(z, time, start, rates, parameters, jacobian, values, slope):
    """Fill the derivative of a solution by the time."""
    _place(time, start, rates, parameters)
    linearise(z, parameters, rates, jacobian, values, slope)
    for i in range(N_UNKNOWNS):
        slope[i] = -slope[i]
    eliminate(jacobian, slope)


@subroutine()
def _correct(z, parameters, rates, jacobian, values, unused, wanted):
    """Newton's method; whether it converged, and the first correction."""
    first, before = 0.0, 0.0
    for k in range(_N_CORRECTIONS):
        linearise(z, parameters, rates, jacobian, values, unused)
        eliminate(jacobian, values)
        for i in range(N_UNKNOWNS):
            z[i] -= values[i]
        size = _relative_size(values, z)
        if k == 0:
            first = size
            if size > _HOPELESS * wanted:
                break
        elif size > 0.1 * before and size > _ROUNDING:
            break
        if size < _CONVERGED or (k > 0 and 100.0 * size * size < _ROUNDING):
            return True, first
        before = size
    return False, first


@subroutine(allocates=True)
def _track(z, start, rates, wanted, first_step, most_steps, least_step):
    """Follow one solution from time 0 to 1, in place; whether it arrived."""
    jacobian = np.empty((N_UNKNOWNS, N_UNKNOWNS), np.complex128)
    slopes = np.empty((4, N_UNKNOWNS), np.complex128)
    values, trial = np.empty(N_UNKNOWNS, np.complex128), np.empty(N_UNKNOWNS, np.complex128)
    unused, parameters = np.empty(N_UNKNOWNS, np.complex128), np.empty(N_PARAMETERS, np.complex128)
    time, step, steps, has_slope = 0.0, first_step, 0, False
    while time < 1.0:
        if steps >= most_steps or step < least_step:
            return False
        steps += 1
        is_last = time + step >= 1.0 - 1e-14
        h = 1.0 - time if is_last else step
        if not has_slope:
            _slope(z, time, start, rates, parameters, jacobian, values, slopes[0])
            has_slope = True
        for k in range(1, 4):
            share = h if k == 3 else 0.5 * h
            for i in range(N_UNKNOWNS):
                trial[i] = z[i] + share * slopes[k - 1, i]
            _slope(trial, time + share, start, rates, parameters, jacobian, values, slopes[k])
        for i in range(N_UNKNOWNS):
            change = slopes[0, i] + 2.0 * slopes[1, i] + 2.0 * slopes[2, i] + slopes[3, i]
            trial[i] = z[i] + change * (h / 6.0)
        converged, error = _correct(trial, parameters, rates, jacobian, values, unused, wanted)
        if converged and error <= _TOO_LARGE * wanted:
            z[:] = trial
            time = 1.0 if is_last else time + h
            has_slope = False
            step = h * min(2.0, max(0.3, 0.9 * (wanted / (error + 1e-30)) ** 0.2))
        elif 0.0 < error < _INFINITE:
            step = h * min(0.5, max(0.1, 0.8 * (wanted / error) ** 0.2))
        else:
            step = 0.25 * h
    _place(1.0, start, rates, parameters)
    for _ in range(_N_CORRECTIONS):
        linearise(z, parameters, rates, jacobian, values, unused)
        eliminate(jacobian, values)
        if not _relative_size(values, z) < 1e-6:
            return False
        for i in range(N_UNKNOWNS):
            z[i] -= values[i]
    return True


@compiled(
    "void(complex128[:,::1], complex128[::1], complex128[::1], float64, int64, float64, bool_[::1])",
    allocates=True,
)
def track(solutions, start, rates, wanted, most_steps, least_step, arrived):
    """Follow solutions, in place, from parameters `start` to `start + rates`.

    `wanted` is the relative error of the predictor; `arrived` receives whether each arrives.
    """
    for i in range(len(solutions)):
        arrived[i] = _track(solutions[i], start, rates, wanted, _FIRST_STEP, most_steps, least_step)


@compiled(
    "void(complex128[:,::1], complex128[::1], complex128[::1], float64, complex128[:,:,::1], bool_[::1])",
    allocates=True,
)
def circle(solutions, target, rates, wanted, samples, arrived):
    """Lead solutions around the parameters `target`, from `target - rates` and back, where another one may arrive.

    `solutions` are of the problem `target - rates`, (n, 8). `samples`, (n, `N_SIDES` + 1, 8), receives them on the way
    and where they arrive, and `arrived` whether they do.
    """
    z = np.empty(N_UNKNOWNS, np.complex128)
    corner, side = np.empty(N_PARAMETERS, np.complex128), np.empty(N_PARAMETERS, np.complex128)
    for i in range(len(solutions)):
        z[:] = solutions[i]
        samples[i, 0] = z
        for k in range(N_SIDES):
            angles = 2.0 * np.pi * k / N_SIDES, 2.0 * np.pi * ((k + 1) % N_SIDES) / N_SIDES
            here = complex(np.cos(angles[0]), np.sin(angles[0]))
            there = complex(np.cos(angles[1]), np.sin(angles[1]))
            for j in range(N_PARAMETERS):
                corner[j] = target[j] - rates[j] * here
                side[j] = rates[j] * (here - there)
            arrived[i] = _track(z, corner, side, wanted, _FIRST_STEP_OF_SIDE, _MOST_STEPS_OF_SIDE, _LEAST_STEP_OF_SIDE)
            if not arrived[i]:
                break
            samples[i, k + 1] = z
