"""Functions that end a computation in its middle, and the digest of the file that it leaves."""

from explore.running.blocks import evaluate_block


class Stop(Exception):
    """The end of a computation."""


def stop(*_):
    raise Stop


def interrupt(*_):
    raise KeyboardInterrupt


def poisoned(*_):
    raise ZeroDivisionError("poison")


def poisoned_at_1(request, space, number, *others):
    """Evaluate a block, unless it is the second."""
    return poisoned() if number == 1 else evaluate_block(request, space, number, *others)
