"""Evaluations, seconds and share of the hypervolume of refinements, against Sobol' sweeps of as many designs.

Run with ``python benchmarks/refine.py [designs]``: 10^6 designs of a refinement by default. The first study is
configs/optimum.toml, whose largest hypervolume is known: 1.5618 by extrapolation, of which 10^8 Sobol' designs reach
98.75 %. The settings of the refinement were chosen on it. The others were not used for that; theirs is the largest that
any line reaches, so that the last line says 100 %. Times are without the start of Python and the compilation, and with
the sweep of the designs at the start; CPU seconds are those of all threads.
"""

import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import moocore
import numpy as np

import explore
from explore.results.ranking.pareto import objectives_to_minimise

OPTIMUM = Path(__file__).parents[1] / "configs" / "optimum.toml"
WIPER = """mechanism = "crank-rocker"
[parameters]
crank = { solve = "swing_angle", value = "80 deg" }
coupler = { min = 50, max = 1000 }
rocker = { min = 50, max = 500 }
ground = { min = 50, max = 1000 }
[sampling]
method = "sobol"
count = 1_000_000
seed = 1
[evaluate]
metrics = ["time_ratio", "transmission_angle_min", "transmission_angle_max", "rocker_acceleration_max"]
[constraints]
transmission_angle_min = { min = 45 }
transmission_angle_max = { max = 135 }
time_ratio = { max = 1.1 }
[rank]
metrics = ["time_ratio:min", "rocker_acceleration_max:min", "rocker:min"]
"""
RIG = """mechanism = "test-rig"
[parameters]
crank = { min = 5, max = 120 }
coupler = { min = 460, max = 1271.5 }
rocker = { min = 300, max = 700 }
ground = { min = 600, max = 900 }
constant_torque = 25000
[sampling]
method = "sobol"
count = 1_000_000
seed = 1
[evaluate]
metrics = ["swing_angle", "transmission_angle_worst", "pin_force_peak", "velocity_thd", "size"]
[constraints]
swing_angle = { min = 19.5, max = 20.5 }
transmission_angle_worst = { min = 40 }
[rank]
metrics = ["pin_force_peak", "velocity_thd", "size"]
"""
SLIDER = """mechanism = "slider-crank"
[parameters]
crank = { min = 50, max = 90 }
rod = { min = 120, max = 500 }
offset = { min = 0, max = 220 }
[sampling]
method = "sobol"
count = 1_000_000
seed = 1
[evaluate]
window = "drive"
drive = "slow"
metrics = ["stroke", "time_ratio", "pressure_angle_max", "turning_margin", "slider_acceleration_peak_cycle", "cv"]
[constraints]
stroke = { min = 149, max = 151 }
pressure_angle_max = { max = 35 }
turning_margin = { min = 5 }
[rank]
metrics = ["cv", "time_ratio:max", "slider_acceleration_peak_cycle:min"]
"""
START = 65_536
SHARES = (0.98, 0.99, 0.995, 0.997, 0.998, 0.999, 0.9995)


@dataclass
class Run:
    """One run: the times after each commit, and the objectives of the feasible designs with their numbers."""

    name: str
    times: list[tuple[int, float, float]]
    designs: np.ndarray
    values: np.ndarray


def clocked():
    """A function that reports progress, and the list of evaluations, seconds and CPU seconds that it fills."""
    start, cpu = time.perf_counter(), time.process_time()
    times = [(0, 0.0, 0.0)]
    return times, lambda done, _: times.append((done, time.perf_counter() - start, time.process_time() - cpu))


def objectives_of(results):
    """Numbers and objectives, all minimised, of the feasible designs."""
    frame = results.to_pandas()
    frame = frame[frame["feasible"] == 1]
    objectives = [as_objective(text) for text in results.objectives]
    return frame.index.to_numpy(), objectives_to_minimise(
        {o.metric: frame[o.metric].to_numpy() for o in objectives}, objectives
    )


def as_objective(text):
    from explore.model.request import Objective

    name, _, sense = text.partition(":")
    return Objective(name, sense)


def runs(text, folder, evaluations):
    """A Sobol' sweep of as many designs, and a refinement of a small one."""
    found = []
    for name, count in (("start", START), ("sobol", evaluations + START)):
        path = folder / f"{name}.toml"
        path.write_text(text.replace("1_000_000", str(count)))
        study = explore.load_study(path)
        if name == "start":
            explore.sweep(study, folder / "warm.h5")  # compiles
        times, report = clocked()
        results = explore.sweep(study, folder / f"{name}.h5", report_progress=report)
        found.append(Run(name, times, *objectives_of(results)))
    explore.refine(
        folder / "start.h5", folder / "warm-refined.h5", evaluations=len(explore.rank(folder / "start.h5")) + 500
    )
    times, report = clocked()
    results = explore.refine(
        folder / "start.h5", folder / "refined.h5", evaluations=evaluations, report_progress=report
    )
    start = found[0]
    numbers, values = objectives_of(results)
    _, seconds, cpu = start.times[-1]
    times = [(START + n, seconds + wall, cpu + own) for n, wall, own in times]
    found.append(
        Run("refine", times, np.concatenate([start.designs, START + numbers]), np.concatenate([start.values, values]))
    )
    return found


def volume(values, reference):
    """Hypervolume of the values before a reference point."""
    return moocore.hypervolume(np.ascontiguousarray(values), ref=reference) if len(values) else 0.0


def print_study(title, text, evaluations, reference=None, total=None):
    """Run one study and print when each share of the hypervolume is reached."""
    with tempfile.TemporaryDirectory() as folder:
        start, sobol, refined = runs(text, Path(folder), evaluations)
    if reference is None:  # a tenth of the range of the front at the start beyond its worst values
        front = start.values[moocore.is_nondominated(start.values)]
        reference = front.max(axis=0) + 0.1 * np.ptp(front, axis=0)
    total = total or max(volume(run.values, reference) for run in (sobol, refined))
    print(f"\n{title}: {len(start.values):,} of the first {START:,} designs feasible")
    for run in (start, sobol):
        n, wall, cpu = run.times[-1]
        print(f"  sobol  {n:9,} designs {wall:6.2f} s {cpu:6.2f} s CPU {volume(run.values, reference) / total:8.3%}")
    shares, done, front = list(SHARES), 0, np.empty((0, start.values.shape[1]))
    for n, wall, cpu in refined.times:
        stop = np.searchsorted(refined.designs, n)
        front = np.concatenate([front, refined.values[done:stop]])
        front, done = front[moocore.is_nondominated(front)], stop
        share = volume(front, reference) / total
        is_last = n == refined.times[-1][0]
        if is_last or (shares and share >= shares[0]):
            print(f"  refine {n:9,} designs {wall:6.2f} s {cpu:6.2f} s CPU {share:8.3%}", flush=True)
        while shares and share >= shares[0]:
            shares.pop(0)


def main():
    evaluations = int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000
    reference = np.array([0.47, -0.01, -20.0])
    print_study("optimum.toml", OPTIMUM.read_text(encoding="utf-8"), evaluations, reference, 1.5618)
    for title, text in (("wiper", WIPER), ("test rig", RIG), ("slider-crank", SLIDER)):
        print_study(title, text, evaluations)


if __name__ == "__main__":
    main()
