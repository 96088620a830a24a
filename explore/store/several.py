"""Opening several results files to be read together."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from explore.errors import RequestError
from explore.store.results import Results, open_results


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
