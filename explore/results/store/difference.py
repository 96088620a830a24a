"""Describe the differences between two studies."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from explore.base.errors import ResultsError
from explore.base.files import NAME_ANOTHER_FILE
from explore.model.columns import Column

_ABSENT = "(not there)"
_LONGEST_VALUE = 100
_ADVICE = f"use `restart=True` to start over, or {NAME_ANOTHER_FILE}"
_HIDDEN = ("determines", "request_sha256")
#: Ending of the keys of checksums of designs, of a table or of the start of a refinement.
_CHECKSUM = ".sha256"


def study_description(attributes: Mapping[str, Any], n_designs: int, columns: Sequence[Column]) -> dict[str, Any]:
    """The properties by which two studies are compared."""
    return {
        "determines": attributes.get("determines", ""),
        "kernel": attributes.get("kernel"),
        "keep": attributes.get("keep", "all"),
        "designs": n_designs,
        "columns": [column.name for column in columns],
    }


def other_study_error(path: Path, old: Mapping[str, Any], new: Mapping[str, Any]) -> ResultsError:
    """Make the error that a file belongs to another study, with a line for each difference.

    `old` and `new` describe the study of the file and the one to be swept. The text ``determines`` is compared key by
    key; hashes are not shown.
    """
    changes = changed_values(*(_flatten(str(study.get("determines", ""))) for study in (old, new)))
    shown = ({key: value for key, value in study.items() if key not in _HIDDEN} for study in (old, new))
    changes += changed_values(*shown)
    lines = "".join(f"\n  {line}" for line in changes or ["its columns or blocks"])
    return ResultsError(f"{path} holds the results of another study; what changed:{lines}\n{_ADVICE}")


def changed_values(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """Differences between two mappings: a line ``key: old -> new`` for each key; of checksums that they differ."""
    keys = [key for key in dict.fromkeys((*old, *new)) if old.get(key, _ABSENT) != new.get(key, _ABSENT)]
    return [_describe_change(key, old, new) for key in keys]


def _describe_change(key: str, old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    if key.endswith(_CHECKSUM) and key in old and key in new:
        return f"{key.removesuffix(_CHECKSUM)}: other designs"
    return f"{key}: {_format_value(old, key)} -> {_format_value(new, key)}"


def _flatten(text: str) -> dict[str, Any]:
    """The values of nested JSON objects by dotted key."""
    try:
        remaining = {"": json.loads(text)}
    except ValueError:
        return {"study": text}
    flat: dict[str, Any] = {}
    while remaining:
        key, value = remaining.popitem()
        if isinstance(value, dict):
            remaining |= {f"{key}.{name}" if key else name: value[name] for name in reversed(value)}
        else:
            flat[key] = value
    return flat


def _format_value(values: Mapping[str, Any], key: str) -> str:
    text = json.dumps(values[key], ensure_ascii=False) if key in values else _ABSENT
    return text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE - 2]} …"
