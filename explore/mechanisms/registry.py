"""All mechanisms by name. A new mechanism adds a line here."""

import copyreg

from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER
from explore.mechanisms.rig.declaration import TEST_RIG
from explore.model.mechanism import Mechanism

MECHANISMS: dict[str, Mechanism] = {mechanism.name: mechanism for mechanism in (CRANK_ROCKER, TEST_RIG)}


def mechanism_by_name(name: str) -> Mechanism:
    """The registered mechanism of that name."""
    return MECHANISMS[name]


# A mechanism is pickled as its name, so a worker loads its own compiled functions.
copyreg.pickle(Mechanism, lambda mechanism: (mechanism_by_name, (mechanism.name,)))
