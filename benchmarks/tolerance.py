"""Parts drawn a second, in one process, over designs evaluated a second, interleaved in one run by CPU time.

Run with ``python benchmarks/tolerance.py``. The first line is the published optimum with the metrics of its page, the
second a design of configs/grid.toml, whose extremes are sampled.
"""

import time
from pathlib import Path

import numpy as np

import explore
from explore.analysis.tolerancing.outcomes import TolerancedRequest
from explore.analysis.tolerancing.spreads import CHUNK, chunk_deviations, count_parts
from explore.evaluation.evaluate import evaluate_columns
from explore.studies.request.tolerances import make_tolerances

CONFIGS = Path(__file__).parents[1] / "configs"
PUBLISHED = {"crank": 50.0, "coupler": 940.62, "rocker": 211.79, "ground": 869.44}
GRID = {"crank": 100.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118, "speed": 4.0}


def measure(name: str, design: dict[str, float], rounds: int) -> str:
    study = explore.load_study(CONFIGS / name)
    mechanism = study.request.mechanism
    request = TolerancedRequest.of(
        study.request, study.objectives, make_tolerances(mechanism, dict.fromkeys(PUBLISHED, 0.1))
    )
    columns = {n: np.full(CHUNK, value) for n, value in design.items()}
    for row, tolerance in zip(chunk_deviations(request, 0, 0), request.tolerances, strict=True):
        columns[tolerance.parameter] = columns[tolerance.parameter] + row
    count_parts(request, design, 0, 0, CHUNK)
    drawn = evaluated = 0.0
    for _ in range(rounds):
        start = time.process_time()
        count_parts(request, design, 0, 0, CHUNK)
        middle = time.process_time()
        evaluate_columns(request.request, columns)
        drawn, evaluated = drawn + middle - start, evaluated + time.process_time() - middle
    rate, bare = rounds * CHUNK / drawn, rounds * CHUNK / evaluated
    return f"{name:<14} {rate:12,.0f} parts/s  {bare:12,.0f} designs/s  ratio {rate / bare:.2f}"


if __name__ == "__main__":
    print(measure("optimum.toml", PUBLISHED, 40))
    print(measure("grid.toml", GRID, 10))
