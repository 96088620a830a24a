"""Opening results files, one or several to be read together."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from explore.errors import RequestError, ResultsError
from explore.store.journal import count_records
from explore.store.names import journal_name, real_path
from explore.store.results import Results


def open_results(path: Path | str) -> Results:
    """Open a results file for reading.

    Parameters
    ----------
    path
        The HDF5 file of a sweep, finished or not.

    Returns
    -------
    Results
        Of the blocks that are committed now; the file does not stay open.

    Raises
    ------
    ResultsError
        The file is missing, foreign, damaged or of a newer version.
    """
    path = Path(path)
    _check_finished(path)
    return Results(path)


def open_several(several: Sequence[Results | Path | str]) -> dict[str, Results]:
    """Results by the name of their file; `RequestError` when there are none or one is there twice."""
    for one in several:
        if not isinstance(one, (Results, Path, str)):
            raise RequestError(f"results are read together from files, not from a {type(one).__name__}")
    opened = [one if isinstance(one, Results) else open_results(one) for one in several]
    if not opened:
        raise RequestError("no results to rank; name at least one file")
    for position, result in enumerate(opened):
        if any(result.path.samefile(earlier.path) for earlier in opened[:position]):
            raise RequestError(f"{result.path} is named twice; name each file once")
    return {str(result.path): result for result in opened}


def _check_finished(path: Path) -> None:
    """Say how far a sweep is that keeps only the front, which has no results file before it is done."""
    if path.exists() or not (journal := journal_name(real_path(path))).exists():
        return
    done, header = count_records(journal)
    blocks = header.get("blocks")
    number = f"{blocks:,}" if isinstance(blocks, int) else "unknown"
    raise ResultsError(
        f"{path} is not finished: {done:,} of {number} blocks are done, and it keeps only the "
        "front, which is known at the end; run the sweep again to go on"
    )
