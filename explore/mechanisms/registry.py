"""All mechanisms by name. A new mechanism adds its line here."""

from explore.mechanisms.crank_rocker import CRANK_ROCKER
from explore.vocabulary import Mechanism

MECHANISMS: dict[str, Mechanism] = {mechanism.name: mechanism for mechanism in (CRANK_ROCKER,)}
