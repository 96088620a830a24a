"""The journal and the unfinished files beside a results file: names, signatures, moving them aside, removing them."""

import os
from pathlib import Path

from explore.base.errors import ResultsError
from explore.base.files import NAME_ANOTHER_FILE, check_regular, remove_unfinished, sync_folder

#: Signature of HDF5 files.
_HDF5 = b"\x89HDF\r\n\x1a\n"
#: Signature of journals with each record on a new page.
JOURNAL = b"explore journal 2\n"
#: Signature of journals of version 1, without gaps between records.
JOURNAL_1 = b"explore journal 1\n"


def journal_name(path: Path) -> Path:
    """The journal of an unfinished sweep that keeps only the Pareto set."""
    return path.with_name(path.name + ".journal")


def remove_leftovers(path: Path) -> None:
    """Remove unfinished files of killed writers of a results file or its journal; the caller holds the lock."""
    remove_unfinished(path)
    remove_unfinished(journal_name(path))


def is_hdf5(path: Path) -> bool:
    """Whether the file has the signature of HDF5; no other file is moved aside or overwritten."""
    return _begins(path, _HDF5)


def _begins(path: Path, *signatures: bytes) -> bool:
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(max(map(len, signatures))).startswith(signatures)


def set_aside(path: Path) -> None:
    """Move a results file and its journal to ``<name>.old``, then ``.old2`` and so on; the caller holds the lock."""
    if path.exists() and not is_hdf5(path):
        raise ResultsError(f"{path} is not a results file, so it is left alone; {NAME_ANOTHER_FILE}")
    check_journal(path)
    for file in (path, journal_name(path)):
        if file.exists():
            aside, number = file.with_name(file.name + ".old"), 1
            while os.path.lexists(aside):
                number += 1
                aside = file.with_name(f"{file.name}.old{number}")
            file.rename(aside)
            sync_folder(file.parent)  # or a power cut after a new file got the name could lose the old one


def check_journal(path: Path) -> None:
    """Raise `ResultsError` if another program's file has the name of the journal."""
    journal = journal_name(path)
    check_regular(journal)
    if journal.exists() and not _begins(journal, JOURNAL, JOURNAL_1):
        raise ResultsError(f"{journal} is not a journal, so it is left alone; move it away, or {NAME_ANOTHER_FILE}")
