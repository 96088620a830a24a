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

from explore.base.compiling import LANES
from explore.evaluation.quadrature.tails import fill_roots
from explore.evaluation.quadrature.tiles import DEVIATIONS, FILL_TYPE, INTEGRAL, SUMS_SIZE, fill_moments
from explore.mechanisms import four_bar
from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER

FLAGS = ("-O3", "-march=native", "-ffast-math", "-shared", "-fPIC")
NODES = 64
NEEDS = four_bar.VELOCITIES | four_bar.ACCELERATIONS
CRANK_ROCKER_CONSTANTS = CRANK_ROCKER.n_constants
_F2 = types.float64[:, ::1]


@njit(types.void(FILL_TYPE, _F2, _F2, types.float64, _F2), error_model="numpy", nogil=True)
def compiled(fill, lengths, tangents, weight, out):
    """The project's functions in a loop over tiles, the mechanism passed in as in explore.evaluation.quadrature.loop.

    A row of `tangents` is half-tangents from one anchor.
    """
    count = tangents.shape[1]
    constants, masses = np.empty(CRANK_ROCKER_CONSTANTS * LANES), np.empty(LANES)
    nodes, rows = np.empty((2, count * LANES)), four_bar.SIGNAL_ROWS
    sums, flags = np.empty(rows * SUMS_SIZE), (np.arange(rows) < 4).astype(np.int64)
    signals, weights = np.empty(2 * count * rows * LANES), np.full(2 * count * LANES, weight)
    # whatever the factors, the tails of the check cost the same
    roots, factors = np.empty(2 * count * LANES), np.ones(4 * count)
    for anchor in range(2):
        for j in range(count):
            for lane in range(LANES):
                nodes[anchor, j * LANES + lane] = tangents[anchor, j]
    for start in range(0, len(lengths), LANES):
        for lane in range(LANES):
            crank, coupler, rocker, ground = lengths[start + lane]
            four_bar.prepare(crank, coupler, rocker, ground, 1.0, constants, lane)
        for anchor in range(2):
            fill(constants, nodes[anchor], anchor, 0, 0, count, NEEDS, signals[anchor * count * rows * LANES :])
        fill_roots(weights, 2 * count, False, roots)
        fill_moments(signals, rows, flags, 2 * count, weights, roots, factors, masses, sums)
        for s in range(4):
            for lane in range(LANES):
                out[start + lane, s] = sums[s * SUMS_SIZE + INTEGRAL + lane] / masses[lane]
                out[start + lane, 4 + s] = sums[s * SUMS_SIZE + DEVIATIONS + lane] / masses[lane]


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
    near = cos_half**2 > 0.5
    tangents = np.array([(sin_half / cos_half)[near], (-cos_half / sin_half)[~near]])
    ours, theirs = np.empty((n, 8)), np.empty((n, 8))
    with tempfile.TemporaryDirectory() as folder:
        run = hand_written(folder)
        jobs = {
            "compiled": lambda: compiled(CRANK_ROCKER.fill, lengths, tangents, weight[0], ours),
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
