"""Families of a campaign: what each row errs by over its bound, against true values of another road.

The true values share nothing with the kernels: mpmath on the defining equations, with 40 digits.
"""

from dataclasses import dataclass
from itertools import pairwise

import mpmath as mp
import numpy as np
from exact_linkage import ExactLinkage
from exact_slider_crank import ExactSliderCrank
from exact_variable_crank import DIGITS, ExactVariableCrank

import explore

OK, TOLERANCE_NOT_MET = 1, 7


@dataclass(frozen=True)
class Row:
    """True error of one statistic in the norm of its bound, the bound, and what it is."""

    error: float
    bound: float
    what: str

    @property
    def ratio(self):
        """How many times its bound it errs; a bound of 0 promises an exact value."""
        return self.error / self.bound if self.bound > 0.0 else np.inf if self.error > 0.0 else 0.0


def assert_few_above(rows):
    """At most 0.1 % of the rows, one in any number of them, are above their bound, and none above 10 times."""
    worst = max(rows, key=lambda row: row.ratio)
    assert worst.ratio <= 10.0, worst
    assert sum(row.ratio > 1.0 for row in rows) <= max(1, len(rows) // 1000), worst


def measure(mechanism, design, metric, truth, scale, tolerance, **request):
    """The row of one metric, requested alone; None where the status is that of no computed design."""
    table = explore.evaluate(mechanism, design, metrics=[metric], tolerance=tolerance, **request)
    value, bound, status = float(table[metric][0]), float(table["error"][0]), int(table["status"][0])
    assert status in (OK, TOLERANCE_NOT_MET), (mechanism, design, metric, status)
    assert (bound <= tolerance) == (status == OK)
    if not np.isfinite(value):  # a cv whose mean is too small
        assert metric.endswith("_cv")
        return None
    error = float(abs(mp.mpf(value) - truth) / scale) if scale != 0 else float(abs(mp.mpf(value) - truth))
    return Row(
        error, bound, f"{mechanism} {design} {metric} {request} {tolerance:g}: {value!r} for {mp.nstr(truth, 20)}"
    )


def _taylor_statistics(signal, start, length):
    """Statistics of a smooth signal over an interval much shorter than its own scale, and the scale of each."""
    nodes = [(mp.mpf(1) + x * mp.sqrt(mp.mpf(3) / 5)) / 2 for x in (-1, 0, 1)]
    weights = [mp.mpf(5) / 18, mp.mpf(8) / 18, mp.mpf(5) / 18]
    values = [signal(start + length * node) for node in nodes]
    ends = [signal(start), signal(start + length)]
    mean = sum(w * v for w, v in zip(weights, values, strict=True))
    variance = sum(w * (v - mean) ** 2 for w, v in zip(weights, values, strict=True))
    rms = mp.sqrt(mean**2 + variance)
    largest = max(map(abs, ends))
    return {
        "mean": (mean, rms), "variance": (variance, rms**2), "std": (mp.sqrt(variance), rms), "rms": (rms, rms),
        "cv": (mp.sqrt(variance) / abs(mean), mp.sqrt(variance) / abs(mean)),
        "min": (min(ends), largest), "max": (max(ends), largest),
    }  # fmt: skip


def _signals_of(mechanism, rng):
    """A random design, and functions of the input angle, rad, for signals that vary over every short interval."""
    if mechanism == "slider-crank":
        design = {"crank": 50.0, "rod": float(rng.uniform(120, 400)), "offset": float(rng.uniform(-20, 20))}
        exact = ExactSliderCrank(**design)
        numbers = {"slider_position": 0, "slider_velocity": 1, "slider_acceleration": 2, "rod_angle": 3}
        degrees = 180 / mp.pi
        return design, {
            name: (lambda theta, k=k: exact.motion(theta)[k] * (degrees if k == 3 else 1))
            for name, k in numbers.items()
        }
    if mechanism == "crank-rocker":
        design = {"crank": 50.0, "coupler": float(rng.uniform(150, 190)), "rocker": float(rng.uniform(110, 140)),
                  "ground": float(rng.uniform(140, 190))}  # fmt: skip
        exact = ExactLinkage(*design.values())
        return design, {
            name: (lambda theta, k=k: exact.signals(theta)[k])
            for k, name in enumerate(("coupler_velocity", "rocker_velocity", "coupler_acceleration"))
        }
    design = {"rod": float(rng.uniform(150, 500)), "slider_speed": float(rng.uniform(100, 300)), "speed": 5.0,
              "reversal_time": 0.05, "blend_order": 2}  # fmt: skip
    exact = ExactVariableCrank(**design)
    turn = 2 * mp.pi
    return design, {
        "slider_position": lambda theta: exact.position(theta % turn),
        "crank": lambda theta: exact.crank(theta % turn),
    }


def short_and_shifted_intervals(count, seed=0):
    """Intervals from 1e-2 to 1e-12 deg wide, some of them many turns from 0, on three mechanisms."""
    rng, rows = np.random.default_rng(seed), []
    statistics = ("mean", "variance", "std", "rms", "cv", "min", "max")
    for number in range(count):
        mp.mp.dps = DIGITS
        mechanism = ("slider-crank", "crank-rocker", "variable-crank")[number % 3]
        design, signals = _signals_of(mechanism, rng)
        name = list(signals)[rng.integers(len(signals))]
        # a decimal text is exact: turns are too
        digits, turns = int(rng.integers(3, 13)), int(rng.choice([0, 0, 1, -1, 10**6, 10**9, -(10**12)]))
        start, width = mp.mpf(int(rng.integers(30_000, 80_000))) / 1000, mp.mpf(10) ** -digits
        texts = [
            f"{mp.nstr(place + 360 * turns, 40, min_fixed=-50, max_fixed=50)} deg" for place in (start, start + width)
        ]
        known = _taylor_statistics(signals[name], start * mp.pi / 180, width * mp.pi / 180)
        statistic = statistics[rng.integers(len(statistics))]
        truth, scale = known[statistic]
        rows.append(
            measure(
                mechanism, design, f"{name}_{statistic}", truth, scale, float(rng.choice([1e-6, 1e-9, 1e-12])),
                window=dict(zip(("from", "to"), texts, strict=True)),
            )
        )  # fmt: skip
    return [row for row in rows if row is not None]


def _largest(function, edges, parts):
    """The largest value of a function over consecutive pieces: the best of samples, refined by golden sections."""
    grid = [a + (b - a) * k / parts for a, b in pairwise(edges) for k in range(parts)] + [edges[-1]]
    values = [function(place) for place in grid]
    best = max(range(len(grid)), key=values.__getitem__)
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    for _ in range(30):
        left, right = low + (high - low) * mp.mpf("0.382"), low + (high - low) * mp.mpf("0.618")
        low, high = (left, high) if function(left) < function(right) else (low, right)
    return max(values[best], function((low + high) / 2))


#: Integrals of the smoothsteps of `exact_variable_crank`, by order.
_INTEGRALS = {
    1: lambda s: s**3 - s**4 / 2,
    2: lambda s: s**4 * 5 / 2 - 3 * s**5 + s**6,
    3: lambda s: 7 * s**5 - 14 * s**6 + 10 * s**7 - s**8 * 5 / 2,
}


class _FastVariableCrank(ExactVariableCrank):
    """With the integral of the speed's polynomials in place of a quadrature."""

    def _path(self, angle):
        half, integral = self.width / 2, _INTEGRALS[self.order]

        def near(place):
            return 2 * self.width * (integral(place / self.width + mp.mpf(1) / 2) - integral(mp.mpf(1) / 2)) - place

        if angle <= half:
            return near(angle)
        steady = min(angle, mp.pi - half) - half
        return near(half) + steady + (near(half) - near(mp.pi - angle) if angle > mp.pi - half else 0)


def short_reversals(count, seed=0):
    """Variable cranks whose reversals are 1e-10 to 1e-3 rad wide: rates of the crank, and ends of the velocity."""
    rng, rows = np.random.default_rng(seed), []
    for _ in range(count):
        mp.mp.dps = DIGITS
        speed = float(rng.uniform(3, 10))
        design = {"rod": 10.0 ** rng.uniform(2, 5), "slider_speed": 10.0 ** rng.uniform(1, 3), "speed": speed,
                  "reversal_time": 10.0 ** rng.uniform(-10, -3) / speed,
                  "blend_order": int(rng.integers(1, 4))}  # fmt: skip
        if design["slider_speed"] * np.pi / speed > design["rod"]:
            continue  # the slider would reach the shaft
        exact, tolerance = _FastVariableCrank(**design), float(rng.choice([1e-6, 1e-9, 1e-12]))
        half, tiny = exact.width / 2, mp.mpf(10) ** -30

        def rate(angle, exact=exact):
            return abs(exact.speed * exact.crank_slope(angle))

        # beside a law's end the rate bends within a small part of the reversal
        shares = [1 - mp.mpf(10) ** -k for k in range(1, 8)]
        edges = [tiny, *(half * share for share in shares), half, mp.pi / 2, mp.pi - half,
                 *(mp.pi - half * share for share in reversed(shares)), mp.pi - tiny]  # fmt: skip
        peak = _largest(rate, edges, 6)
        rows.append(measure("variable-crank", design, "crank_rate_peak", peak, peak, tolerance))
        wanted = exact.wanted
        rows.append(
            measure(
                "variable-crank", design, "slider_velocity_max", mp.mpf(0), wanted, tolerance, window="outer_to_inner"
            )
        )
        share = 2 * exact._path(half) / mp.pi + 1 - 2 * half / mp.pi
        mean = wanted * share
        rows.append(
            measure("variable-crank", design, "slider_velocity_mean", mean, mean, tolerance, window="inner_to_outer")
        )
    return rows


def long_rods(count, seed=0):
    """Slider-cranks with rods of 10 to 1e9 cranks at three tolerances: extremes of acceleration and velocity."""
    rng, rows = np.random.default_rng(seed), []
    for _ in range(count):
        crank = 100.0
        design = {"crank": crank, "rod": crank * 10.0 ** rng.uniform(1, 9), "offset": float(rng.uniform(-1, 1)) * crank}
        exact = ExactSliderCrank(**design)
        for name, number, rate, near in (("slider_acceleration_max", 2, 6, mp.pi), ("slider_acceleration_min", 2, 6, 0),
                                         ("slider_velocity_max", 1, 2, -mp.pi / 2)):  # fmt: skip
            at = mp.findroot(lambda theta, k=rate, exact=exact: exact.motion(theta)[k], mp.mpf(near))
            other = {"slider_acceleration_max": mp.mpf(0), "slider_acceleration_min": mp.pi}.get(name, mp.pi / 2)
            other = mp.findroot(lambda theta, k=rate, exact=exact: exact.motion(theta)[k], other)
            truth = exact.motion(at)[number]
            scale = max(abs(truth), abs(exact.motion(other)[number]))
            for tolerance in (1e-6, 1e-9, 1e-12):
                rows.append(measure("slider-crank", design, name, truth, scale, tolerance, window="cycle"))
    return rows
