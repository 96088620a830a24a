"""Sweep the dimensions of linkages, simulate every design exactly, keep and rank the results.

The public names are listed in the stub beside this file and are loaded on first use, so that `import explore` and the
command line start at once.
"""

import lazy_loader

# With a `__getattr__` of our own, mypy accepts every misspelt name, and each name stands in three lists.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
