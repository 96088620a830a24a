"""One design in ball arithmetic: its numbers by name and formulas of them, with as many bits as they need."""

from collections.abc import Mapping
from functools import cached_property
from typing import Self

import numpy as np
from flint import arb

from explore.analysis.certifying.balls import Enclosure, UndecidedError, UnprovedError, exact, with_more_bits
from explore.analysis.certifying.certificate import Certificate
from explore.analysis.certifying.functions import compute
from explore.evaluation.evaluate import LARGEST_PARAMETER, SMALLEST_PARAMETER
from explore.evaluation.propagation import Bounded, propagate
from explore.model.expressions import Expression
from explore.model.quantities import OMITTED, AnyMetric, DerivedMetric, GivenMetric, Parameter
from explore.model.request import Constraint, Objective, Request


class Design:
    """A design of exact parameters, all of its mechanism, and what results hold of it."""

    def __init__(self, parameters: Mapping[str, float], request: Request) -> None:
        self.parameters, self.request = dict(parameters), request
        self._certificates: dict[int, Certificate] = {}
        self._known: dict[tuple[str, int], Enclosure | None] = {}
        self._narrow: dict[str, tuple[Enclosure | None]] = {}
        self.bits = 0
        self.intervals: dict[Objective, tuple[float, float]] = {}

    @classmethod
    def of_row(cls, row: Mapping[str, float], request: Request) -> Self:
        """The design of a row, with the defaults of the parameters that the row lacks."""
        parameters = {
            p.name: float(row[p.name]) if p.name in row else float("nan" if p.default is None else p.default)
            for p in request.mechanism.parameters
        }
        return cls(parameters, request)

    @cached_property
    def is_usable(self) -> bool:
        """Whether each parameter is a number that it may be, of a usable magnitude."""
        numbers = ((p, float(self.parameters[p.name])) for p in self.request.mechanism.parameters)
        return all(
            p.allows(number) and (number == 0.0 or SMALLEST_PARAMETER < abs(number) <= LARGEST_PARAMETER)
            for p, number in numbers
        )

    @property
    def status(self) -> int:
        """The status by exact signs."""
        return with_more_bits(lambda bits: self._certificate(bits).status, "the class")

    def enclose(self, metric: AnyMetric) -> Enclosure | None:
        """A narrow enclosure of a metric, None where it is undefined; UnprovedError says why there is none."""
        if metric.name not in self._narrow:

            def find(bits: int) -> tuple[Enclosure | None] | None:
                enclosure = self.enclosure(metric, bits)
                return (enclosure,) if enclosure is None or enclosure.is_narrow else None

            self._narrow[metric.name] = with_more_bits(find, metric.name)
        return self._narrow[metric.name][0]

    def enclosure(self, metric: AnyMetric, bits: int) -> Enclosure | None:
        """An enclosure of a metric at a precision, which is set."""
        key = metric.name, bits
        if key not in self._known:
            self._known[key] = self._find(metric, bits)
            self.bits = max(self.bits, bits)
        return self._known[key]

    def _certificate(self, bits: int) -> Certificate:
        if bits not in self._certificates:
            self._certificates[bits] = Certificate(self.parameters, self.request)
        return self._certificates[bits]

    def _find(self, metric: AnyMetric, bits: int) -> Enclosure | None:
        if isinstance(metric, GivenMetric):
            raise UnprovedError(f"{metric.name} comes with the designs")
        certificate = self._certificate(bits)
        if not isinstance(metric, DerivedMetric) or not isinstance(metric.formula.function, Expression):
            return certificate.enclose(metric)
        sources = []
        for source in metric.inputs:
            if isinstance(source, Parameter):
                number = self.parameters[source.name]
                if number == 0.0 and source.zero_meaning == OMITTED:
                    return None
                sources.append(Enclosure.of(arb(number)))
                continue
            enclosure = self.enclosure(source, bits)
            if enclosure is None:
                return None
            sources.append(enclosure)
        value = compute(metric.formula.function, [source.ball for source in sources])
        if value is None:
            return None
        if not value.is_finite():
            raise UndecidedError
        return Enclosure(value, _scale(metric.formula.function, sources).max(abs(value)))

    def margin(self, constraint: Constraint, bits: int) -> arb | None:
        """Signed distance of a constrained metric to its nearer bound at a precision, which is set."""
        enclosure = self.enclosure(constraint.metric, bits)
        if enclosure is None:
            return None
        sides = []
        if constraint.minimum is not None:
            sides.append(enclosure.ball - exact(constraint.minimum))
        if constraint.maximum is not None:
            sides.append(exact(constraint.maximum) - enclosure.ball)
        return sides[0] if len(sides) == 1 else sides[0].min(sides[1])

    def column(self, name: str, bits: int) -> arb | None:
        """The number of a column that can be an objective at a precision, which is set."""
        if name in self.parameters:
            return arb(self.parameters[name])
        for constraint in self.request.constraints:
            if name == f"{constraint.metric.name}_margin":
                return self.margin(constraint, bits)
        metric = next(metric for metric in self.request.metrics if metric.name == name)
        enclosure = self.enclosure(metric, bits)
        return enclosure and enclosure.ball


def _scale(expression: Expression, sources: list[Enclosure]) -> arb:
    """The size of a formula if no terms cancel, which errors of formulas are relative to."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inputs = [Bounded(np.array([float(s.ball)]), np.zeros(1), np.array([float(s.scale)])) for s in sources]
        return arb(float(propagate(expression, inputs).scale[0]))
