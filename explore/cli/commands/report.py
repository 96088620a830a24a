"""`explore report`: write results as one page for a browser."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from explore.base.errors import RequestError
from explore.cli.options import output_option, results_argument
from explore.cli.output import announce_compiling, say
from explore.cli.paths import check_output, newest_results, refuse_overwriting
from explore.cli.progress import progress_bar
from explore.cli.units import UnitsOption, open_all_shown

if TYPE_CHECKING:
    from explore.figures.reporting.contents import Contents, ReportStep
    from explore.model.mechanism import Mechanism
    from explore.results.store.results import Results

_ENDINGS = (".html", ".htm")


def report(
    results: Annotated[
        list[Path] | None,
        results_argument(
            help="Results files, several of one mechanism on one page; by default the newest results/*.h5."
        ),
    ] = None,
    output: Annotated[Path | None, output_option(help="FILE.html; by default results/NAME-report.html.")] = None,
    units: UnitsOption = None,
) -> None:
    """Write the results as one interactive page for a browser, and print its name."""
    check_output(output, _ENDINGS)
    from explore.figures.reporting.contents import STEPS
    from explore.figures.reporting.pages import write_page
    from explore.results.labels import results_name
    from explore.results.store.open_results import open_comparable

    paths = results or [newest_results()]
    opened = open_all_shown(paths, units)
    sources = {str(paths[0]): opened[0]} if len(paths) == 1 else open_comparable(opened)
    for source in sources.values():
        refuse_overwriting(source.path, output, "the results file")
    names = "+".join(results_name(source) for source in sources.values())
    page = output or Path("results") / f"{names}-report.html"
    with progress_bar("collecting", STEPS) as step:
        contents = _collect(sources, units or [], step)
    page.parent.mkdir(exist_ok=True)
    size = write_page(contents, page)
    parts = contents.study["parts"]
    held, total = (sum(part[name] for part in parts) for name in ("held", "total"))
    if held < total:
        say(f"the page holds {held:,} of {total:,} designs; its top says which", "dim")
    say(f"{size / 1e6:,.1f} MB; open it in a browser, no server or network is needed", "dim")
    say(str(page), data=True)


def _collect(sources: Mapping[str, Results], units: Sequence[str], step: ReportStep) -> Contents:
    """The data of the page of one or of several results."""
    from explore.figures.reporting.contents import collect_contents
    from explore.figures.reporting.joint import collect_joint_contents

    first, *others = sources.values()
    mechanism = _mechanism([first, *others])
    # The ranking in the units of the page; ./ keeps a name from being an option.
    names = [f"./{each.path}" if str(each.path).startswith("-") else str(each.path) for each in sources.values()]
    command = shlex.join(["explore", "rank", *names, *(word for text in units for word in ("--units", text))])
    if others:
        return collect_joint_contents(sources, mechanism, command, step)
    return collect_contents(first, mechanism, command, step)


def _mechanism(sources: Sequence[Results]) -> Mechanism | None:
    """The mechanism of the results; None if this version does not have it, and the page draws none."""
    from explore.studies.config.linkage import mechanism_source
    from explore.studies.request.names import find_mechanism

    announce_compiling()
    try:
        points, target = sources[0].points, sources[0].target
        # The paths of points are drawn where all results have the same.
        is_shared = all(source.points == points for source in sources)
        has_target = is_shared and all(source.target == target for source in sources)
        source = mechanism_source(sources[0])
        return find_mechanism(source, points if is_shared else type(points)(), target if has_target else None)
    except RequestError:
        return None
