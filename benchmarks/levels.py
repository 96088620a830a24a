"""Cost of each level of the model, and of further speeds.

Run with ``python benchmarks/levels.py``. CPU time per design, least of nine, interleaved; 65,536 designs each. The same
number of designs with 10 and with 100 speeds is a tenth and a hundredth of the geometries.
"""

import time

import numpy as np

from explore.evaluation.evaluate import evaluate_columns
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

DESIGNS, REPETITIONS = 65_536, 9
RANGES = {"crank": (60, 140), "coupler": (900, 1000), "rocker": (500, 600), "ground": (700, 800)}


def moments(*signals):
    """Names of mean and variance of the signals."""
    return [f"{signal}_{statistic}" for signal in signals for statistic in ("mean", "variance")]


def measure(jobs):
    """Nanoseconds per design and what the last evaluation gave, by job."""
    seconds = {name: [] for name in jobs}
    results = {}
    for repetition in range(REPETITIONS + 1):
        for name, job in jobs.items():
            start = time.process_time()
            results[name] = job()
            if repetition:  # the first run warms up
                seconds[name].append(time.process_time() - start)
    return {name: (min(times) / DESIGNS * 1e9, results[name]) for name, times in seconds.items()}


def designs_with_speeds(count, rng):
    """Designs of which each geometry has so many speeds, in neighbouring rows."""
    geometries = -(-DESIGNS // count)
    designs = {n: np.repeat(rng.uniform(*bounds, geometries), count)[:DESIGNS] for n, bounds in RANGES.items()}
    return {**designs, "speed": np.resize(np.linspace(1.0, 10.0, count), DESIGNS)}


def main() -> None:
    mechanism, rng = find_mechanism("crank-rocker"), np.random.default_rng(0)
    designs = {name: rng.uniform(*bounds, DESIGNS) for name, bounds in RANGES.items()}
    velocities, accelerations = ("coupler_velocity", "rocker_velocity"), ("coupler_acceleration", "rocker_acceleration")
    levels = {
        "geometry": [metric.name for metric in mechanism.metrics],
        "positions": moments("coupler_angle", "rocker_angle"),
        "velocities": moments(*velocities),
        "velocities and accelerations": moments(*velocities, *accelerations),
        "the same and one largest value": [*moments(*velocities, *accelerations), "rocker_acceleration_max"],
    }
    requests = {name: make_request(mechanism, metrics=metrics) for name, metrics in levels.items()}
    jobs = {name: lambda request=request: evaluate_columns(request, designs) for name, request in requests.items()}
    table = measure(jobs)
    for name, (nanoseconds, evaluation) in table.items():
        ratio = nanoseconds / table["geometry"][0]
        print(
            f"{name:32s}{nanoseconds:6.0f} ns {ratio:6.2f} x geometry {evaluation.columns['nodes'].mean():6.1f} nodes"
        )
    print()
    request = make_request(mechanism)
    many = {count: designs_with_speeds(count, rng) for count in (1, 10, 100)}
    jobs = {count: lambda columns=columns: evaluate_columns(request, columns) for count, columns in many.items()}
    table = measure(jobs)
    for count, (nanoseconds, evaluation) in table.items():
        ratio = table[1][0] / nanoseconds
        evaluations = evaluation.kinematic_evaluations
        print(f"{count:3d} speeds {evaluations:7,} kinematic evaluations {nanoseconds:6.0f} ns a design: 1/{ratio:.1f}")


if __name__ == "__main__":
    main()
