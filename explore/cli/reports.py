"""`explore report`: results as one page for a browser."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from explore.cli.bars import counted as counted_bar
from explore.cli.output import compiled_kernels, newest_results, refuse_same, say
from explore.errors import RequestError

if TYPE_CHECKING:
    from explore.store.results import Results
    from explore.vocabulary import Mechanism

_ENDINGS = (".html", ".htm")


def write_report(path: Path | None, output: Path | None) -> None:
    """Write the page and print its name."""
    _check_output(output)
    from explore.charts.columns import study_name
    from explore.reporting.contents import STEPS, collect
    from explore.reporting.pages import write_page
    from explore.store.opening import open_results

    results = open_results(path or newest_results())
    refuse_same(output, results.path, "the results file")
    if output is None:
        output = Path("results") / f"{study_name(results)}-report.html"
    with counted_bar("collecting", STEPS) as step:
        contents = collect(results, _mechanism(results), _rank_command(results.path), step)
    output.parent.mkdir(exist_ok=True)
    size = write_page(contents, output)
    parts = contents.study["parts"]
    held, there = (sum(part[name] for part in parts) for name in ("held", "there"))
    if held < there:
        say(f"the page holds {held:,} of {there:,} designs; it says which", "dim")
    say(f"{size / 1e6:,.1f} MB; open it in a browser, no server or network is needed", "dim")
    say(str(output), data=True)


def _check_output(output: Path | None) -> None:
    """Refuse a file that could not be written, before anything is read."""
    if output is None:
        return
    if output.suffix.lower() not in _ENDINGS:
        raise RequestError(f"-o {output}: the name must end in .html")
    if output.is_dir() or not output.parent.is_dir():
        what = "it is a folder" if output.is_dir() else f"there is no folder {output.parent}"
        raise RequestError(f"-o {output}: {what}; name another file")


def _rank_command(path: Path) -> str:
    """The command that ranks the results, as a shell takes it; a name may begin like an option."""
    return f"explore rank {shlex.quote(f'./{path}' if str(path).startswith('-') else str(path))}"


def _mechanism(results: Results) -> Mechanism | None:
    """The mechanism of a study; None when it is not known here: the page then draws none."""
    with compiled_kernels():
        from explore.request.requests import find_mechanism
    try:
        return find_mechanism(str(results.attributes.get("mechanism", "")))
    except RequestError:
        return None
