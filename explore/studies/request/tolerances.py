"""Tolerances of parameters: how far a made part may be from its design."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

from explore.base.entries import note_unknown, read_number
from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.suggest import format_value, suggestion
from explore.model.mechanism import Mechanism

Distribution = Literal["normal", "uniform"]
#: Half the width of a normal tolerance, over its standard deviation.
SIGMAS = 3.0


@dataclass(frozen=True)
class Tolerance:
    """The tolerance of one parameter.

    Attributes
    ----------
    parameter
        Its name.
    plus_minus
        Half the width, in the unit of the parameter: parts are from as much below the design to as much above.
    distribution
        "normal": the standard deviation is a third of `plus_minus`, and 0.27 % of the parts are outside, because
        nothing is cut off; "uniform": all values within are equally likely, and none is outside.
    """

    parameter: str
    plus_minus: float
    distribution: Distribution = "normal"

    @property
    def std(self) -> float:
        """Standard deviation of the parts."""
        return self.plus_minus / (SIGMAS if self.distribution == "normal" else 3.0**0.5)


def make_tolerances(mechanism: Mechanism, entries: Mapping[str, object]) -> tuple[Tolerance, ...]:
    """Read tolerances by parameter, such as ``{"crank": 0.1, "coupler": "50 um"}``, not all of them 0."""
    tolerances, problems = resolve_tolerances(mechanism, entries)
    if problems:
        raise RequestError("\n".join(f"tolerance of {'.'.join(map(str, key))}: {reason}" for key, reason in problems))
    if not tolerances:
        raise RequestError("no dimension has a tolerance; give `tolerances`, or [tolerances] in the study")
    return tolerances


def resolve_tolerances(mechanism: Mechanism, entries: Mapping[str, object]) -> tuple[tuple[Tolerance, ...], Problems]:
    """The tolerances that are not 0, in the order of the parameters, and each problem with its key."""
    found: dict[str, Tolerance] = {}
    problems: Problems = []
    declared = {parameter.name: parameter for parameter in mechanism.parameters}
    for name, entry in entries.items():
        if name not in declared:
            problems.append(((name,), f"{mechanism.in_words} has no such parameter; {suggestion(name, declared)}"))
        elif declared[name].choices:
            problems.append(((name,), "has only listed values, so it cannot deviate; leave it out"))
        else:
            _read_tolerance(name, declared[name].unit, entry, found, problems)
    return tuple(found[name] for name in declared if name in found and found[name].plus_minus > 0.0), problems


def _read_tolerance(name: str, unit: str, entry: object, found: dict[str, Tolerance], problems: Problems) -> None:
    """Read one entry: half the width, or a table with it and the distribution."""
    table: Mapping[str, object] = entry if isinstance(entry, Mapping) else {"plus_minus": entry}
    keys = ("plus_minus", "distribution")
    unknown = note_unknown(table, keys, problems, (name,))
    if "plus_minus" not in table:
        problems.append(((name,), "the key 'plus_minus' is missing"))
        return
    distribution = table.get("distribution", "normal")
    if distribution not in get_args(Distribution):
        problems.append(
            ((name, "distribution"), f"must be {' or '.join(get_args(Distribution))}, got {format_value(distribution)}")
        )
        return
    key: KeyPath = (name, "plus_minus") if isinstance(entry, Mapping) else (name,)
    plus_minus = read_number(table["plus_minus"], unit, key, problems)
    if plus_minus is None:
        return
    if plus_minus < 0.0:
        problems.append((key, f"must be at least 0, got {format_value(table['plus_minus'])}"))
    elif not unknown:
        found[name] = Tolerance(name, plus_minus, distribution)  # type: ignore[arg-type]  # checked above
