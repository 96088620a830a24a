"""The units that the study of results chooses to show them in."""

from __future__ import annotations

import tomllib

from explore.results.store.results import Results

#: Unit in which the input speed is shown where its study gives it so.
_RPM = "rpm"


def units_of_study(results: Results) -> dict[str, object]:
    """The entries of [units] in the study of results; none where the text of the study cannot be read."""
    try:
        entries = tomllib.loads(results.config).get("units", {})
    except tomllib.TOMLDecodeError:
        return {}
    return entries if isinstance(entries, dict) else {}


def given_units(results: Results) -> dict[str, str]:
    """The unit of the input speed, where the study gives it in rpm alone."""
    return unit_of_speed(results.config, results.speed)


def unit_of_speed(study: str, speed: str) -> dict[str, str]:
    """The unit of the input speed of this name, where the text of a study gives it in rpm alone."""
    try:
        entry = tomllib.loads(study).get("parameters", {}).get(speed)
    except (tomllib.TOMLDecodeError, AttributeError):
        return {}
    values = list(entry.values()) if isinstance(entry, dict) else entry if isinstance(entry, list) else [entry]
    texts = [value for value in values if isinstance(value, str)]
    is_in_rpm = bool(texts) and all(text.split()[-1:] == [_RPM] for text in texts)
    has_numbers = isinstance(entry, list) and len(texts) < len(values)
    return {speed: _RPM} if is_in_rpm and not has_numbers else {}
