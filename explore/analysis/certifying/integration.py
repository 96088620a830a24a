"""Rigorous integration over crank angles.

`acb.integral` bounds the error of Gauss-Legendre rules by the size of the integrand on ellipses around the pieces, and
halves the pieces. The variable is the half-tangent from the nearest multiple of pi, in which linkages are algebraic.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import pairwise
from math import ceil

from flint import acb, arb, ctx

from explore.analysis.certifying.balls import UnprovedError
from explore.analysis.certifying.positions import Arc

_NOWHERE = acb("nan")
_is_left_out = ContextVar("integration is left out", default=False)


@contextmanager
def integration_left_out() -> Iterator[None]:
    """Here what needs an integral, which takes up to seconds, is not proved."""
    token = _is_left_out.set(True)
    try:
        yield
    finally:
        _is_left_out.reset(token)


def integrate_over(arc: Arc, signal: Callable[[acb, int, bool], acb]) -> arb:
    """The integral of a signal over an arc.

    The signal takes a half-tangent, the multiple of pi that it is from, and whether it must be analytic there. Raises
    `UnprovedError` where integration is left out.
    """
    if _is_left_out.get():
        raise UnprovedError("integration is left out")
    total, tolerance = arb(0), arb(2) ** -(ctx.prec * 5 // 8)
    interrupts: list[KeyboardInterrupt] = []
    for half_turns, start, stop in _pieces(arc):

        def function(tangent: acb, analytic: bool, half_turns: int = half_turns) -> acb:
            if interrupts:
                return _NOWHERE
            try:
                return signal(tangent, half_turns, analytic) * 2 / (1 + tangent * tangent)
            except KeyboardInterrupt as interrupt:  # python-flint would turn it into a SystemError
                interrupts.append(interrupt)
                return _NOWHERE

        total += acb.integral(function, acb(start), acb(stop), rel_tol=tolerance, abs_tol=tolerance).real
        if interrupts:
            raise interrupts[0]
    return total


def _pieces(arc: Arc) -> list[tuple[int, arb, arb]]:
    """Multiples of pi, and the half-tangents from them of the two ends, of the parts of an arc."""
    quarter = arb.pi() / 2
    first = ceil(float(arc.start.angle / arb.pi()) - 0.5)
    last = ceil(float(arc.stop.angle / arb.pi()) - 0.5)
    cuts = [(2 * k + 1) * quarter for k in range(first, last)]
    edges = [arc.start.angle, *cuts, arc.stop.angle]
    return [
        (first + k, ((a - (first + k) * arb.pi()) / 2).tan(), ((b - (first + k) * arb.pi()) / 2).tan())
        for k, (a, b) in enumerate(pairwise(edges))
    ]


def arctangent(number: acb, analytic: bool) -> acb:
    """The arctangent, or no finite number on its branch cuts, where 1 + number^2 is real and negative."""
    if analytic and not (1 + number * number).sqrt(analytic=True).is_finite():
        return _NOWHERE
    return number.atan()
