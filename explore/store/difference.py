"""What changed between two studies, for people."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from explore.errors import ResultsError
from explore.vocabulary import Column

_ABSENT = "(not there)"
_LONGEST_VALUE = 100
_ADVICE = "use --restart to start over, or name another file with -o"
_HIDDEN = ("determines", "request_sha256")


def described(attributes: Mapping[str, Any], n_designs: int, columns: Sequence[Column]) -> dict[str, Any]:
    """What two studies are compared by."""
    return {
        "determines": attributes.get("determines", ""),
        "kernel": attributes.get("kernel"),
        "keep": attributes.get("keep", "all"),
        "designs": n_designs,
        "columns": [column.name for column in columns],
    }


def other_study(path: Path, old: Mapping[str, Any], new: Mapping[str, Any]) -> ResultsError:
    """The error that a file belongs to another study, with what changed.

    Parameters
    ----------
    old, new
        Descriptions of the study of the file and of the one that is to go on. The text ``determines`` is compared key
        by key; hashes are not shown.
    """
    changes = changed_keys(str(old.get("determines", "")), str(new.get("determines", "")))
    changes += changed_values(*({k: v for k, v in each.items() if k not in _HIDDEN} for each in (old, new)))
    lines = "".join(f"\n  {line}" for line in changes or ["what its columns or blocks are"])
    return ResultsError(f"{path} holds the results of another study; what changed:{lines}\n{_ADVICE}")


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
