"""Intervals of gear pairs and of their drives: each statistic alone against `exact_gears`."""

import mpmath as mp
import numpy as np
from campaign_families import Row, measure
from exact_gears import DIGITS, Drive, ExactGears

import explore
from explore.mechanisms.registry import MECHANISMS

#: Signals of one train.
SIGNALS = tuple(signal.name for signal in MECHANISMS["gears"].signals if hasattr(ExactGears, f"_{signal.name}"))
CONSTANTS = ["law_constant", "return_amplitude", "return_frequency", "return_shift", "return_mean"]
#: What the reference of several trains errs by at most, in double precision.
_ROUNDING = 1e-12


def gear_pair(rng):
    """A random pair, as a design and exactly."""
    order = int(rng.integers(4))
    design = {
        "growth": float(np.exp(rng.uniform(0.02, 1.0))), "sector": float(rng.uniform(1.0, 5.4)),
        "centre_distance": 150.0, "return_order": float(order), "trains": float(rng.integers(2, 5)),
        "branch": 1.0 if order else float(rng.integers(1, 4)), "phase_shift": float(rng.uniform(0.0, 3.0)),
    }  # fmt: skip
    row = explore.evaluate("gears", design, metrics=CONSTANTS).iloc[0]
    k, amplitude, frequency, shift, mean = (float(row[name]) for name in CONSTANTS)
    # three digits of the kernel's solution, of which there is one on each branch
    start = [k * amplitude, frequency, frequency * (design["sector"] - shift), k * mean]
    return design, ExactGears(design, [mp.mpf(f"{value:.3g}") for value in start])


def intervals_of_gears(count, seed=0):
    """Intervals of 1 to 300 deg, also across angle 0, of one signal of each pair, and of the drive of every tenth."""
    rng, rows = np.random.default_rng(seed), []
    for number in range(count):
        mp.mp.dps = DIGITS
        design, exact = gear_pair(rng)
        start = int(rng.integers(-90, 270))
        stop = start + int(10.0 ** rng.uniform(0.0, 2.47))
        signal = "overall_ratio" if number % 10 == 9 else str(rng.choice(SIGNALS))
        if signal == "driven_angle" and start // 360 != (stop - 1) // 360:
            stop = 360 * (start // 360 + 1)  # it begins again there
        if signal == "overall_ratio":
            mean, square, low, high = map(mp.mpf, Drive(exact).statistics(np.radians(start), np.radians(stop)))
        else:
            mean, square, low, high = exact.statistics(signal, start * mp.pi / 180, stop * mp.pi / 180)
        rms, largest = mp.sqrt(square), max(abs(low), abs(high))
        truths = {"mean": (mean, rms), "rms": (rms, rms), "min": (low, largest), "max": (high, largest)}
        for statistic, (truth, scale) in truths.items():
            # `ratio_max` alone is a metric of the whole turn
            metric = f"{signal}_{statistic}_interval"
            tolerance = float(rng.choice([1e-6, 1e-9, 1e-12]))
            row = measure("gears", design, metric, truth, scale, tolerance, window={"from": start, "to": stop})
            rounding = _ROUNDING if signal == "overall_ratio" else 0.0
            rows.append(Row(max(row.error - rounding, 0.0), row.bound, row.what))
    return rows
