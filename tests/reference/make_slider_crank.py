"""Compute slider_crank.npz: hard slider-cranks and their statistics with 60 digits.

Run by hand: ``python tests/reference/make_slider_crank.py`` (about ten minutes on two cores). README.md in this folder
describes the result. The formulas are those of ``tests/exact_slider_crank.py``.
"""

import sys
from multiprocessing import Pool
from pathlib import Path

import mpmath
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from exact_slider_crank import SIGNALS, ExactSliderCrank

SEED, PER_FAMILY = 20261122, 40
FAMILIES = (
    "general",
    "short rod, no offset",
    "short rod, small offset",
    "short rod",
    "short rod, large offset",
    "tiny crank",
    "long rod",
    "scale 1e20",
    "scale 1e-20",
)
#: Crank angles in degrees; designs of the families take them in turn, two and two.
INTERVALS = ((0, 90), (80, 100), (-89, -85), (90, 270), (-30, 45), (100, 101), (-100, -80), (33, 390))


def draw(rng, family):
    """Crank, rod and offset; a short rod is longer than crank plus offset by 1e-12 to 1e-2 of itself."""
    crank, margin = 1.0, 10.0 ** rng.uniform(-12.0, -2.0)
    sign = rng.choice([-1.0, 1.0])
    offset = {
        "short rod, no offset": 0.0,
        "short rod, small offset": 10.0 ** rng.uniform(-12.0, -2.0),
        "short rod": rng.uniform(0.0, 2.0),
        "short rod, large offset": 10.0 ** rng.uniform(0.0, 6.0),
    }.get(family)
    if offset is not None:
        return crank, (crank + offset) * (1.0 + margin), sign * offset
    if family == "tiny crank":
        rod = 10.0 ** rng.uniform(3.0, 9.0)
        return crank, rod, sign * rng.uniform(0.0, 0.999) * (rod - 1.0)
    if family == "long rod":
        return crank, 10.0 ** rng.uniform(1.0, 6.0), sign * 10.0 ** rng.uniform(-3.0, 0.9)
    offset = rng.uniform(0.0, 2.0)
    scale = {"general": rng.uniform(1.0, 300.0), "scale 1e20": 1e20, "scale 1e-20": 1e-20}[family]
    return scale * crank, scale * (crank + offset) * (1.0 + 10.0 ** rng.uniform(-2.0, 1.0)), scale * sign * offset


def statistics(lengths, degrees):
    """Mean, variance, minimum and maximum of the SIGNALS over both strokes, the cycle and an interval, (4, 6, 4)."""
    exact = ExactSliderCrank(*lengths)
    turn = exact.outer + 2 * mpmath.pi
    interval = [mpmath.mpf(int(angle)) * mpmath.pi / 180 for angle in degrees]
    windows = ((exact.outer, exact.inner), (exact.inner, turn), (exact.outer, turn), interval)
    return np.array([exact.statistics(*window) for window in windows], dtype=object).astype(float)


def main():
    rng = np.random.default_rng(SEED)
    lengths = np.array([[draw(rng, family) for _ in range(PER_FAMILY)] for family in FAMILIES])
    which = np.arange(PER_FAMILY) // 2 % len(INTERVALS)
    degrees = np.broadcast_to(np.array(INTERVALS)[which], (len(FAMILIES), PER_FAMILY, 2))
    with Pool(2) as pool:
        designs = zip(lengths.reshape(-1, 3), degrees.reshape(-1, 2), strict=True)
        values = np.array(pool.starmap(statistics, designs, chunksize=4))
    np.savez_compressed(
        Path(__file__).parent / "slider_crank.npz",
        families=np.array(FAMILIES),
        lengths=lengths,
        degrees=degrees,
        statistics=values.reshape(len(FAMILIES), PER_FAMILY, 4, len(SIGNALS), 4),
    )


if __name__ == "__main__":
    main()
