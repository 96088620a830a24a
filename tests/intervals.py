"""Graphs of linkages in interval arithmetic: what is certain of many designs and crank angles, however they round."""

import math

import numpy as np

from explore.mechanisms.linkages.expressions import evaluate_function
from explore.mechanisms.linkages.graph import operands

#: Relative error of a sine or cosine of NumPy or of the C library, generously.
_ELEMENTARY = 1e-15


def outward(low, high):
    """An interval that covers another one and its rounding; all numbers where there was no number."""
    low, high = np.nextafter(low, -np.inf), np.nextafter(high, np.inf)
    undefined = np.isnan(low) | np.isnan(high)
    return np.where(undefined, -np.inf, low), np.where(undefined, np.inf, high)


def add(a, b):
    return outward(a[0] + b[0], a[1] + b[1])


def multiply(a, b):
    products = [x * y for x in a for y in b]
    return outward(np.minimum.reduce(products), np.maximum.reduce(products))


def square(a):
    low = np.where((a[0] <= 0.0) & (a[1] >= 0.0), 0.0, np.minimum(a[0] ** 2, a[1] ** 2))
    result = outward(low, np.maximum(a[0] ** 2, a[1] ** 2))
    return np.maximum(result[0], 0.0), result[1]


def divide(a, b):
    spans = (b[0] <= 0.0) & (b[1] >= 0.0)
    low, high = outward(np.where(spans, -np.inf, 1.0 / b[1]), np.where(spans, np.inf, 1.0 / b[0]))
    return multiply(a, (low, high))


def root(a):
    """Of what is not negative: a negative factor is noticed by itself."""
    low, high = outward(np.sqrt(np.maximum(a[0], 0.0)), np.sqrt(a[1]))
    return np.maximum(low, 0.0), high


def magnitude(a):
    low = np.where((a[0] <= 0.0) & (a[1] >= 0.0), 0.0, np.minimum(np.abs(a[0]), np.abs(a[1])))
    return low, np.maximum(np.abs(a[0]), np.abs(a[1]))


def cosine(start, stop):
    """The cosine over angles from `start` to `stop`, rad, with the error of the angles themselves."""
    ends = np.cos(start), np.cos(stop)
    has_top = np.floor(stop / (2.0 * math.pi)) >= np.ceil(start / (2.0 * math.pi))
    has_bottom = np.floor((stop / math.pi - 1.0) / 2.0) >= np.ceil((start / math.pi - 1.0) / 2.0)
    low = np.where(has_bottom, -1.0, np.minimum(*ends) - _ELEMENTARY)
    return low, np.where(has_top, 1.0, np.maximum(*ends) + _ELEMENTARY)


def evaluate_intervals(numbers, parameters, start, stop):
    """Intervals of numbers of a graph for cells of these parameters, at crank angles from `start` to `stop`, rad."""
    graph, done = numbers[0].graph, {}
    quarter = 0.5 * math.pi
    inputs = {"@cos": cosine(start, stop), "@sin": cosine(start - quarter, stop - quarter)}
    for k in range(4):
        low, high = cosine(start - k * quarter, stop - k * quarter)
        inputs[f"@versine{k}"] = np.maximum(1.0 - high - _ELEMENTARY, 0.0), 1.0 - low + _ELEMENTARY
    with np.errstate(all="ignore"):
        for k in graph.needed(numbers):
            operation, *rest = graph.nodes[k]
            values = [done[each] for each in operands(graph.nodes[k])]
            match operation:
                case "constant":
                    done[k] = (np.array(rest[0]),) * 2
                case "input":
                    done[k] = inputs[rest[0]] if rest[0] in inputs else (parameters[rest[0]],) * 2
                case "add":
                    done[k] = add(*values)
                case "sub":
                    done[k] = add(values[0], (-values[1][1], -values[1][0]))
                case "exact_sum":
                    done[k] = add(add(values[0], values[1]), add(values[2], values[3]))
                case "mul":
                    done[k] = square(values[0]) if rest[0] == rest[1] else multiply(*values)
                case "div":
                    done[k] = divide(*values)
                case "neg":
                    done[k] = -values[0][1], -values[0][0]
                case "sqrt":
                    done[k] = root(values[0])
                case "abs":
                    done[k] = magnitude(values[0])
                case "max":
                    done[k] = tuple(np.maximum(*ends) for ends in zip(*values, strict=True))
                case _:  # of degrees: numbers of the design
                    value = np.frompyfunc(evaluate_function, 3, 1)(operation, *(each[0] for each in values), 0.0)
                    value = np.asarray(value, dtype=float)
                    error = _ELEMENTARY * (1.0 + np.abs(value))
                    done[k] = value - error, value + error
    return [done[number.index] for number in numbers]


def turns_for_certain(equations, designs):
    """1 for designs whose factors are positive all over the turn, -1 for those with a negative one somewhere, else 0.

    Cells of the turn are halved to 1e-9 rad; a factor in a cell is that at its middle, and its slope over the cell
    times the width.
    """
    numbers = [number for factor in equations.factors for number in factor.value.terms[:2]]
    count = len(next(iter(designs.values())))
    verdicts, width = np.zeros(count, dtype=int), 2.0 * math.pi / 16
    owner, start = np.repeat(np.arange(count), 16), np.tile(np.arange(16) * width, count)
    undecided = np.zeros(count, dtype=bool)
    while len(owner) and width > 1e-9:
        kept = []
        for part in np.array_split(np.arange(len(owner)), len(owner) // 50_000 + 1):
            inputs = {name: column[owner[part]] for name, column in designs.items()}
            middle = start[part] + 0.5 * width
            at_middle = evaluate_intervals(numbers[::2], inputs, middle, middle)
            over_cell = evaluate_intervals(numbers, inputs, start[part], start[part] + width)
            positive = np.ones(len(part), dtype=bool)
            for k, (low, high) in enumerate(at_middle):
                verdicts[owner[part][np.broadcast_to(high < 0.0, positive.shape)]] = -1
                change = multiply(over_cell[2 * k + 1], (np.array(-0.5 * width), np.array(0.5 * width)))
                positive &= (over_cell[2 * k][0] > 0.0) | (add((low, high), change)[0] > 0.0)
            kept.append(part[~positive])
        left = np.concatenate(kept)
        left = left[verdicts[owner[left]] == 0]
        owner, start, width = np.repeat(owner[left], 2), np.repeat(start[left], 2), 0.5 * width
        start[1::2] += width
    undecided[owner] = True
    return np.where((verdicts == 0) & ~undecided, 1, verdicts)
