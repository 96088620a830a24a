"""Golden sections, the search for the least value of a function on an interval."""

from explore.base.subroutines import subroutine

_GOLDEN = 0.6180339887498949


@subroutine(inlined=True)
def sections(low, high):
    """The two places in an interval whose values are compared."""
    return high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)


@subroutine(inlined=True)
def narrowed(low, high, at_left, at_right):
    """The part of an interval that has the least value, from the values at its sections."""
    left, right = sections(low, high)
    return (low, right) if at_left < at_right else (left, high)
