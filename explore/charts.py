"""Figures of results: each function returns a matplotlib Figure.

The public names are listed in the stub beside this file and are loaded on first use, because the kernels and matplotlib
take time to import.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub("explore", __file__)
