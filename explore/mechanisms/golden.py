"""Golden sections, the search for the least value of a function on an interval."""

import math
from collections.abc import Callable
from typing import Any

from explore.base.subroutines import subroutine

_GOLDEN = 0.6180339887498949
#: Rise beside a lowest angle that is rounding, relative: about such a one there is no lower value to be found.
_FLAT = 1e-14
#: Number of golden sections about a lowest angle of the grid.
_SECTIONS = 75


@subroutine(inlined=True)
def sections(low, high):
    """The two places in an interval whose values are compared."""
    return high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)


@subroutine(inlined=True)
def narrowed(low, high, left, right, at_left, at_right):
    """The part of an interval that has the lesser value at its sections: ends, sections, and the values there.

    One section is new: the left one if the left value was not the larger, else the right one; its value is a stand-in.
    """
    if at_left <= at_right:
        new, _ = sections(low, right)
        return low, right, new, left, at_left, at_left
    _, new = sections(left, high)
    return left, high, right, new, at_right, at_right


def least_of(value: Callable[..., float]) -> Any:
    """The compiled search for the least value between two angles: golden sections about each lowest angle of a grid.

    There are several, since two dips may be nearly as low; about an angle beside which nothing rises there are none.
    `value` is compiled, of the constants of a lane, an angle and a quantity.
    """

    @subroutine()
    def refined(constants, lane, low, high, quantity):
        """The least value on a short interval; golden sections converge also onto a corner."""
        left, right = sections(low, high)
        at_left, at_right = value(constants, lane, left, quantity), value(constants, lane, right, quantity)
        found = min(at_left, at_right)
        for _ in range(_SECTIONS):
            is_left = at_left <= at_right
            low, high, left, right, at_left, at_right = narrowed(low, high, left, right, at_left, at_right)
            new = value(constants, lane, left if is_left else right, quantity)
            at_left, at_right = new if is_left else at_left, at_right if is_left else new
            found = min(found, new)
        return found

    @subroutine()
    def least(constants, lane, start, stop, steps, quantity):
        step = (stop - start) / steps
        here = value(constants, lane, start, quantity)
        before, found = math.inf, here
        for j in range(steps + 1):
            after = math.inf if j == steps else value(constants, lane, start + (j + 1) * step, quantity)
            rise = max(before - here if before < math.inf else 0.0, after - here if after < math.inf else 0.0)
            found = min(found, here)
            if here <= before and here <= after and rise > _FLAT * abs(here):
                low, high = start + max(j - 1, 0) * step, start + min(j + 1, steps) * step
                found = min(found, refined(constants, lane, low, high, quantity))
            before, here = here, after
        return found

    return least
