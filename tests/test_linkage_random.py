"""Linkages of random dyads: places and rates of the graph and of compiled code, against all joints solved together."""

import mpmath
import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from joints import STEP, Joints
from linkage_cases import evaluate_graph, trace
from mpmath import mpf
from random_linkages import chains

import explore

#: Share by which parameters are changed to find what a rounding of each does.
CHANGE = mpf(10) ** -20


def joint_motion(chain):
    """Places of all points, and first and second derivatives, each (x, y), by all joints together."""
    joints, theta = Joints(chain.table, chain.values), mpf(chain.angle) * mpmath.pi / 180
    about = []
    for origin, direction in map(chain.poses.get, joints.links):
        about += [mpf(origin.real), mpf(origin.imag), mpf(np.angle(direction))]
    about[joints.driver] = theta
    here = joints.solve(about, theta)
    behind, ahead = (joints.solve(here, theta + side * STEP) for side in (-1, 1))
    motion = {}
    for point in joints.owners:
        first, middle, last = (joints.point(q, point) for q in (behind, here, ahead))
        motion[point] = (
            middle,
            tuple((b - a) / (2 * STEP) for a, b in zip(first, last, strict=True)),
            tuple((a - 2 * m + b) / STEP**2 for a, m, b in zip(first, middle, last, strict=True)),
        )
    return motion


def graph_motion(chain, values):
    """The same by the graph of the table, with the digits of mpmath."""
    equations, theta = chain.equations, mpf(chain.angle) * mpmath.pi / 180
    numbers = [x.terms[k] for place in equations.points.values() for k in range(3) for x in place]
    found = iter(evaluate_graph(numbers, values, theta))
    return {point: tuple((next(found), next(found)) for _ in range(3)) for point in equations.points}


def largest(vectors):
    return max(abs(each) for pair in vectors for each in pair)


@pytest.mark.parametrize("examples", [15, pytest.param(1000, marks=pytest.mark.slow)])
def test_random_linkages_move_as_all_their_joints_say(examples):
    # Examples of the same seed on every run; a smaller example would take minutes to find.
    @settings(
        derandomize=True, max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck),
        phases=(Phase.generate,),
    )  # fmt: skip
    @given(chains())
    def check(chain):
        linkage = explore.Linkage(chain.table)
        chain.equations = trace(linkage)
        with mpmath.workdps(60):
            expected = joint_motion(chain)
            found = graph_motion(chain, chain.values)
            rng = np.random.default_rng(1)
            changed = [
                {name: mpf(value) * (1 + CHANGE * rng.choice([-1, 1])) for name, value in chain.values.items()}
                for _ in range(3)
            ]
            others = [graph_motion(chain, values) for values in changed]
            sizes = [largest(moves[k] for moves in expected.values()) + 1 for k in range(3)]
            for point, moves in expected.items():
                for k, (own, wanted) in enumerate(zip(found[point], moves, strict=True)):
                    # the square of the step, times what the next two derivatives are larger by
                    assert largest([np.subtract(own, wanted)]) <= mpf(10) ** -18 * sizes[k], (point, k)
            row = explore.simulate(linkage, chain.values | {"speed": 1.0}, angles=[float(chain.angle)]).iloc[0]
            for point in set(expected) - set(chain.table["frame"]):
                for k, word in enumerate(("", "velocity_", "acceleration_")):
                    moved = sum(largest([np.subtract(other[point][k], found[point][k])]) for other in others) / CHANGE
                    # some tens of roundings, each of which moves a value as one of a parameter does, or of a place
                    for axis, value in zip("xy", found[point][k], strict=True):
                        difference = abs(mpf(float(row[f"{point}_{word}{axis}"])) - value)
                        assert difference <= mpf("2.2e-16") * 50 * (moved + sizes[k]), (point, word, axis)

    check()
