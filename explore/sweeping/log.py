"""The log of a results file: what happened when and where, one JSON object a line, in ``<results>.log.jsonl``.

Times, hosts and workers stand here and not in the results file, whose bytes must not depend on them.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

#: Gets every event as it happens: its name and what is known of it.
Listener = Callable[[str, Mapping[str, Any]], None]


def log_path(results: Path) -> Path:
    """The log of a results file."""
    return results.with_name(results.name + ".log.jsonl")


class Log:
    """Appends events to the log of a results file and tells a listener.

    Parameters
    ----------
    results
        The results file; the caller holds its lock, so there is one log writer.
    listener
        Told too, if there is one.
    """

    def __init__(self, results: Path, listener: Listener | None = None) -> None:
        self.path = log_path(results)
        self._listener = listener

    def __call__(self, event: str, **facts: Any) -> None:
        """Note an event."""
        line = json.dumps({"time": datetime.now(UTC).isoformat(timespec="milliseconds"), "event": event, **facts})
        # A log that cannot be written, on a full disk say, must not cost the sweep its results.
        with contextlib.suppress(OSError), self.path.open("a", encoding="utf-8") as stream:
            stream.write(line + "\n")
        if self._listener is not None:
            self._listener(event, facts)
