"""Linkages of tables beside built-in mechanisms and others: ``python benchmarks/linkages.py``.

CPU time of designs, the request apart: status, means and variances of signals over the turn at a tolerance of 1e-9,
with their bounds. Ratios are to the built-in mechanism of the same linkage, in the same run, the least of seven.
"""

import json
import tempfile
import time
import tomllib
from pathlib import Path

import numpy as np

from explore import Linkage
from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms.linkages import declaration, native_code
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

COUNT = 20_000
REFERENCE = Path(__file__).parents[1] / "tests" / "reference" / "linkages.json"
#: Built-in mechanism of the same linkage, its names of the parameters, and signals by their names there.
TWINS = {
    "hoecken": ("crank-rocker", {"r1": "crank", "r2": "coupler", "r3": "rocker", "r4": "ground"},
                ("coupler_velocity", "rocker_velocity", "coupler_acceleration", "rocker_acceleration")),
    "slider-crank": ("slider-crank", {"r": "crank", "l": "rod", "e": "offset"},
                     ("slider_velocity", "slider_acceleration")),
}  # fmt: skip
SIGNALS = {
    "hoecken": ("coupler_velocity", "rocker_velocity", "coupler_acceleration", "rocker_acceleration"),
    "slider-crank": ("guide_velocity", "guide_acceleration"),
    "watt-2": ("output_velocity", "output_acceleration", "rocker_velocity", "rocker_acceleration"),
    "crank-shaper": ("ram_velocity", "ram_acceleration", "lever_velocity", "lever_acceleration"),
    "stephenson-2": ("coupler_velocity", "coupler_acceleration", "rocker_velocity", "rocker_acceleration"),
    "jansen": ("T_velocity_x", "T_velocity_y", "T_acceleration_x", "T_acceleration_y"),
}


def seconds_of(mechanism, signals, designs):
    """CPU time of the designs, the least of seven, and their results."""
    metrics = [f"{signal}_{statistic}" for signal in signals for statistic in ("mean", "variance")]
    request = make_request(find_mechanism(mechanism), metrics=metrics, window="cycle", tolerance=1e-9)
    times = []
    for _ in range(7):
        start = time.process_time()
        evaluation = evaluate_columns(request, designs)
        times.append(time.process_time() - start)
    return min(times[1:]), evaluation.columns


def first_seconds(linkage, signals, values):
    """CPU times of the first design when the loop is compiled: with an empty cache of machine code, and from it."""
    metrics = [f"{signal}_{statistic}" for signal in signals for statistic in ("mean", "variance")]
    times = []
    with tempfile.TemporaryDirectory() as folder:
        native_code._folder = lambda: Path(folder)
        for _ in range(2):
            declaration.linkage_mechanism.cache_clear()
            declaration._specialise.cache_clear()
            start = time.process_time()
            request = make_request(Linkage(linkage.content).mechanism, metrics=metrics, window="cycle", tolerance=1e-9)
            evaluate_columns(request, {key: np.array([value]) for key, value in values.items()})
            times.append(time.process_time() - start)
        if len(list(Path(folder).iterdir())) < 3:
            raise RuntimeError("the functions were not translated anew")
    return times


def main() -> None:
    """Print a line for each linkage."""
    rng = np.random.default_rng(1)
    cases = {case["name"]: case for case in json.loads(REFERENCE.read_text())["cases"]}
    for name, signals in SIGNALS.items():
        linkage = Linkage(tomllib.loads(cases[name]["table"]))
        values = {key: float(value) for key, value in cases[name]["parameters"].items()}
        if name == "hoecken":  # with four lengths of its own
            section = {**linkage.content, "frame": {"O": [0, 0], "C": ["r4", 0]}}
            section["links"] = {
                "crank": {"O": 0, "A": "r1"}, "coupler": {"A": 0, "B": "r2"}, "rocker": {"C": 0, "B": "r3"},
            }  # fmt: skip
            linkage, values = Linkage(section), {"r1": 30.0, "r2": 90.0, "r3": 70.0, "r4": 100.0}
        spread = 0.12 if name in ("jansen", "stephenson-2") else 0.05 if name == "hoecken" else 0.25
        designs = {key: value * (1.0 + spread * rng.uniform(-1.0, 1.0, COUNT)) for key, value in values.items()}
        own, columns = seconds_of(linkage, signals, designs)
        ok = int(np.count_nonzero(columns["status"] == 1))
        nodes = np.median(columns["nodes"][columns["status"] == 1])
        line = f"{name:13} {COUNT / own:10,.0f} designs/s ({ok:,} of {COUNT:,} turn), {nodes:.0f} nodes"
        if name in TWINS:
            twin, names, theirs = TWINS[name]
            renamed = {names[key]: column for key, column in designs.items()}
            other, _ = seconds_of(twin, theirs, renamed)
            velocities = [[each for each in both if "velocity" in each] for both in (signals, theirs)]
            alone = seconds_of(linkage, velocities[0], designs)[0] / seconds_of(twin, velocities[1], renamed)[0]
            line += f"; {own / other:.2f} x the time of the built-in {twin}, {alone:.2f} x for velocities alone"
        first, again = first_seconds(linkage, signals, values)
        print(f"{line}; first use {first:.2f} s, from the cache {again:.2f} s")


if __name__ == "__main__":
    main()
