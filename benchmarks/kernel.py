"""The compiled kernel against a hand-fused C loop: the same job, one core, CPU time, interleaved, medians.

Crank-rocker; mean and variance (two passes) of coupler and rocker velocity and acceleration at 64 given crank angles.
``python benchmarks/kernel.py [--designs 65536] [--repetitions 15]``; needs gcc.
"""

import argparse
import ctypes
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from numba import njit, types

from explore.mechanisms import four_bar
from explore.quadrature.loop import FILL_TYPE
from explore.quadrature.moments import mean_and_variance

FLAGS = ("-O3", "-march=native", "-ffast-math", "-shared", "-fPIC")
NODES = 64
NEEDS = four_bar.VELOCITIES | four_bar.ACCELERATIONS
_F1, _F2 = types.float64[::1], types.float64[:, ::1]


@njit(types.void(FILL_TYPE, _F2, _F1, _F1, _F1, types.float64, _F2), error_model="numpy", nogil=True)
def compiled(fill, lengths, sin_half, cos_half, weight, length, out):
    """The project's functions in a loop over designs, the mechanism passed in as in explore.quadrature.loop."""
    count = len(sin_half)
    row, scratch = np.empty(four_bar.FOUR_BAR_SIZE), np.empty((four_bar.SIGNAL_ROWS, count))
    for i in range(len(lengths)):
        four_bar.prepare(lengths[i, 0], lengths[i, 1], lengths[i, 2], lengths[i, 3], 1.0, row)
        fill(row, sin_half, cos_half, count, NEEDS, scratch)
        for s in range(4):
            out[i, s], out[i, 4 + s] = mean_and_variance(scratch, s, weight, count, length, 0.0)


def hand_written(folder):
    """The C function, compiled."""
    library = Path(folder) / "kernel.so"
    subprocess.run(["gcc", *FLAGS, "-o", library, Path(__file__).with_name("kernel.c"), "-lm"], check=True)
    run = ctypes.CDLL(str(library)).run
    array = np.ctypeslib.ndpointer(np.float64, flags="C")
    run.argtypes = [ctypes.c_long, array, ctypes.c_long, array, array, array, ctypes.c_double, array]
    run.restype = None
    return run


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--designs", type=int, default=65_536)
    parser.add_argument("--repetitions", type=int, default=15)
    arguments = parser.parse_args()
    n, rng = arguments.designs, np.random.default_rng(0)
    lengths = np.column_stack([rng.uniform(*r, n) for r in ((60, 140), (900, 1000), (500, 600), (700, 800))])
    half = np.pi * (np.arange(NODES) + 0.5) / NODES
    sin_half, cos_half, weight = np.sin(half), np.cos(half), np.full(NODES, 2 * np.pi / NODES)
    ours, theirs = np.empty((n, 8)), np.empty((n, 8))
    with tempfile.TemporaryDirectory() as folder:
        run = hand_written(folder)
        jobs = {
            "compiled": lambda: compiled(four_bar.fill, lengths, sin_half, cos_half, weight, 2 * np.pi, ours),
            "C": lambda: run(n, lengths, NODES, sin_half, cos_half, weight, 2 * np.pi, theirs),
        }
        seconds = {name: [] for name in jobs}
        for job in jobs.values():
            job()
        for _ in range(arguments.repetitions):
            for name, job in jobs.items():
                start = time.process_time()
                job()
                seconds[name].append(time.process_time() - start)
    rms = np.sqrt(theirs[:, :4] ** 2 + theirs[:, 4:])
    difference = max(np.max(np.abs(ours - theirs)[:, :4] / rms), np.max(np.abs(ours - theirs)[:, 4:] / rms**2))
    rate = {name: n * NODES / statistics.median(times) / 1e6 for name, times in seconds.items()}
    for name in jobs:
        print(f"{name:10s}{rate[name]:8.0f} million samples/s")
    print(f"ratio     {rate['compiled'] / rate['C']:8.2f}   (target 0.8; results differ by {difference:.1e})")


if __name__ == "__main__":
    main()
