"""Read targets of the kind "dwell": the output rests while the crank turns by an angle, or within a travel."""

from collections.abc import Mapping
from math import inf
from pathlib import Path
from typing import Any

from explore.base.errors import Problems, RequestError
from explore.base.units.quantities import quantity
from explore.model.mechanism import Mechanism
from explore.model.targets import DwellTarget
from explore.studies.request.target_entries import note_unknown_keys

_KEYS = ("kind", "angle", "travel")


def read_dwell_target(
    mechanism: Mechanism, entries: Mapping[str, Any], problems: Problems, _: Path = Path()
) -> DwellTarget | None:
    """The dwell that a section describes; see `explore.studies.request.targets.read_target`."""
    before = len(problems)
    note_unknown_keys(entries, _KEYS, problems)
    given = [key for key in _KEYS[1:] if key in entries]
    if len(problems) > before:
        return None
    if len(given) != 1:
        both = "'angle' and 'travel' are given; leave out one of the two" if given else "write an angle or a travel"
        problems.append((tuple(given[1:]), f"{both}: how far the output moves in a dwell, or how long it rests"))
        return None
    key, of_angle = given[0], mechanism.targets[DwellTarget.kind].formulas(DwellTarget(angle=60.0))
    unit, most, limits = "deg", 360.0, "between 0 and 360 deg"
    if key == "travel":
        unit, most, limits = of_angle[0].unit, inf, "above 0"
    try:
        value = quantity(entries[key], unit)
    except RequestError as error:
        problems.append(((key,), str(error)))
        return None
    if 0.0 < value < most:
        return DwellTarget(**{key: value})
    problems.append(((key,), f"must be {limits}, got {value:g}"))
    return None
