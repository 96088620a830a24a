"""Read the keys of a section of a task file; every mistake becomes a problem with its key."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.suggest import closest_name, format_value, suggestion
from explore.base.units.quantities import quantity

#: Number in place of one that is missing or wrong; the problem is noted.
_NO_NUMBER = math.nan


class SectionReader:
    """Reads a section of a task file, with this name and content, key by key; notes each problem with its key."""

    def __init__(self, name: str, content: object, problems: Problems) -> None:
        self._name, self._problems = name, problems
        self._known: list[str] = []
        # Keys that were read as numbers, with their entries and units.
        self.numbers: list[tuple[KeyPath, Any, str]] = []
        self._content: Mapping[str, Any] = content if isinstance(content, Mapping) else {}
        if not isinstance(content, Mapping):
            problems.append(((name,), f"must be a table of keys and values, got {format_value(content)}"))

    def __contains__(self, key: str) -> bool:
        return key in self._content

    def note(self, key: str, reason: str, *below: str | int) -> None:
        """Note a problem of a key."""
        self._problems.append(((self._name, key, *below), reason))

    def get(self, key: str) -> Any:
        """The entry of a key as it is in the file; None where it is missing."""
        self._known.append(key)
        return self._content.get(key)

    def entries(self, *keys: str) -> dict[str, Any]:
        """The entries of those of the keys that the file has."""
        return {key: entry for key in keys if (entry := self.get(key)) is not None}

    def number(
        self,
        key: str,
        unit: str,
        example: str = "",
        *,
        default: float | None = None,
        above: float = -math.inf,
        least: float = -math.inf,
        below: float = math.inf,
    ) -> float:
        """A number in a unit, or a string with a unit; without a default it has to be there.

        It is above one limit, at least one, and below one. The example is an entry for the message that the key is
        missing.
        """
        entry = self.get(key)
        if entry is None:
            if default is None:
                self.note(key, f"is missing; write it, such as {key} = {example}")
                return _NO_NUMBER
            return default
        self.numbers.append(((self._name, key), entry, unit))
        try:
            value = quantity(entry, unit)
        except RequestError as error:
            self.note(key, str(error))
            return _NO_NUMBER
        limits = [f"above {above:g}"] if above > -math.inf else []
        limits += [f"at least {least:g}"] if least > -math.inf else []
        limits += [f"below {below:g}"] if below < math.inf else []
        if not (above < value < below and value >= least):
            words = f"{' and '.join(limits)} {unit if unit != '1' else ''}".strip()
            self.note(key, f"must be {words}, got {format_value(entry)}")
            return _NO_NUMBER
        return value

    def count(self, key: str, default: int, most: int) -> int:
        """A whole number from 1 to `most`."""
        entry = self.get(key)
        if entry is None:
            return default
        if not isinstance(entry, int) or isinstance(entry, bool) or not 1 <= entry <= most:
            self.note(key, f"must be a whole number from 1 to {most:,}, got {format_value(entry)}")
            return default
        return entry

    def word(self, key: str, words: Iterable[str], default: str) -> str:
        """One of some words."""
        entry, allowed = self.get(key), list(words)
        if entry is None:
            return default
        if entry not in allowed:
            self.note(key, f"unknown word {format_value(entry)}; {suggestion(str(entry), allowed)}")
            return default
        return str(entry)

    def flag(self, key: str) -> bool:
        """Whether a key is true; it is false where it is missing."""
        entry = self.get(key)
        if entry is not None and not isinstance(entry, bool):
            self.note(key, f"must be true or false, got {format_value(entry)}")
        return entry is True

    def finish(self) -> None:
        """Note the keys that nothing read, and take back that a key is missing which one of them means."""
        unknown = [key for key in self._content if key not in self._known]
        meant = {closest_name(key, self._known) for key in unknown}
        self._problems[:] = [
            (key, reason)
            for key, reason in self._problems
            if not (key[0] == self._name and key[1:] and key[1] in meant and reason.startswith("is missing"))
        ]
        for key in unknown:
            self.note(key, f"unknown key; {suggestion(key, self._known)}")
