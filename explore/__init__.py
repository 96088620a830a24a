"""Sweep the dimensions of linkages, simulate every design exactly, keep and rank the results.

Names are loaded when first used, so that `import explore` and the command line start at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from explore._version import __version__

if TYPE_CHECKING:
    from explore.api import evaluate, rank, read_results, simulate, sweep
    from explore.config.study_file import load_study
    from explore.covering import coverage
    from explore.errors import ClusterError, ConfigError, ExploreError, MotionError, RequestError, ResultsError
    from explore.store.opening import open_results

_HOME = {
    "ClusterError": "errors",
    "ConfigError": "errors",
    "ExploreError": "errors",
    "MotionError": "errors",
    "RequestError": "errors",
    "ResultsError": "errors",
    "coverage": "covering",
    "evaluate": "api",
    "load_study": "config.study_file",
    "open_results": "store.opening",
    "rank": "api",
    "read_results": "api",
    "simulate": "api",
    "sweep": "api",
}

__all__ = [
    "ClusterError",
    "ConfigError",
    "ExploreError",
    "MotionError",
    "RequestError",
    "ResultsError",
    "__version__",
    "coverage",
    "evaluate",
    "load_study",
    "open_results",
    "rank",
    "read_results",
    "simulate",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'explore' has no attribute '{name}'")
    value = getattr(import_module(f"explore.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
