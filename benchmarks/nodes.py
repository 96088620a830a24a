"""Number of nodes towards the change point, in comparison with equispaced samples.

Run with ``python benchmarks/nodes.py``. A crank-rocker whose Grashof margin shrinks by powers of two, so that it is
exact; the variance of the rocker velocity over a turn to 1e-9. The equispaced (trapezoidal) rule converges
geometrically for periodic functions, at a rate that is the distance of the nearest singularity, which shrinks like the
root of the margin. Its number of samples is found by trial, and the error of 360 samples is measured.
"""

import numpy as np

import explore
from explore.comparison.methods.loops import find_loop
from explore.mechanisms.registry import MECHANISMS

TOLERANCE, CHUNK = 1e-9, 65_536
CRANK, COUPLER, ROCKER, GROUND = 150.0, 1083.5, 541.75, 691.75
#: Grashof margins in mm.
MARGINS = 2.0 ** -np.arange(-7, 31, 4)


def evaluate(metrics, window):
    """Evaluate the designs of all margins."""
    fixed = np.ones(len(MARGINS))
    designs = {"crank": CRANK * fixed, "coupler": COUPLER * fixed, "rocker": ROCKER * fixed, "ground": GROUND + MARGINS}
    return explore.evaluate("crank-rocker", designs, metrics=metrics, window=window, tolerance=TOLERANCE)


def node_counts(window):
    """Nodes at each margin, where the other mean makes the designs be sampled for both."""
    return evaluate(["rocker_velocity_variance", "transmission_angle_mean"], window)["nodes"].to_numpy()


def equispaced_variance(margin, count):
    """Variance of the rocker velocity from equispaced samples of the turn; its mean is exactly 0."""
    loop, total = find_loop(MECHANISMS["crank-rocker"]), 0.0
    motion = loop.closed.close(loop.columns(np.array([[CRANK], [COUPLER], [ROCKER], [GROUND + margin], [1.0]])))
    for start in range(0, count, CHUNK):
        angles = 2.0 * np.pi * np.arange(start, min(start + CHUNK, count))[None, :] / count
        velocity = motion.fill(angles, 4)[3]
        total += float(np.sum(velocity**2))
    return total / count


def equispaced_count(margin, variance):
    """Samples that the equispaced rule needs, to within 20 %."""
    count = 16
    while abs(equispaced_variance(margin, count) / variance - 1.0) > TOLERANCE:
        count = int(1.2 * count)
    return count


def measure():
    """Relative margin, nodes of the drive stroke and of the turn, equispaced samples, error of 360 samples."""
    exact = evaluate(["rocker_velocity_variance"], "cycle")["rocker_velocity_variance"].to_numpy()
    samples = [equispaced_count(margin, variance) for margin, variance in zip(MARGINS, exact, strict=True)]
    errors = [
        abs(equispaced_variance(margin, 360) / variance - 1.0) for margin, variance in zip(MARGINS, exact, strict=True)
    ]
    relative_margins = MARGINS / np.maximum(COUPLER, GROUND + MARGINS)
    return zip(relative_margins, node_counts("drive"), node_counts("cycle"), samples, errors, strict=True)


def main() -> None:
    print("margin/longest    nodes: drive   turn   equispaced   ratio   error of 360 samples")
    for relative_margin, stroke, turn, samples, error in measure():
        print(f"{relative_margin:14.1e} {stroke:15,} {turn:6,} {samples:12,} {samples / turn:7.1f} {error:22.1e}")


if __name__ == "__main__":
    main()
