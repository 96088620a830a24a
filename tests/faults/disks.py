"""Disks that are full."""

import shutil
from pathlib import Path


def take_all_but(disk: Path, free: int) -> Path:
    """Fill a disk with another file."""
    other = disk / "other"
    with other.open("wb") as file:
        file.write(bytes(shutil.disk_usage(disk).free - free))
    return other
