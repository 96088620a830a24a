"""Seconds and memory of sensitivity indices: of feasibility from ever more designs, and of metrics from a million.

Run with ``python benchmarks/sensitivity.py``. The study is configs/optimum.toml. Times are without the start of Python,
the compilation and the sweep; CPU seconds are those of all threads. Memory is the largest of the process so far.
"""

import resource
import tempfile
import time
from pathlib import Path

import explore
from explore.analysis.sensitivity.feasibility import run_feasibility
from explore.analysis.sensitivity.public import plan_sensitivity
from explore.running.clusters import local_cluster

OPTIMUM = Path(__file__).parents[1] / "configs" / "optimum.toml"


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        results = explore.sweep(explore.load_study(OPTIMUM), Path(folder) / "optimum.h5")
        explore.sensitivity(results)  # imports and compiles
        print(f"{'':>34} {'wall s':>7} {'CPU s':>7} {'MB':>6}")
        for evaluations in (2**20, 2**22, 2**24):
            plan = plan_sensitivity(results, None, evaluations, 0)
            threads = local_cluster(None, processes=False)
            n = plan.feasibility.points.n_evaluations
            measure(f"feasibility of {n:,} designs", lambda p=plan, t=threads: run_feasibility(p.feasibility, t))
        plan = plan_sensitivity(results, None, 2**20, 0)
        measure("3 objectives of 1,000,000 designs", lambda: plan.table(None))
        measure("all of it: explore.sensitivity", lambda: explore.sensitivity(results))


def measure(name: str, job) -> None:
    wall, cpu = time.perf_counter(), time.process_time()
    job()
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{name:>34} {wall:7.2f} {cpu:7.2f} {memory:6.0f}", flush=True)


if __name__ == "__main__":
    main()
