"""Where mechanisms are declared: those of this package, and those that installed packages register.

A package registers a mechanism by an entry point of the group `explore.mechanisms`: the mechanism's name, and the
module and the variable that hold it. Reading the entry points imports none of these modules.
"""

from collections import defaultdict
from functools import cache
from importlib.metadata import EntryPoint, entry_points

GROUP = "explore.mechanisms"
#: The mechanism of commands and examples that name none.
DEFAULT_MECHANISM = "crank-rocker"
#: Mechanisms of this package; a new one adds a line here.
_OWN = {
    "crank-rocker": "explore.mechanisms.crank_rocker.declaration:CRANK_ROCKER",
    "slider-crank": "explore.mechanisms.slider_crank.declaration:SLIDER_CRANK",
    "test-rig": "explore.mechanisms.rig.declaration:TEST_RIG",
    "gears": "explore.mechanisms.gears.declaration:GEARS",
    "variable-crank": "explore.mechanisms.variable_crank.declaration:VARIABLE_CRANK",
}


@cache
def registered_entries() -> dict[str, tuple[EntryPoint, ...]]:
    """The entries of each name, those of this package first; more than one is a conflict."""
    entries: dict[str, list[EntryPoint]] = defaultdict(list)
    for name, value in _OWN.items():
        entries[name].append(EntryPoint(name, value, GROUP))
    for entry in sorted(entry_points(group=GROUP), key=source_of):
        entries[entry.name].append(entry)
    return {name: tuple(found) for name, found in entries.items()}


def source_of(entry: EntryPoint) -> str:
    """The name of the package that registers an entry."""
    return entry.dist.name if entry.dist else "explore"
