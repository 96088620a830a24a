"""Closed-form moments of the angular velocities: designs per CPU-second, and how many designs they serve.

Run with ``python benchmarks/integrals.py``. The compiled kernel is the closed form of a design with its integrals over
the drive stroke, in lanes, from arrays to arrays; `cv` alone through `evaluate_columns` adds the columns, the
closed-form metrics and the status. "sampled" asks for the largest velocity too, which needs samples, and takes the cv
from them.
"""

import statistics

import numpy as np
from timing import cpu_times

from explore.evaluation.evaluate import evaluate_columns
from explore.evaluation.known import integrate_window
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

DESIGNS, REPETITIONS = 65_536, 15
RANGES = {
    "ordinary": {"crank": (60, 140), "coupler": (900, 1000), "rocker": (500, 600), "ground": (700, 800)},
    "grid.toml": {"crank": (60, 180), "coupler": (900, 1300), "rocker": (450, 660), "ground": (620, 830)},
    "optimum.toml": {"crank": (50, 50.001), "coupler": (50, 1000), "rocker": (50, 500), "ground": (50, 1000)},
}


def main() -> None:
    mechanism, rng = find_mechanism("crank-rocker"), np.random.default_rng(0)
    boxes = {
        box: {name: rng.uniform(*limits, DESIGNS) for name, limits in ranges.items()} for box, ranges in RANGES.items()
    }
    designs = boxes["ordinary"]
    defaults = {"phases": np.full(DESIGNS, 3.0), "branch": np.ones(DESIGNS)}
    parameters = np.array([(designs | defaults)[p.name] for p in mechanism.kernel_parameters])
    drive, row = mechanism.window("drive"), mechanism.signal("rocker_velocity").row
    alone = make_request(mechanism, metrics=["cv"])
    sampled = make_request(mechanism, metrics=["cv", "rocker_velocity_max"])
    jobs = {
        "compiled kernel": lambda: integrate_window(mechanism, parameters, drive, "slow", {row}),
        "cv alone": lambda: evaluate_columns(alone, designs),
        "cv and largest velocity, sampled": lambda: evaluate_columns(sampled, designs),
    }
    for name, times in cpu_times(jobs, REPETITIONS).items():
        print(f"{name:34s}{DESIGNS / statistics.median(times) / 1e6:8.2f} million designs per CPU-second")
    print(f"\n{'designs of a box':34s}{'1e-6':>8s}{'1e-9':>8s}{'1e-12':>8s}  without nodes")
    for box, inside in boxes.items():
        shares = []
        for tolerance in (1e-6, 1e-9, 1e-12):
            columns = evaluate_columns(make_request(mechanism, metrics=["cv"], tolerance=tolerance), inside).columns
            computed = np.isin(columns["status"], (1, 7))
            shares.append(np.mean(columns["nodes"][computed] == 0))
        print(f"{box:34s}" + "".join(f"{share:8.1%}" for share in shares))


if __name__ == "__main__":
    main()
