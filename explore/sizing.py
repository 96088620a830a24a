"""Rules for machine elements under their public name; see `explore.mechanisms.sizing`."""

from explore.mechanisms.sizing import *  # noqa: F403  (the names are those of the package)
from explore.mechanisms.sizing import __all__ as __all__
