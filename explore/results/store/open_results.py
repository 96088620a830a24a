"""Open one results file, or several to read together."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from explore.base.errors import RequestError, ResultsError
from explore.base.files import real_path
from explore.results.store.difference import other_study_error
from explore.results.store.records import count_records
from explore.results.store.results import Results
from explore.results.store.sidecar_files import journal_name

if TYPE_CHECKING:
    from xarray import Dataset

#: Results, or the path of their file.
ResultsOrPath = Results | Path | str


def open_results(path: Path | str) -> Results:
    """Open a results file for reading.

    Parameters
    ----------
    path
        The HDF5 file of a sweep, finished or not.

    Returns
    -------
    Results
        The results of the blocks that are committed now; the file does not stay open.

    Raises
    ------
    ResultsError
        The file is missing, was not written by explore, is damaged or of a newer version, or is a study.
    """
    path = Path(path)
    _check_finished(path)
    try:
        return Results(path)
    except ResultsError as error:
        if advice := _advice_for_study(path):
            raise ResultsError(advice) from error
        raise


def results_of(source: ResultsOrPath) -> Results:
    """The results themselves, or those of the file at a path; see `open_results`."""
    return source if isinstance(source, Results) else open_results(source)


def open_several(sources: Sequence[ResultsOrPath]) -> dict[str, Results]:
    """Results by the name of their file; `RequestError` if there are none or one is named twice."""
    sources = [sources] if isinstance(sources, (Results, Path, str)) else sources
    for source in sources:
        if not isinstance(source, (Results, Path, str)):
            raise RequestError(f"results are read together from files, not from a {type(source).__name__}")
    several = [results_of(source) for source in sources]
    if not several:
        raise RequestError("no results to rank; name at least one file")
    for position, results in enumerate(several):
        if any(results.path.samefile(earlier.path) for earlier in several[:position]):
            raise RequestError(f"{results.path} is named twice; name each file once")
    return {str(results.path): results for results in several}


def open_comparable(sources: Sequence[ResultsOrPath]) -> dict[str, Results]:
    """Results of one mechanism, with designs, by the name of their file, to be drawn together; see `open_several`."""
    results = open_several(sources)
    first = next(iter(results.values()))
    for other in results.values():
        if other.mechanism != first.mechanism:
            kinds = f"{other.path} is of the mechanism {other.mechanism}, but {first.path} of {first.mechanism}"
            raise RequestError(f"{kinds}; name results of one mechanism")
        if other.n_committed == 0:
            raise RequestError(f"{other.path} holds no designs yet; leave it out")
    return results


def xarray(results: ResultsOrPath) -> Dataset:
    """The committed designs as an xarray dataset, whose columns are read when values are needed.

    Parameters
    ----------
    results
        Results or the path of a results file.

    Returns
    -------
    xarray.Dataset
        A variable for each column along the dimension "design", with the attributes "units" and "long_name", and
        "flag_values" and "flag_meanings" (CF conventions) where integer codes have labels. The dataset's
        attributes are those of the results file. ``dataset.chunk("auto")`` makes dask arrays of it.

    Raises
    ------
    RequestError
        If xarray is not installed: ``pip install "linkage-explore[xarray]"``.
    ResultsError
        If the file cannot be read.
    """
    return results_of(results).to_xarray()


def _advice_for_study(path: Path) -> str:
    """Advice when the path is of a study in place of its results; empty if it is not a study."""
    results = Path("results") / f"{path.stem}.h5"
    if path.suffix.lower() != ".toml" or not path.exists():
        return ""
    if results.exists() or journal_name(results).exists():
        return f"{path} is a study, not its results; did you mean {results}?"
    return f"{path} is a study, not its results; sweep it first"


def _check_finished(path: Path) -> None:
    """Raise `ResultsError` with the progress of an unfinished sweep that keeps the front only."""
    if path.exists() or not (journal := journal_name(real_path(path))).exists():
        return
    n_done, header = count_records(journal)
    n_blocks = header.get("blocks")
    number = f"{n_blocks:,}" if isinstance(n_blocks, int) else "unknown"
    raise ResultsError(
        f"{path} is not finished: {n_done:,} of {number} blocks are done, and it keeps only the "
        "front, which is known at the end; run the sweep again to go on"
    )


def refuse_other_content(path: Path, name: str, content: Mapping[str, Any]) -> None:
    """Raise `ResultsError` unless an attribute of results is a text of TOML with a content; it says what differs."""
    recorded = tomllib.loads(str(open_results(path).attributes.get(name, "")))
    if recorded != content:
        raise other_study_error(path, *({"determines": json.dumps(each, default=str)} for each in (recorded, content)))
