"""The units that the study of results chooses to show them in."""

import tomllib
from collections.abc import Mapping

from explore.results.store.results import Results

#: Declared unit of speeds.
_SPEED = "rad/s"
#: Unit in which a speed is shown where its study gives it so.
_RPM = "rpm"


def units_of_study(results: Results) -> dict[str, object]:
    """The entries of [units] in the study of results; none where the text of the study cannot be read."""
    try:
        entries = tomllib.loads(results.config).get("units", {})
    except tomllib.TOMLDecodeError:
        return {}
    return entries if isinstance(entries, dict) else {}


def given_units(results: Results) -> dict[str, str]:
    """The units of speeds among the parameters that the study gives in rpm alone."""
    return units_as_given(results.config, {c.name: c.unit for c in results.columns if c.role == "parameter"})


def units_as_given(study: str, declared: Mapping[str, str]) -> dict[str, str]:
    """The units of speeds that the text of a study gives in rpm alone, of parameters with these declared units."""
    try:
        entries = tomllib.loads(study).get("parameters", {})
    except tomllib.TOMLDecodeError:
        return {}
    speeds = [name for name, unit in declared.items() if unit == _SPEED]
    return {name: _RPM for name in speeds if isinstance(entries, dict) and _is_in_rpm(entries.get(name))}


def _is_in_rpm(entry: object) -> bool:
    """Whether all speeds of an entry are in rpm."""
    values = list(entry.values()) if isinstance(entry, dict) else entry if isinstance(entry, list) else [entry]
    texts = [value for value in values if isinstance(value, str)]
    has_numbers = isinstance(entry, list) and len(texts) < len(values)
    return bool(texts) and all(text.split()[-1:] == [_RPM] for text in texts) and not has_numbers
