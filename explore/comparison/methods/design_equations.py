"""The loops of one design in Python's numbers, for solvers that call a function of Python."""

import cmath
import math
from typing import Any

import numpy as np

from explore.comparison.methods.compiled_loop import fill_rates, number_terms
from explore.comparison.methods.loop import Linearised, Loop
from explore.comparison.methods.loop_closure import project_onto_loop
from explore.model.quantities import FloatArray

#: The length that is given to a loop that has none.
_NOTHING: FloatArray = np.empty(0)


class DesignEquations:
    """The equations of one design, with counters of evaluations and steps."""

    def __init__(self, loop: Loop, parameters: FloatArray) -> None:
        self.loop, self.columns = loop, loop.columns(parameters)
        self.scales = np.array(loop.scales(self.columns))
        self._floats = loop.columns(parameters.tolist())
        self._numbers = [[complex(number) for number in chain] for chain in loop.numbers(self.columns)]
        numbers = np.array([number for chain in self._numbers for number in chain])
        self._terms = number_terms(loop), numbers, loop.n_angles, loop.n_lengths, loop.turns
        self.evaluations = self.steps = 0

    def about(self, crank: float, unknowns: FloatArray) -> tuple[Linearised, Any]:
        """The loops about given unknowns, and the given length."""
        given = self.loop.given(self._floats, crank, math)
        return self.loop.linearise(self._numbers, crank, unknowns.tolist(), given, _turn), given

    def rates(self, crank: float, unknowns: FloatArray) -> FloatArray:
        """The rates of the unknowns; ArithmeticError if not finite."""
        self.evaluations += 1
        given, rates = self.loop.given(self._floats, crank, math), np.empty(self.loop.count)
        if not fill_rates(*self._terms, np.array(given[:2]) if given else _NOTHING, crank, unknowns, rates):
            raise FloatingPointError("the rates are not finite")
        return rates

    def project(self, crank: float | FloatArray, unknowns: FloatArray) -> FloatArray:
        """Project the unknowns, first axis m, onto the closed loops."""
        unknowns, corrections = project_onto_loop(self.loop, self.columns, np.asarray(crank), unknowns)
        self.evaluations += int(corrections.sum())
        return unknowns


def _turn(angle: float) -> complex:
    return cmath.rect(1.0, angle) if math.isfinite(angle) else complex(math.nan, math.nan)
