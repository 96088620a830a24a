"""A node of a linkage by explore and by pylinkage's compiled steps: ``python benchmarks/linkages_peers.py``.

CPU time of places, velocities and accelerations of all joints at one crank angle of one design, the least of five in
one run, for a four-bar and a Jansen leg; pylinkage is of the extra `peers`. Then that of a node of a sweep: means and
variances of all rates to 1e-9, with statuses and bounds.
"""

import json
import time
import tomllib
from pathlib import Path

import numba
import numpy as np
from pylinkage.actuators import Crank
from pylinkage.components import Ground
from pylinkage.dyads import RRRDyad
from pylinkage.simulation import Linkage as Steps

from explore import Linkage
from explore.base.compiling import LANES
from explore.evaluation.evaluate import evaluate_columns
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

REFERENCE = Path(__file__).parents[1] / "tests" / "reference" / "linkages.json"
NODES, DESIGNS = 64, 20_000
FOUR_BAR = {
    "driver": "crank",
    "frame": {"O": [0, 0], "C": ["r4", 0]},
    "links": {"crank": {"O": 0, "A": "r1"}, "coupler": {"A": 0, "B": "r2"}, "rocker": {"C": 0, "B": "r3"}},
    "branch": {"B": "left of A C"},
}
#: Joints of Jansen's leg in pylinkage, in order: name, the two joints they hang on, distances.
JANSEN = (
    ("W", "X", "Y", 50.0, 41.5), ("U", "X", "Y", 61.9, 39.3), ("V", "W", "Y", 55.8, 40.1),
    ("S", "V", "U", 39.4, 36.7), ("T", "S", "U", 65.7, 49.0),
)  # fmt: skip


def pylinkage_steps(fixed, radius, dyads):
    """A linkage of pylinkage: its second ground, the crank's radius, and the joints that follow."""
    grounds = [Ground(0.0, 0.0, name="Z"), Ground(*fixed, name="Y")]
    crank = Crank(anchor=grounds[0], radius=radius, angular_velocity=2.0 * np.pi / NODES)
    joints = {"X": crank.output, "Y": grounds[1]}
    for name, first, second, *distances in dyads:
        near, far = distances
        joints[name] = RRRDyad(anchor1=joints[first], anchor2=joints[second], distance1=near, distance2=far, name=name)
    return Steps([*grounds, crank, *(joints[name] for name, *_ in dyads)])


@numba.njit
def fill_often(fill, constants, tangents, out, times):
    """Fill all rows at all nodes, again and again."""
    for _ in range(times):
        fill(constants, tangents, 0, 0, 0, NODES, 1, out)


def seconds_of(function):
    """CPU time, the least of five after a first call."""
    function()
    times = []
    for _ in range(5):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def motion_seconds(linkage, values, joints):
    """CPU time of the motion of all joints at one node of one design."""
    signals = [
        f"{joint}{rate}_{axis}" for joint in joints for rate in ("", "_velocity", "_acceleration") for axis in "xy"
    ]
    kernel = make_request(linkage.mechanism, metrics=[f"{signal}_mean" for signal in signals], window="cycle").kernel
    geometry = np.array([[values[p.name]] * LANES for p in kernel.kernel_parameters])
    constants = np.ascontiguousarray(kernel.constants(geometry)).ravel()
    tangents = np.repeat(np.tan(np.linspace(-0.7, 0.7, NODES)), LANES)
    out = np.zeros(NODES * kernel.signal_rows * LANES)
    return seconds_of(lambda: fill_often(kernel.fill, constants, tangents, out, 200)) / (200 * NODES * LANES)


def sweep_seconds(linkage, values, joints):
    """CPU time of a node of a sweep, everything included."""
    rates = [f"{joint}_{rate}_{axis}" for joint in joints for rate in ("velocity", "acceleration") for axis in "xy"]
    metrics = [f"{rate}_{statistic}" for rate in rates for statistic in ("mean", "variance")]
    request = make_request(find_mechanism(linkage), metrics=metrics, window="cycle", tolerance=1e-9)
    rng = np.random.default_rng(1)
    designs = {name: value * (1.0 + 0.01 * rng.uniform(-1.0, 1.0, DESIGNS)) for name, value in values.items()}
    nodes = int(evaluate_columns(request, designs).columns["nodes"].sum())
    return seconds_of(lambda: evaluate_columns(request, designs)) / nodes


def main() -> None:
    """Print a line for each linkage."""
    jansen = next(case for case in json.loads(REFERENCE.read_text())["cases"] if case["name"] == "jansen")
    cases = {
        "four-bar": (
            Linkage(FOUR_BAR), {"r1": 30.0, "r2": 90.0, "r3": 70.0, "r4": 100.0}, ["B"],
            pylinkage_steps((100.0, 0.0), 30.0, [("B", "X", "Y", 90.0, 70.0)]),
        ),
        "jansen": (
            Linkage(tomllib.loads(jansen["table"])), {k: float(v) for k, v in jansen["parameters"].items()},
            [name for name, *_ in JANSEN], pylinkage_steps((-38.0, -7.8), 15.0, JANSEN),
        ),
    }  # fmt: skip
    for name, (linkage, values, joints, steps) in cases.items():
        theirs = seconds_of(lambda steps=steps: steps.step_fast_with_kinematics(iterations=6400)) / 6400
        motion, sweep = (each(linkage, values, joints) for each in (motion_seconds, sweep_seconds))
        print(
            f"{name:9} pylinkage {1e9 * theirs:.0f} ns a node; explore {1e9 * motion:.1f} ns, {theirs / motion:.0f} x; "
            f"within a sweep with {8 * len(joints)} statistics {1e9 * sweep:.1f} ns, {theirs / sweep:.0f} x"
        )


if __name__ == "__main__":
    main()
