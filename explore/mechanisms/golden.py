"""Golden sections, the search for the least value of a function on an interval."""

from explore.base.subroutines import subroutine

_GOLDEN = 0.6180339887498949


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
