"""All methods, each with the settings at which it is compared."""

from __future__ import annotations

from typing import Any

from explore.methods.closed_form import ClosedForm
from explore.methods.contract import Method


def _settings(kind: Any, name: str, values: tuple[float, ...]) -> tuple[Method, ...]:
    """One method at several settings, from coarse to fine."""
    return tuple(kind(**{name: value}) for value in values)


#: From coarse to fine settings, by name.
METHODS: dict[str, tuple[Method, ...]] = {
    "closed-form": (ClosedForm(),),
}
