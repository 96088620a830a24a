"""Make near_limits.json: statistics of linkages close to the limits of their assembly, from graphs by mpmath.

Run as ``PYTHONPATH=.:tests python tests/reference/make_near_limits.py``; it takes half an hour. Lengths are random, and
halved towards the limit until doubles tell it no more, then moved away by the margin, a share of the way. Integrals
are those of Gauss-Legendre rules of 24 nodes, on panels that halve towards the minima of all factors and the
reversals of the output.
"""

import json
import math
from itertools import pairwise
from pathlib import Path

import mpmath
import numpy as np
from linkage_cases import CASES, FOUR_BAR, columns, evaluate_graph, find_limits, linkage_of, trace, values_of

from explore import Linkage
from explore.mechanisms.linkages.programs import GREATEST_ROW, LEAST_ROW
from explore.mechanisms.linkages.signals import find_quantities

MARGINS = (1e-6, 1e-8, 1e-10, 1e-12)
#: Linkages with lengths, signals and the number of designs at each margin.
LINKAGES = {
    "four-bar": (
        Linkage(FOUR_BAR),
        {"r1": 30.0, "r2": 90.0, "r3": 70.0, "r4": 100.0},
        ("rocker_velocity", "rocker_acceleration"),
        8,
    ),
    "slider-crank": (
        linkage_of(CASES["slider-crank"]),
        {"r": 55.0, "l": 100.0, "e": 30.0},
        ("rod_velocity", "rod_acceleration", "guide_velocity", "guide_acceleration"),
        8,
    ),
    "watt-2": (
        linkage_of(CASES["watt-2"]),
        values_of(CASES["watt-2"]),
        ("rod_velocity", "output_velocity", "output_acceleration"),
        6,
    ),
}


#: Rate of the output of linkages whose strokes are told, too.
OUTPUTS = {"slider-crank": "guide_velocity"}


def near_limits(mechanism, lengths, count, rng):
    """Designs for each margin, by name."""
    designs = {name: value * (1.0 + 0.25 * rng.uniform(-1.0, 1.0, 300)) for name, value in lengths.items()}
    between, last = find_limits(mechanism, designs, count, rng)
    return {margin: between(last * (1.0 - margin)) for margin in MARGINS}


def gauss_legendre(count):
    """Nodes and weights on [-1, 1]."""
    nodes = [mpmath.mpf(x) for x in np.polynomial.legendre.leggauss(count)[0]]
    weights = []
    for k, x in enumerate(nodes):
        for _ in range(4):
            before, value = mpmath.mpf(1), x
            for n in range(2, count + 1):
                before, value = value, ((2 * n - 1) * x * value - (n - 1) * before) / n
            slope = count * (x * value - before) / (x * x - 1)
            x -= value / slope
        nodes[k] = x
        weights.append(2 / ((1 - x * x) * slope * slope))
    return nodes, weights


def function_of(number, values, outer=mpmath.mpf):
    """A node of the graph as a function of the input angle."""
    return lambda angle: outer(evaluate_graph([number], values, angle)[0])


def minima_of_factors(equations, values):
    """Angles of the minima of factors that are small beside their largest values, rad."""
    angles, places = np.linspace(0.0, 2.0 * math.pi, 2880, endpoint=False), set()
    for factor in equations.factors:
        value, slope = factor.value.terms[:2]
        with mpmath.workdps(20):
            sampled = np.array([float(evaluate_graph([value], values, angle)[0]) for angle in angles])
        is_least = (sampled <= np.roll(sampled, 1)) & (sampled <= np.roll(sampled, -1))
        for k in np.flatnonzero(is_least & (sampled < 0.02 * sampled.max())):
            start = mpmath.mpf(angles[k])
            ends = start - mpmath.mpf("1e-3"), start + mpmath.mpf("1e-3")
            place = mpmath.findroot(function_of(slope, values), ends)
            places.add(place % (2 * mpmath.pi))
    return sorted(places)


def reversals(linkage, equations, values, rate):
    """Angles of the output's least and greatest place, rad, the second one behind the first."""
    kernel = linkage.mechanism.for_signals((), needs_stroke=True)
    constants = kernel.constants(columns(kernel, {name: np.array([value]) for name, value in values.items()}))
    roots = []
    for row in (LEAST_ROW, GREATEST_ROW):
        start = 2 * mpmath.atan(mpmath.mpf(constants[row, 0]))
        ends = start - mpmath.mpf("1e-9"), start + mpmath.mpf("1e-9")
        root = mpmath.findroot(function_of(rate, values), ends, tol=1e-50)
        roots.append(root % (2 * mpmath.pi))
    least, greatest = roots
    return least, greatest if greatest > least else greatest + 2 * mpmath.pi


def panels(places):
    """Ends of panels of a turn that halve towards places, rad."""
    turn = 2 * mpmath.pi
    steps = [mpmath.mpf(k) / 5 for k in (1, 2, 3, 4, 5)] + [mpmath.mpf(2) ** -k / 5 for k in range(1, 28)]
    ends = []
    for start, stop in pairwise([*places, places[0] + turn]):
        half = (stop - start) / 2
        ends += [start, *(start + half * step for step in steps), *(stop - half * step for step in steps)]
    return sorted({*ends, places[0] + turn})


def largest(function, angles, values):
    """The largest value of a function, by golden sections beside its largest sample."""
    k = max(range(len(values)), key=lambda i: values[i])
    turn, ratio = 2 * mpmath.pi, (mpmath.sqrt(5) - 1) / 2
    a = angles[k - 1] if k else angles[-1] - turn
    b = angles[k + 1] if k + 1 < len(angles) else angles[0] + turn
    c, d = b - ratio * (b - a), a + ratio * (b - a)
    at_c, at_d = function(c), function(d)
    for _ in range(75):
        if at_c > at_d:
            b, d, at_d = d, c, at_c
            c = b - ratio * (b - a)
            at_c = function(c)
        else:
            a, c, at_c = c, d, at_d
            d = a + ratio * (b - a)
            at_d = function(d)
    return max(values[k], at_c, at_d)


def stroke(linkage, values, signals, output):
    """Mean and variance of signals while the output moves from its least to its greatest place."""
    equations = trace(linkage)
    by_name = {each.signal.name: each.number for each in find_quantities(equations)}
    least, greatest = reversals(linkage, equations, values, by_name[output])
    turn = 2 * mpmath.pi
    places = minima_of_factors(equations, values)
    ends = panels(sorted({*places, least, greatest % turn}))
    ends = sorted({end + k * turn for end in ends for k in (-1, 0, 1) if least <= end + k * turn <= greatest})
    nodes, weights = gauss_legendre(24)
    angles = [least, *((a + b) / 2 + (b - a) / 2 * x for a, b in pairwise(ends) for x in nodes), greatest]
    shares = [0, *(w * (b - a) / 2 / (greatest - least) for a, b in pairwise(ends) for w in weights), 0]
    result = {}
    for name in signals:
        column = [evaluate_graph([by_name[name]], values, angle)[0] for angle in angles]
        mean = mpmath.fsum(map(mpmath.fmul, column, shares))
        variance = mpmath.fsum((value - mean) ** 2 * share for value, share in zip(column, shares, strict=True))
        result[name] = [mpmath.nstr(each, 25) for each in (mean, variance)]
    return result


def statistics(linkage, values, signals):
    """Mean, variance and largest magnitude of signals, and the smallest transmission angle, deg."""
    equations = trace(linkage)
    by_name = {each.signal.name: each.number for each in find_quantities(equations)}
    numbers = [by_name[name] for name in signals]
    angles_of = [part for pair in equations.transmission.values() for part in pair]
    nodes, weights = gauss_legendre(24)
    ends, turn = panels(minima_of_factors(equations, values)), 2 * mpmath.pi
    angles = [(a + b) / 2 + (b - a) / 2 * x for a, b in pairwise(ends) for x in nodes]
    shares = [w * (b - a) / 2 / turn for a, b in pairwise(ends) for w in weights]
    samples = [evaluate_graph([*numbers, *angles_of], values, angle) for angle in angles]

    def transmission(parts):
        folded = [mpmath.degrees(mpmath.atan2(abs(s), abs(c))) for s, c in zip(parts[::2], parts[1::2], strict=True)]
        return -min(folded)

    result = {}
    for k, name in enumerate(signals):
        column = [sample[k] for sample in samples]
        mean = mpmath.fsum(map(mpmath.fmul, column, shares))
        variance = mpmath.fsum((value - mean) ** 2 * share for value, share in zip(column, shares, strict=True))
        peak = largest(function_of(numbers[k], values, abs), angles, list(map(abs, column)))
        result[name] = [mpmath.nstr(each, 25) for each in (mean, variance, peak)]
    folded = [transmission(sample[len(signals) :]) for sample in samples]
    least = -largest(lambda angle: transmission(evaluate_graph(angles_of, values, angle)), angles, folded)
    return result, mpmath.nstr(least, 25)


def main():
    mpmath.mp.dps = 40
    rows = []
    for name, (linkage, lengths, signals, count) in LINKAGES.items():
        designs = near_limits(linkage.mechanism.for_signals(()), lengths, count, np.random.default_rng(17))
        for margin, chosen in designs.items():
            for k in range(count):
                values = {parameter: float(column[k]) for parameter, column in chosen.items()}
                of_signals, angle = statistics(linkage, values, signals)
                row = {"linkage": name, "margin": margin, "parameters": values, "statistics": of_signals,
                       "transmission_angle_min": angle}  # fmt: skip
                if name in OUTPUTS:
                    row["forward"] = stroke(linkage, values, signals, OUTPUTS[name])
                rows.append(row)
    path = Path(__file__).parent / "near_limits.json"
    path.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


if __name__ == "__main__":
    main()
