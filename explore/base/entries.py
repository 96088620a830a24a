"""Entries of tables of TOML: what is wrong, unknown or missing is noted with its key."""

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.suggest import closest_name, format_value, suggestion
from explore.base.units.quantities import quantity


def read_table(
    entry: object, key: KeyPath, keys: Collection[str], example: str, problems: Problems, needed: Iterable[str] = ()
) -> Mapping[str, Any]:
    """The entries of a table, which may have any keys where `keys` are empty; none of what is no table.

    A key that is needed is not missing where an unknown one may be meant to be it.
    """
    if not isinstance(entry, Mapping):
        problems.append((key, f"must be a table such as {example}, got {format_value(entry)}"))
        return {}
    meant = {closest_name(word, keys) for word in note_unknown(entry, keys or entry, problems, key)}
    missing = [word for word in needed if word not in entry and word not in meant]
    problems += [(key, f"the key '{word}' is missing; a complete one is {example}") for word in missing]
    return entry


def note_unknown(entries: Iterable[Any], keys: Collection[str], problems: Problems, key: KeyPath = ()) -> list[str]:
    """Note the keys that a table cannot have, and return them."""
    unknown = [str(word) for word in entries if word not in keys]
    problems += [((*key, word), f"unknown key; {suggestion(word, keys)}") for word in unknown]
    return unknown


def is_known(name: object, key: KeyPath, known: Iterable[str], kind: str, problems: Problems) -> bool:
    """Whether a name is one of those of a kind; if not, it is noted."""
    names = list(known)
    if name not in names:
        problems.append((key, f"unknown {kind} {format_value(name)}; {suggestion(str(name), names)}"))
    return name in names


def read_number(entry: object, unit: str, key: KeyPath, problems: Problems) -> float | None:
    """A number in a unit, or that of a text with a unit; None after a mistake is noted."""
    try:
        return quantity(entry, unit)
    except RequestError as error:
        problems.append((key, str(error)))
        return None
