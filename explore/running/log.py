"""The log of a results file, ``<results>.log.jsonl``: one event a line, as JSON.

It holds times, hosts and workers; the bytes of the results file must not depend on these.
"""

import contextlib
import json
import os
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from explore.base.errors import ResultsError
from explore.base.files import NAME_ANOTHER_FILE, check_regular, open_regular

#: First bytes of every line.
_LINE_START = b'{"time": "'

#: Function of the name of an event and its details.
Listener = Callable[[str, Mapping[str, Any]], None]


def log_path(results: Path) -> Path:
    """Path of the log of a results file."""
    return results.with_name(results.name + ".log.jsonl")


class Log:
    """Appends events to the log of a results file and passes them to a listener.

    The caller holds the lock of the file, so the log has a single writer. A `ResultsError` says that a link, a pipe or
    another program's file has the log's name.
    """

    def __init__(self, results: Path, listener: Listener | None = None) -> None:
        self.path = log_path(results)
        self._listener = listener
        check_regular(self.path)
        is_log = True
        # no log yet; and an unreadable log must not stop a sweep
        with contextlib.suppress(OSError), self.path.open("rb") as file:
            # Lines are not synced to disk, so a power cut may leave zeros.
            is_log = _LINE_START.startswith(file.read(len(_LINE_START)).strip(b"\0"))
        if not is_log:
            raise ResultsError(
                f"{self.path} is not a log of explore, so it is left alone; move it away, or {NAME_ANOTHER_FILE}"
            )

    def __call__(self, event: str, **facts: Any) -> None:
        """Append an event and pass it on."""
        line = json.dumps({"time": datetime.now(UTC).isoformat(timespec="milliseconds"), "event": event, **facts})
        # A log that cannot be written (full disk) must not stop the sweep.
        with contextlib.suppress(OSError):
            descriptor = open_regular(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
            with os.fdopen(descriptor, "a", encoding="utf-8") as stream:
                stream.write(line + "\n")
        if self._listener is not None:
            self._listener(event, facts)
