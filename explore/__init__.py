"""Sweep the dimensions of mechanisms, simulate every design exactly, keep and rank the results.

The public names are listed in the stub beside this file and are loaded on first use, so that `import explore` and the
command line start at once.
"""

import lazy_loader

# A hand-written `__getattr__` would let mypy accept any misspelt name and list each name three times.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
