"""Seconds and peak memory of ranking a results file, against reading the same columns and ranking them all at once.

Run with ``python benchmarks/rank.py [folder] [designs]``: 10^7 designs by default, which take 1.3 GB in the folder for
some minutes and are deleted at the end. Each line is a new process. The peers are a few lines of h5py and moocore on
whole columns; they must find as many designs. CPU seconds are compared, because the wall time depends on other users of
the disk.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

#: The ranges of configs/optimum.toml with its constraints, and ranges in which every crank turns, without constraints.
STUDIES = {
    "constrained": """mechanism = "crank-rocker"
[parameters]
crank = 50
coupler = {{ min = 50, max = 1000 }}
rocker = {{ min = 50, max = 500 }}
ground = {{ min = 50, max = 1000 }}
[sampling]
method = "sobol"
count = {count}
[evaluate]
metrics = ["swing_angle", "time_ratio", "mean_output_ratio", "transmission_angle_min", "transmission_angle_max", "cv"]
[constraints]
transmission_angle_min = {{ min = 30 }}
transmission_angle_max = {{ max = 150 }}
[rank]
metrics = ["cv", "mean_output_ratio:max", "transmission_angle_min:max"]
""",
    "all turn": """mechanism = "crank-rocker"
[parameters]
crank = {{ min = 60, max = 140 }}
coupler = {{ min = 900, max = 1000 }}
rocker = {{ min = 500, max = 600 }}
ground = {{ min = 700, max = 800 }}
[sampling]
method = "sobol"
count = {count}
[evaluate]
metrics = ["swing_angle", "time_ratio", "mean_output_ratio", "transmission_angle_min", "cv"]
[rank]
metrics = ["cv", "mean_output_ratio:max", "transmission_angle_min:max"]
""",
}
_READ = """
import sys, h5py, numpy as np
with h5py.File(sys.argv[1]) as file:
    node = file["designs"]
    names = ("cv", "mean_output_ratio", "transmission_angle_min")
    values = np.column_stack([node[name][:] for name in names]) * (1, -1, -1)
    feasible = node["feasible"][:] != 0
"""
PEERS = {
    "h5py, columns read only": _READ + "print(np.count_nonzero(feasible & np.isfinite(values).all(axis=1)))",
    "h5py and moocore, all at once": _READ
    + "import moocore\nvalues = values[feasible & np.isfinite(values).all(axis=1)]\n"
    + "print(np.count_nonzero(moocore.is_nondominated(values, keep_weakly=True)))",
}
RANKINGS: dict[str, list[str]] = {
    "first front": [],
    "--fronts 5": ["--fronts", "5"],
    "--where": ["--where", "swing_angle > 20 and time_ratio < 1.3"],
    "--limit": ["--limit", "transmission_angle_min>=40"],
    "--quality": ["--quality"],
    "five objectives": ["--metric", "cv", "--metric", "swing_angle:max", "--metric", "time_ratio:min",
                        "--metric", "mean_output_ratio:max", "--metric", "transmission_angle_min:max"],
}  # fmt: skip
#: Random rows, normal or on a sphere, where all are in the front.
_RANDOM = """
import sys, explore, numpy as np, pandas as pd
shape, columns = sys.argv[1], int(sys.argv[2])
values = np.random.default_rng(1).standard_normal((10**6, columns))
if shape == "sphere":
    values = np.abs(values) / np.linalg.norm(values, axis=1, keepdims=True)
table = pd.DataFrame(values, columns=[*"abcde"][:columns])
print(len(explore.rank(table, objectives=[name + ":min" for name in table])))
"""


def measure(command: list[str]) -> tuple[float, float, float, str]:
    """Wall and CPU seconds and peak resident MB of a new process, and its last line of output."""
    start = time.perf_counter()
    with tempfile.TemporaryFile("w+") as printed:
        process = subprocess.Popen([sys.executable, *command], stdout=printed, stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.perf_counter() - start
        printed.seek(0)
        last = (printed.read().splitlines() or [""])[-1]
    if status:
        raise SystemExit(f"{' '.join(command)} failed")
    return seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, last


def report(
    label: str, command: list[str], table: Path | None = None, reference: float | None = None
) -> tuple[float, str]:
    """Print a line; return the CPU seconds and the number of optimal designs."""
    wall, cpu, memory, last = measure(command)
    n_optimal = str(len(table.read_text().splitlines()) - 1) if table is not None else last
    relative = f"{cpu / reference:7.2f} x" if reference else ""
    print(f"{label:32s}{wall:7.1f} s{cpu:7.1f} s{memory:7.0f} MB{int(n_optimal):11,}{relative}", flush=True)
    return cpu, n_optimal


def measure_study(folder: Path, name: str, count: int) -> None:
    """Sweep a study and measure all rankings of it."""
    config, results, table = folder / "study.toml", folder / "study.h5", folder / "front.csv"
    config.write_text(STUDIES[name].format(count=count))
    measure(["-m", "explore", "sweep", str(config), "-o", str(results), "--quiet"])
    print(f"\n{name}: {count:,} designs, {results.stat().st_size / 1e9:.2f} GB")
    reference, n_expected = 0.0, ""
    for label, code in PEERS.items():
        reference, n_expected = report(label, ["-c", code, str(results)])
    for label, options in RANKINGS.items():
        if label == "five objectives" and "[constraints]" not in STUDIES[name]:
            continue  # nearly all designs are in that front
        command = ["-m", "explore", "rank", str(results), "--top", "1", "-o", str(table), *options]
        _, n_optimal = report(f"explore rank, {label}", command, table, reference)
        if label in ("first front", "--quality") and n_optimal != n_expected:
            raise SystemExit(f"explore found {n_optimal} designs, moocore {n_expected}")
    results.unlink()


def main() -> None:
    count = int(float(sys.argv[2])) if len(sys.argv) > 2 else 10**7
    print(f"{'':32s}{'wall':>9}{'CPU':>9}{'memory':>10}{'found':>11}   CPU: all at once = 1")
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else ".") as folder:
        for name in STUDIES:
            measure_study(Path(folder), name, count)
    print("\na table of random numbers: 1,000,000 rows")
    report("four normal columns", ["-c", _RANDOM, "normal", "4"])
    report("three columns on a sphere", ["-c", _RANDOM, "sphere", "3"])
    report("five columns on a sphere", ["-c", _RANDOM, "sphere", "5"])


if __name__ == "__main__":
    main()
