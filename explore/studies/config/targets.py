"""Read the section [target] of a study."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from explore.base.errors import Problems
from explore.model.mechanism import Mechanism
from explore.studies.request.targets import read_target


def add_target_section(
    mechanism: Mechanism, section: Mapping[str, Any] | None, folder: Path, problems: Problems
) -> Mechanism:
    """The mechanism with the target of a study, a file of points in `folder`; each problem is appended with its key."""
    if section is None:
        return mechanism
    own: Problems = []
    target = read_target(mechanism, section, own, folder)
    problems += [(("target", *key), reason) for key, reason in own]
    return mechanism.with_target(target)
