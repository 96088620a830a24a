"""Names that a user gives to formulas and points: what they must not be."""

import re

from explore.model.mechanism import Mechanism
from explore.model.name_checks import OWN_COLUMNS
from explore.studies.request.formula_text import RESERVED

_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_LONGEST_NAME = 60
# Statistics over other windows end with the names of these.
#: Endings of names of margins of constraints, of words of codes, and of statistics over an interval.
_ENDINGS = ("margin", "label", "interval")


def reason_against_name(mechanism: Mechanism, name: str) -> str:
    """Why a formula or a point cannot have this name, such as that it means something else; empty if it can."""
    kinds = {
        "a parameter": {parameter.name for parameter in mechanism.parameters},
        "a column of all results": OWN_COLUMNS,
        f"a metric or signal of {mechanism.in_words}": mechanism.taken_names,
        "a function or a word of formulas and conditions": RESERVED,
    }
    if not _IDENTIFIER.fullmatch(str(name)) or len(name) > _LONGEST_NAME:
        return f"a name has letters, digits and _, at most {_LONGEST_NAME}, and begins with a letter"
    for kind, names in kinds.items():
        if name in names:
            return f"this is the name of {kind}; choose another"
    for ending in (*_ENDINGS, *(window.name for window in mechanism.windows)):
        if name.endswith(f"_{ending}"):
            return f"names that end with _{ending} are of other columns; choose another"
    return ""
