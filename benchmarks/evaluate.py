"""Designs per CPU-second of `explore.evaluate`'s core with the default columns, and the part of sampling.

Run with ``python benchmarks/evaluate.py``. For comparison the same run measures the closed form alone (the cost of a
screened design) and a plain NumPy evaluation of the same samples of velocity and acceleration, 64 per design.
"""

from __future__ import annotations

import statistics
import time

import numpy as np

from explore.evaluation.evaluate import evaluate_columns
from explore.request.names import find_mechanism
from explore.request.requests import make_request

DESIGNS, REPETITIONS = 65_536, 9


def numpy_loop(lengths, angles):
    """Mean and variance of four signals by whole-array NumPy in cache-sized blocks, textbook vector formulas."""
    out = np.empty((8, len(lengths)))
    for first in range(0, len(lengths), 256):
        r1, r2, r3, r4 = lengths[first : first + 256].T[:, :, None]
        bx, by = r1 * np.cos(angles), r1 * np.sin(angles)
        dx, dy = r4 - bx, -by
        d2 = dx * dx + dy * dy
        area = 0.5 * np.sqrt((d2 - (r2 - r3) ** 2) * ((r2 + r3) ** 2 - d2))
        k, m = 0.5 * (1 + (r2**2 - r3**2) / d2), area / d2
        ux, uy = k * dx - m * dy, k * dy + m * dx
        vx, vy = ux - dx, uy - dy
        w3, w2 = (ux * by - uy * bx) / area, (vx * by - vy * bx) / area
        px, py = -bx - w2**2 * ux + w3**2 * vx, -by - w2**2 * uy + w3**2 * vy
        for s, signal in enumerate((w2, w3, -(px * vx + py * vy) / area, -(px * ux + py * uy) / area)):
            out[s, first : first + 256] = signal.mean(axis=1)
            out[4 + s, first : first + 256] = signal.var(axis=1)
    return out


def main() -> None:
    mechanism, rng = find_mechanism("crank-rocker"), np.random.default_rng(0)
    ranges = {"crank": (60, 140), "coupler": (900, 1000), "rocker": (500, 600), "ground": (700, 800)}
    designs = {name: rng.uniform(*bounds, DESIGNS) for name, bounds in ranges.items()}
    lengths, angles = np.column_stack(list(designs.values())), 2 * np.pi * np.arange(64) / 64
    closed = [metric.name for metric in mechanism.metrics]
    jobs = {
        "default columns, 1e-9": lambda: evaluate_columns(make_request(mechanism), designs),
        "default columns, 1e-6": lambda: evaluate_columns(make_request(mechanism, tolerance=1e-6), designs),
        "default columns, 1e-12": lambda: evaluate_columns(make_request(mechanism, tolerance=1e-12), designs),
        "closed form only": lambda: evaluate_columns(make_request(mechanism, metrics=closed), designs),
        "NumPy, 64 equispaced": lambda: numpy_loop(lengths, angles),
    }
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for repetition in range(REPETITIONS + 1):
        for name, job in jobs.items():
            start = time.process_time()
            job()
            if repetition:  # the first run warms up
                seconds[name].append(time.process_time() - start)
    rates = {name: DESIGNS / statistics.median(times) for name, times in seconds.items()}
    for name, rate in rates.items():
        ratio = rate / rates["NumPy, 64 equispaced"]
        print(f"{name:24s}{rate / 1e6:8.2f} million designs per CPU-second, {ratio:6.1f} x NumPy")


if __name__ == "__main__":
    main()
