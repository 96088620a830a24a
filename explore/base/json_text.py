"""Values of tables as JSON."""

import json
import math
from collections.abc import Mapping
from typing import Any


def json_text(value: object) -> str:
    """JSON, with null for NaN and infinities."""
    return json.dumps(json_value(value), indent=2, ensure_ascii=False)


def json_value(value: Any) -> Any:
    """A value in containers and numbers of the types that `json` writes, with None for NaN and infinities."""
    if isinstance(value, Mapping):
        return {str(key): json_value(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [json_value(item) for item in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
