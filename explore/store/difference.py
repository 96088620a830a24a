"""What changed between two studies, for people."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

_ABSENT = "(not there)"
_LONGEST_VALUE = 100


def changed_keys(old: str, new: str) -> list[str]:
    """What differs between two JSON texts: a line ``key: old -> new`` for each dotted key."""
    return changed_values(_flat(old), _flat(new))


def changed_values(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """What differs between two mappings: a line ``key: old -> new`` for each key."""
    return [
        f"{key}: {_short(old, key)} -> {_short(new, key)}"
        for key in dict.fromkeys((*old, *new))
        if old.get(key, _ABSENT) != new.get(key, _ABSENT)
    ]


def _flat(text: str) -> dict[str, Any]:
    """The values of nested JSON objects by dotted key."""
    try:
        left = {"": json.loads(text)}
    except ValueError:
        return {"study": text}
    flat: dict[str, Any] = {}
    while left:
        key, value = left.popitem()
        if isinstance(value, dict):
            left |= {f"{key}.{name}" if key else name: value[name] for name in reversed(value)}
        else:
            flat[key] = value
    return flat


def _short(values: Mapping[str, Any], key: str) -> str:
    text = json.dumps(values[key], ensure_ascii=False) if key in values else _ABSENT
    return text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE - 2]} …"
