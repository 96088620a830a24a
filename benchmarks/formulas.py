"""CPU time per design of formulas of the user's own, with and without errors in their inputs."""

import time

import numpy as np

from explore.evaluation.propagation import Bounded, propagate
from explore.studies.request.formula_text import parse_formula

FORMULAS = ("a + b", "(a + b) * c / d - e*f", "2 * a * sin(b / 2)", "sqrt(a**2 + b**2 - 2*a*b*cos(c))")
#: Designs of a block, and runs of which the fastest counts: others use the processor too.
N_DESIGNS, N_RUNS = 65_536, 60

generator = np.random.default_rng(1)
exact = [Bounded.exact(generator.uniform(1.0, 2.0, N_DESIGNS)) for _ in range(6)]
sampled = [Bounded(source.value, 1e-12 * source.value, source.value) for source in exact]
for text in FORMULAS:
    formula, times = parse_formula(text), []
    for inputs in (exact, sampled):
        best = np.inf
        for _ in range(N_RUNS):
            start = time.process_time()
            propagate(formula.expression, inputs[: len(formula.names)])
            best = min(best, time.process_time() - start)
        times.append(1e9 * best / N_DESIGNS)
    print(f"{text:36} {times[0]:5.1f} ns of exact inputs, {times[1]:5.1f} ns of inputs with errors")
