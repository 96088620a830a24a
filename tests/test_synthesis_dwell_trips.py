"""Dwells of random crank-rockers: the task of their figures has linkages whose sliders rest at least as well.

The slider's motion is simulated here, from the columns of the candidates: nothing of the solver measures it.
"""

import numpy as np
import pytest
from scipy.optimize import minimize

from explore.synthesis.linkages import FourBar
from explore.synthesis.tasks.task_files import parse_task

CRANK = 20.0
TURN = np.linspace(0, 2 * np.pi, 3601)


def slider(points, link, rest, direction):
    """Places of the slider along its guide from its rest, and the sines of the pressure angle."""
    local = (points - rest) * np.exp(-1j * direction)
    with np.errstate(invalid="ignore"):
        half = np.sqrt(link**2 - local.imag**2)
    # It is on the side of its point on which it rests, where it is near 0.
    side = 1 if abs(local.real[0] + half[0]) < abs(local.real[0] - half[0]) else -1
    return local.real + side * half, local.imag / link


def figures(linkage, start, span, link, rest, direction):
    """Travel in the dwell and over the turn, and the largest pressure angle, rad; NaN where the link is too short."""
    dwell = start + np.linspace(0, span, 1501)
    still, _ = slider(linkage.points(dwell), link, rest, direction)
    travel, sines = slider(linkage.points(start + TURN), link, rest, direction)
    with np.errstate(invalid="ignore"):
        return np.ptp(still), np.ptp(travel), np.arcsin(np.abs(sines).max())


def worst_transmission_angle(linkage):
    angles = linkage.transmission_angles(np.array([0, np.pi]))
    return min(angles.min(), np.pi - angles.max())


def circle(points):
    """Centre and radius of the circle of least squares of the algebraic distance."""
    matrix = np.column_stack([2 * points.real, 2 * points.imag, np.ones(len(points))])
    x, y, rest = np.linalg.lstsq(matrix, np.abs(points) ** 2, rcond=None)[0]
    return complex(x, y), np.sqrt(rest + x * x + y * y)


def crank_rocker(rng):
    """A crank-rocker with a transmission angle of 25 deg or more; its crank is 1."""
    while True:
        coupler, rocker, ground = rng.uniform(1, 5, 3)
        linkage = FourBar(0j, complex(ground), 1.0, coupler, rocker, 0j)
        if linkage.is_crank_turning and worst_transmission_angle(linkage) > np.radians(25):
            return linkage


def with_arc(rng, shape, span):
    """The crank-rocker with the coupler point, and the begin of the dwell, of the roundest arc near a random one."""

    def deviation(x):
        angles = x[0] + np.linspace(0, span, 25)
        pins, point = shape.crank_pins(angles), complex(x[1], x[2])
        points = pins + point * (shape.rocker_pins(angles) - pins)
        centre, radius = circle(points)
        # Away from the pins, whose arcs are circles, and links from 0.3 to 5.
        near = max(0, 0.5 - abs(point)) + max(0, 0.5 - abs(point - 1)) + max(0, abs(point) * shape.coupler - 5)
        return np.abs(np.abs(points - centre) - radius).max() + near + max(0, 0.3 - radius) + max(0, radius - 5)

    guesses = rng.uniform([0, -1.5, -2], [2 * np.pi, 2.5, 2], (30, 3))
    start, along, across = minimize(
        deviation, min(guesses, key=deviation), method="Nelder-Mead", options={"maxfev": 400}
    ).x
    return FourBar(0j, shape.rocker_pivot, 1.0, shape.coupler, shape.rocker, complex(along, across)), start


def planted(rng):
    """A task file of a dwell that exists, and the travel of its slider in the dwell, in cranks."""
    while True:
        span = rng.uniform(np.radians(40), np.radians(150))
        linkage, start = with_arc(rng, crank_rocker(rng), span)
        rest, link = circle(linkage.points(start + np.linspace(0, span, 181)))
        for direction in rng.permutation(np.radians(np.arange(0, 180, 5))):
            error, stroke, pressure = figures(linkage, start, span, link, rest, direction)
            # Its travel in the dwell is at most 2 % of its stroke.
            if not (stroke > 0.4 and error < 0.02 * stroke and pressure < np.radians(60)):
                continue
            longest = max(linkage.coupler, linkage.rocker, linkage.ground, link, abs(linkage.point) * linkage.coupler)
            text = f"""
task = "dwell"
target = {{ dwell_angle = {np.degrees(span)}, stroke = {stroke * CRANK}, crank = {CRANK} }}
search = {{ count = 1 }}
[bounds]
transmission_angle_min = {np.degrees(worst_transmission_angle(linkage))}
pressure_angle_max = {np.degrees(pressure)}
link_ratio_max = {longest}
"""
            return text, error * CRANK


def rests_as_well(text, error):
    """Whether the best candidate is within all bounds of the task, and its slider travels no farther in the dwell."""
    task = parse_task(text, "task.toml").task
    candidates = task.find(None)
    lengths = [candidates.parameters[name][0] for name in ("crank", "coupler", "rocker", "ground")]
    arm = complex(candidates.parameters["M_along"][0], candidates.parameters["M_across"][0])
    crank, coupler, rocker, ground = lengths
    branch = int(candidates.parameters["branch"][0])
    linkage = FourBar(0j, complex(ground), crank, coupler, rocker, arm / coupler, branch)
    value = {name: column[0] for name, column in candidates.values.items()}
    bounds = task.constraints
    found, stroke, pressure = figures(
        linkage, np.radians(value["dwell_start"]), parse_span(text), value["slider_link"],
        complex(value["rest_x"], value["rest_y"]), np.radians(value["guide_angle"]),
    )  # fmt: skip
    longest = max(*lengths, value["slider_link"], abs(arm))
    return (
        found <= error
        and np.degrees(worst_transmission_angle(linkage)) >= bounds["transmission_angle_worst"]["min"]
        and longest / crank <= bounds["link_ratio"]["max"]
        and stroke >= bounds["slider_stroke"]["min"]
        and np.degrees(pressure) <= bounds["slider_pressure_angle_max"]["max"]
        and value["dwell_error"] == pytest.approx(found, rel=1e-3)
    )


def parse_span(text):
    return np.radians(float(text.split("dwell_angle = ")[1].split(",")[0]))


def missed(count, seed):
    """How many of planted dwells the best candidate is not as good as."""
    rng = np.random.default_rng(seed)
    return sum(not rests_as_well(*planted(rng)) for _ in range(count))


@pytest.mark.parametrize(("count", "seed"), [(5, 51), pytest.param(1000, 52, marks=pytest.mark.slow)])
def test_sliders_rest_as_well_as_those_planted(count, seed):
    assert missed(count, seed) <= count // 50
