"""The files beside a results file, and moving them out of the way."""

from __future__ import annotations

from pathlib import Path

from explore.errors import ResultsError
from explore.store import platform

#: How every HDF5 file begins.
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
ELSEWHERE = "name another file with -o"


def real_path(path: Path) -> Path:
    """The file that a link leads to: locked, written and replaced is that one, by whatever name."""
    try:
        return path.resolve() if path.is_symlink() else path
    except (OSError, RuntimeError):  # which of the two depends on Python's version
        raise ResultsError(f"{path} is a link that leads back to itself; {ELSEWHERE}") from None


def temporary_name(path: Path) -> Path:
    """The name that a file has until it is complete."""
    return path.with_name(path.name + ".tmp")


def journal_name(path: Path) -> Path:
    """The journal of a sweep that keeps only the Pareto set, until it is done."""
    return path.with_name(path.name + ".journal")


def is_hdf5(path: Path) -> bool:
    """Whether there is an HDF5 file: nothing else is ever moved aside or overwritten."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(_SIGNATURE)) == _SIGNATURE


def set_aside(path: Path) -> None:
    """Move a results file and its journal to ``<name>.old``, then ``.old2`` and so on; the caller holds the lock."""
    if path.exists() and not is_hdf5(path):
        raise ResultsError(f"{path} is no results file, so it is left alone; {ELSEWHERE}")
    for file in (path, journal_name(path)):
        if file.exists():
            aside, number = file.with_name(file.name + ".old"), 1
            while aside.exists():
                number += 1
                aside = file.with_name(f"{file.name}.old{number}")
            file.rename(aside)
            platform.sync_folder(file.parent)  # or the new file could take the name before the old one left it
