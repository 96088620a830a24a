"""`explore report`: write results as one page for a browser."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from explore.cli.options import ResultsArgument
from explore.cli.output import announce_compiling, say
from explore.cli.paths import check_output, newest_results, refuse_overwriting
from explore.cli.progress import progress_bar
from explore.errors import RequestError

if TYPE_CHECKING:
    from explore.model.mechanism import Mechanism
    from explore.store.results import Results

_ENDINGS = (".html", ".htm")


def report(
    results: ResultsArgument = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="FILE.html; by default results/NAME-report.html.")
    ] = None,
) -> None:
    """Write the results as one interactive page for a browser, and print its name."""
    check_output(output, _ENDINGS)
    from explore import open_results
    from explore.charts.labels import results_name
    from explore.reporting.contents import STEPS, collect_contents
    from explore.reporting.pages import write_page

    opened = open_results(results or newest_results())
    refuse_overwriting(opened.path, output, "the results file")
    page = output or Path("results") / f"{results_name(opened)}-report.html"
    with progress_bar("collecting", STEPS) as step:
        contents = collect_contents(opened, _mechanism(opened), _rank_command(opened.path), step)
    page.parent.mkdir(exist_ok=True)
    size = write_page(contents, page)
    parts = contents.study["parts"]
    held, total = (sum(part[name] for part in parts) for name in ("held", "total"))
    if held < total:
        say(f"the page holds {held:,} of {total:,} designs; its top says which", "dim")
    say(f"{size / 1e6:,.1f} MB; open it in a browser, no server or network is needed", "dim")
    say(str(page), data=True)


def _rank_command(path: Path) -> str:
    """The shell command that ranks the results; ./ keeps a name from being taken for an option."""
    return f"explore rank {shlex.quote(f'./{path}' if str(path).startswith('-') else str(path))}"


def _mechanism(results: Results) -> Mechanism | None:
    """The mechanism of the results; None if this version does not have it, and the page draws none."""
    from explore.request.names import find_mechanism

    announce_compiling()
    try:
        return find_mechanism(results.mechanism, results.points)
    except RequestError:
        return None
