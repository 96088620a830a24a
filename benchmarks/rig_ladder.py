"""What each level of the test rig costs: geometry, positions, velocities, accelerations, masses; as ratios in one run.

Run with ``python benchmarks/rig_ladder.py [--designs 16384] [--repetitions 9]``. CPU time of `explore.evaluate`'s core,
levels interleaved, medians; the last columns say how many nodes a design took and what a node cost.
"""

import argparse
import statistics
import time

import numpy as np

from explore.evaluation.evaluate import evaluate_columns
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

TORQUE, SPRING = {"constant_torque": 25e3}, {"stiffness": 143e3}
MASSES = {"crank_mass": 20.0, "coupler_mass": 25.0, "rocker_mass": 40.0, "coupler_inertia": 3.4}
LEVELS = {
    "swing_angle: closed form": ("swing_angle", {}),
    "rocker_velocity_max": ("rocker_velocity_max", {}),
    "velocity_thd": ("velocity_thd", {}),
    "pin force, torque: positions": ("pin_force_peak", TORQUE),
    "pin force, spring: positions": ("pin_force_peak", SPRING),
    "pin force, damper: velocities": ("pin_force_peak", {"damping": 100.0}),
    "pin force, inertia: accelerations": ("pin_force_peak", SPRING | {"inertia": 8.0}),
    "pin force, masses": ("pin_force_peak", SPRING | {"inertia": 8.0} | MASSES),
    "drive torque, masses": ("drive_torque_peak", SPRING | {"inertia": 8.0} | MASSES),
    "bearing_mean_force, spring": ("bearing_mean_force", SPRING),
    "rod, pin, shaft, life, spring": ("sizes", SPRING),
}
SIZES = ["rod_diameter", "pin_diameter", "shaft_diameter", "bearing_life"]
ALLOWANCES = {"allowed_stress": 116.7, "allowed_shear": 80.0, "bearing_rating": 44.6e3}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--designs", type=int, default=16_384)
    parser.add_argument("--repetitions", type=int, default=9)
    arguments = parser.parse_args()
    mechanism, rng, n = find_mechanism("test-rig"), np.random.default_rng(0), arguments.designs
    ranges = {"crank": (40, 110), "coupler": (460, 1000), "rocker": (400, 600), "ground": (700, 800), "speed": (30, 75)}
    rigs = {name: rng.uniform(*bounds, n) for name, bounds in ranges.items()}
    jobs = {}
    for level, (metric, load) in LEVELS.items():
        request = make_request(mechanism, metrics=SIZES if metric == "sizes" else [metric])
        designs = rigs | {name: np.full(n, value) for name, value in (load | ALLOWANCES).items()}
        jobs[level] = (request, designs)
    seconds = {level: [] for level in jobs}
    nodes = {level: evaluate_columns(*job).columns["nodes"].mean() for level, job in jobs.items()}
    for _ in range(arguments.repetitions):
        for level, job in jobs.items():
            start = time.process_time()
            evaluate_columns(*job)
            seconds[level].append(time.process_time() - start)
    least = statistics.median(seconds["swing_angle: closed form"])
    print(f"{'level':36s}{'us/design':>10s}{'ratio':>8s}{'nodes':>8s}{'ns/node':>9s}")
    for level, times in seconds.items():
        took = statistics.median(times)
        per_node = f"{1e9 * took / n / nodes[level]:9.1f}" if nodes[level] else ""
        print(f"{level:36s}{1e6 * took / n:10.2f}{took / least:8.1f}{nodes[level]:8.0f}{per_node}")


if __name__ == "__main__":
    main()
