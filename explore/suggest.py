"""The second half of an error message: what may have been meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def closest(name: str, names: Iterable[str]) -> str | None:
    """The name most like the one given, capitals aside; None when nothing is alike."""
    by_lower = {known.lower(): known for known in names}
    found = difflib.get_close_matches(name.lower().strip(), by_lower, n=1)
    return by_lower[found[0]] if found else None


def suggestion(name: str, names: Iterable[str]) -> str:
    """End of a message about an unknown name: the closest known one, else all of them.

    Parameters
    ----------
    name
        What was written.
    names
        What exists.
    """
    known = list(names)
    match = closest(name, known)
    return f"did you mean '{match}'?" if match else f"there is {', '.join(known)}"


def shown(value: object) -> str:
    """A value as it may stand in a message of one line: short, without line breaks."""
    if isinstance(value, bool):
        return str(value).lower()
    try:
        text = str(value)
    except ValueError:  # Python refuses to write out integers of many thousand digits
        text = "the number"
    text = text if len(text) <= 40 else text[:37] + "..."
    text = "".join(letter if letter.isprintable() else "?" for letter in text)
    return f"'{text}'" if isinstance(value, str) else text
