"""Golden sections, the search for the least value of a function on an interval."""

from explore.base.subroutines import subroutine

_GOLDEN = 0.6180339887498949


@subroutine(inlined=True)
def sections(low, high):
    """The two places in an interval whose values are compared; one is that of the part with the lesser value, too."""
    return high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
