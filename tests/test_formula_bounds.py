"""Values and error bounds of the formulas that users write, against mpmath and Python's own parser."""

import random
import re

import mpmath
import numpy as np
import pytest

from explore.evaluation.propagation import Bounded, propagate
from explore.studies.request.formula_text import parse_formula

NAMES = "abcd"
NUMBERS = re.compile(r"(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
#: Values within the bounds of the inputs that are tried for each design, beside the computed ones.
N_MOVED = 4
#: Digits of the true values. Inputs have 16, and no step of these formulas loses more than 300 in a difference that the
#: bound does not lose too.
mpmath.mp.dps = 60


def refuse(condition):
    if condition:
        raise ZeroDivisionError


def exponential(x):
    refuse(x > 1e4)  # too large for doubles; mpmath would compute millions of digits
    return mpmath.exp(x) if x > -1e4 else mpmath.mpf(0)


def logarithm(x):
    refuse(x <= 0)
    return mpmath.log(x)


def direction(y, x):
    refuse(y == 0 and x == 0)
    return mpmath.degrees(mpmath.atan2(y, x))


FUNCTIONS = {
    "abs": abs, "min": min, "max": max, "hypot": mpmath.hypot, "sqrt": lambda x: mpmath.sqrt(max(x, 0)),
    "exp": exponential, "log": logarithm, "atan2": direction, "pi": mpmath.mpf(mpmath.pi),
    "sin": lambda x: mpmath.sin(mpmath.radians(x)), "cos": lambda x: mpmath.cos(mpmath.radians(x)),
    "tan": lambda x: mpmath.tan(mpmath.radians(x)), "mpf": mpmath.mpf,
}  # fmt: skip


def true_value(text, inputs):
    """The formula as Python reads it, in 60 digits; None where it is undefined. The root of what is negative is 0."""
    names = {name: mpmath.mpf(float(x)) for name, x in zip(NAMES, inputs, strict=True)}
    try:
        value = eval(NUMBERS.sub(r"mpf('\g<0>')", text), FUNCTIONS | names)  # our own text
    except (ZeroDivisionError, OverflowError, TypeError, AttributeError):  # the last two of complex numbers
        return None
    return value if isinstance(value, mpmath.mpf) and mpmath.isfinite(value) else None


def evaluate(text, values, bounds=0.0):
    """Value, bound and scale of a formula of a, b, c, d; `values` and `bounds` have shape (4, n)."""
    formula = parse_formula(text)
    values, bounds = np.broadcast_arrays(np.asarray(values, float), bounds)
    inputs = [Bounded(values[k], bounds[k], np.abs(values[k])) for k in (NAMES.index(name) for name in formula.names)]
    return propagate(formula.expression, inputs)


LEAVES = (*NAMES, *NAMES, "2", "0.1", "1e-3", "180", "pi", "0")
EXPONENTS = ("2", "3", "-1", "-2", "0.5", "1.5", "-0.3", "0", "min(max(b, -3), 3)")
VALUES = (0.0, 1.0, -1.0, 2.0, 0.1, 90.0, 180.0, -45.0, 1e-8, 1e8, 1.0 + 1e-9, 1e-30, 1e30)
BOUNDS = (0.0, 0.0, 1e-16, 1e-12, 1e-6, 0.1, 3.0)


def random_formula(generator, size):
    """A formula of about `size` names and numbers."""
    if size < 2:
        return generator.choice(LEAVES)
    kind = generator.randrange(8)
    if kind < 4:
        left = generator.randrange(1, size)
        sign = generator.choice([" + ", " - ", " * ", "/", "-"])
        return random_formula(generator, left) + sign + random_formula(generator, size - left)
    inner = random_formula(generator, size - 1)
    if kind == 4:
        return generator.choice(["({})", "-{}"]).format(inner)
    if kind == 5:
        function = generator.choice(["sqrt", "abs", "log", "exp", "sin", "cos", "tan"])
        # pi in an angle is refused
        return f"{function}({inner.replace('pi', '3') if function in ('sin', 'cos', 'tan') else inner})"
    if kind == 6:
        other = random_formula(generator, 2)
        return f"{generator.choice(['min', 'max', 'hypot', 'atan2'])}({inner}, {other})"
    return f"{generator.choice(['({})', '{}']).format(inner)}**{generator.choice(EXPONENTS)}"


def random_designs(generator):
    """Values of the names and their bounds, each of shape (4, n)."""
    values = [[generator.choice([*VALUES, *[generator.uniform(-400.0, 400.0)] * 8]) for _ in range(4)] for _ in NAMES]
    return np.array(values), np.array([[generator.choice(BOUNDS) for _ in range(4)] for _ in NAMES])


def check(seed):
    generator = random.Random(seed)
    text = random_formula(generator, generator.randrange(2, 9))
    if set(NAMES).isdisjoint(re.findall(r"\w+", text)):
        text = f"a*({text})"
    values, bounds = random_designs(generator)
    value, bound, scale = evaluate(text, values, bounds)
    assert (bound >= 0.0).all()
    for k in range(values.shape[1]):
        design = (seed, text, values[:, k], bounds[:, k], value[k], bound[k])
        true = true_value(text, values[:, k])
        if true is None:
            assert np.isnan(value[k]) or np.isinf(bound[k]), design
        if np.isnan(value[k]) or np.isinf(bound[k]):
            continue
        assert scale[k] >= abs(value[k]) * (1.0 - 1e-14), design
        for _ in range(N_MOVED):
            assert true is not None, design
            assert abs(value[k] - true) <= bound[k] + 1e-40 * scale[k], (*design, true)
            moves = [generator.choice([-1.0, 1.0, generator.uniform(-1.0, 1.0)]) for _ in NAMES]
            moved = values[:, k] + moves * bounds[:, k]
            # not those that are rounded beyond the bound
            moved = np.where(np.abs(moved - values[:, k]) <= bounds[:, k], moved, values[:, k])
            true = true_value(text, moved)


@pytest.mark.parametrize("text", ["1**(a / b)", "(a / b)**b", "min(2, 1**(a / b))", "(1 + 0 * b)**log(b - 1)"])
def test_a_power_of_what_is_undefined_is_undefined(text):
    assert np.isnan(evaluate(text, np.array([[1.0], [0.0], [0.0], [0.0]])).value[0])


@pytest.mark.parametrize(("text", "bound"), [("a + b", 2e-3), ("a - 2 * b", 3e-3), ("3 * a / 4", 0.75e-3)])
def test_a_bound_is_the_largest_error_that_inputs_can_cause(text, bound):
    found = evaluate(text, np.array([[1.0], [2.0], [0.0], [0.0]]), 1e-3).bound[0]
    assert found == pytest.approx(bound, rel=1e-10)


@pytest.mark.parametrize("seeds", [range(1000), pytest.param(range(1000, 30_000), marks=pytest.mark.slow)])
def test_no_true_error_is_above_its_bound(seeds):
    for seed in seeds:
        check(seed)
