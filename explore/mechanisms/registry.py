"""All mechanisms by name. A new mechanism adds its line here."""

import copyreg

from explore.mechanisms.crank_rocker import CRANK_ROCKER
from explore.mechanisms.test_rig import TEST_RIG
from explore.vocabulary import Mechanism

MECHANISMS: dict[str, Mechanism] = {mechanism.name: mechanism for mechanism in (CRANK_ROCKER, TEST_RIG)}


def by_name(name: str) -> Mechanism:
    """The registered mechanism of that name."""
    return MECHANISMS[name]


# A mechanism travels to a worker as its name: compiled functions are found there, not sent.
copyreg.pickle(Mechanism, lambda mechanism: (by_name, (mechanism.name,)))
