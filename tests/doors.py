"""What each way into a results file hands out, as a text to be compared with that of another file."""

import tempfile
from pathlib import Path
from typing import Any

import explore
from explore.base.errors import ExploreError
from explore.figures.reporting.contents import collect_contents
from explore.mechanisms.registry import MECHANISMS
from explore.results.browsing.building import build_index
from explore.results.browsing.index_files import identify, open_index


def _text_of_frame(frame: Any) -> str:
    # Of all digits: repr of a float gives back its bits, and those of a NaN do not matter.
    return repr((frame.reset_index().to_dict(orient="list"), dict(frame.attrs)))


def _read_results(path: Path) -> str:
    return _text_of_frame(explore.read_results(path))


def _one_column(path: Path) -> str:
    return _text_of_frame(explore.open_results(path).to_pandas(["cv"]))


def _designs(path: Path) -> str:
    results = explore.open_results(path)
    return repr((_text_of_frame(results.designs([7, 2])), results.design(3), results.counts, results.constraints))


def _xarray(path: Path) -> str:
    data = explore.xarray(path)
    return repr(({name: data[name].to_numpy().tolist() for name in data.variables}, dict(data.attrs)))


def _rank(path: Path) -> str:
    return _text_of_frame(explore.rank(path))


def _index(path: Path) -> str:
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "index"
        build_index(explore.open_results(path), place, lambda share: None)
        index = open_index(place, identify(path))
        return repr([(column.facts, column.values(slice(None)).tolist()) for column in index.columns.values()])


def _report(path: Path) -> str:
    results = explore.open_results(path)
    contents = collect_contents(results, MECHANISMS[results.mechanism], "", lambda _: None)
    return repr(contents).replace(str(path), "")


DOORS = {
    "read_results": _read_results, "one column": _one_column, "designs": _designs, "xarray": _xarray, "rank": _rank,
    "index": _index, "report": _report,
}  # fmt: skip


def knock(path: Path, door: str) -> str:
    """What one way hands out, or "refused" and the line of the error; other exceptions are not caught."""
    try:
        return DOORS[door](path)
    except ExploreError as error:
        return f"refused: {error}"
