"""Check that an open file still has its name: other programs may move, remove or replace it."""

import contextlib
import os
from pathlib import Path

from explore.base.errors import ResultsError


class DisplacedError(ResultsError):
    """A file was moved, removed or replaced while it was written.

    If `is_removed`, no other file has its name, and the content is lost when the file is closed.
    """

    def __init__(self, message: str, *, is_removed: bool) -> None:
        super().__init__(message)
        self.is_removed = is_removed


def check_present(path: Path, descriptor: int, content: str) -> None:
    """Raise `DisplacedError`, which says what happened and where the data are, unless the path leads to the open file.

    `content` is the durable content of the file for the message, such as "65,536 designs".
    """
    status = os.fstat(descriptor)
    is_replaced = False
    with contextlib.suppress(OSError):
        if os.path.samestat(status, path.stat()):
            return
        is_replaced = True
    current_path = _current_path(descriptor)
    # NFS renames a file that is removed while it is open to .nfs…, and removes it when it is closed.
    is_removed = not status.st_nlink or Path(current_path).name.startswith(".nfs")
    if not is_removed:
        change = f"moved to {current_path}{' and replaced by another file' * is_replaced}"
        advice = f"its {content} are safe there: move it back and run the sweep or refinement again to go on"
    elif is_replaced:
        change = "replaced by another file"
        advice = f"its {content} are lost with it: sweep again if the other file is a copy, else move it away first"
    else:
        change = "removed"
        advice = f"its {content} are lost with it: run the sweep or refinement again to start over"
    is_removed = is_removed and not is_replaced
    raise DisplacedError(f"{path} was {change} during the sweep; {advice}", is_removed=is_removed)


def _current_path(descriptor: int) -> str:
    """The current path of an open file, or "another name" if the system does not have it."""
    with contextlib.suppress(OSError):
        target = Path(f"/proc/self/fd/{descriptor}").readlink()
        if not target.name.endswith(" (deleted)"):
            return str(target)
    return "another name"
