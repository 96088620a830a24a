"""Parts of error messages: suggestions for unknown names, and shortened or printable values."""

import difflib
from collections.abc import Iterable

#: Length of the longest name that is compared with known names.
_LONGEST_NAME = 200


def closest_name(name: str, names: Iterable[str]) -> str | None:
    """The most similar of `names`, ignoring case; None if none is similar."""
    by_lower = {candidate.lower(): candidate for candidate in names}
    if len(name) > _LONGEST_NAME:
        return None
    matches = difflib.get_close_matches(name.lower().strip(), by_lower, n=1)
    return by_lower[matches[0]] if matches else None


def suggestion(name: str, names: Iterable[str]) -> str:
    """End of a message about an unknown name: the closest allowed name, or all of them if none is close."""
    allowed = list(names)
    match = closest_name(name, allowed)
    return f"did you mean '{match}'?" if match else f"available: {', '.join(allowed)}"


def format_value(value: object) -> str:
    """A value in at most 40 printable characters, for a message of one line."""
    if isinstance(value, bool):
        return str(value).lower()
    try:
        text = str(value)
    except ValueError:  # Python refuses to write out integers of many thousand digits
        text = "the number"
    text = text if len(text) <= 40 else text[:37] + "..."
    text = "".join(letter if letter.isprintable() else "?" for letter in text)
    return f"'{text}'" if isinstance(value, str) else text


def one_line(text: str) -> str:
    """The text with unprintable characters replaced, so that a message stays on one line."""
    return "".join(character if character.isprintable() else "?" for character in text)
