"""Comparisons of a few methods; all of them take much longer."""

from contextlib import contextmanager

from explore.comparison.methods.registry import METHODS


@contextmanager
def only(*names):
    """Leave these methods registered for a while, or those of them that there are."""
    registered = dict(METHODS)
    for name in METHODS.keys() - set(names):
        del METHODS[name]
    try:
        yield METHODS
    finally:
        METHODS.clear()  # in the order that other tests rely on
        METHODS.update(registered)
