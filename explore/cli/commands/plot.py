"""`explore plot`: draw a figure of results."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from explore.base.errors import RequestError
from explore.base.suggest import suggestion
from explore.cli.completion import complete_columns
from explore.cli.options import output_option, results_argument
from explore.cli.output import announce_compiling, say
from explore.cli.paths import FIGURE_ENDINGS, check_output, newest_results, refuse_overwriting
from explore.cli.progress import block_bar
from explore.cli.table_files import load_chart
from explore.cli.units import UnitsOption, open_all_shown

#: Kinds of figures, each with the options that apply to it.
KINDS = {
    "pareto": ("x", "y", "design"),
    "motion": ("design",),
    "mechanism": ("design",),
    "path": ("design",),
    "cognates": ("design",),
    "burmester": ("design",),
    "dwell": ("design",),
    "map": ("x", "y", "metric", "design"),
    "parallel": ("metric",),
    "ratio": ("design",),
}
#: Kinds that simulate a design, which needs the kernels.
_SIMULATED_KINDS = ("motion", "mechanism", "path", "cognates", "burmester", "dwell")

_column_option = partial(typer.Option, metavar="COLUMN", autocompletion=complete_columns)


def plot(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            autocompletion=lambda: list(KINDS),
            help="pareto, motion, mechanism, path, cognates, burmester, dwell, map, parallel or ratio.",
        ),
    ],
    results: Annotated[
        list[Path] | None,
        results_argument(help="A results file, of pareto several together; by default the newest results/*.h5."),
    ] = None,
    output: Annotated[
        Path | None, output_option(help="FILE.png, .svg or .pdf; by default results/NAME-KIND.png.")
    ] = None,
    x: Annotated[str | None, _column_option(help="The horizontal axis.")] = None,
    y: Annotated[str | None, _column_option(help="The vertical axis.")] = None,
    metric: Annotated[str | None, _column_option(help="The colours.")] = None,
    design: Annotated[
        int | None, typer.Option(min=0, help="The design to draw or mark; by default the best of the Pareto set.")
    ] = None,
    units: UnitsOption = None,
) -> None:
    """Draw a figure of the results and print the name of its file."""
    choices = {"x": x, "y": y, "metric": metric, "design": design}
    options = {name: choice for name, choice in choices.items() if choice is not None}
    _check_options(kind, options)
    check_output(output, FIGURE_ENDINGS)
    from explore.figures.charts.style import save_figure
    from explore.results.labels import results_name

    paths = results or [newest_results()]
    _check_several(kind, paths, options)
    sources = open_all_shown(paths, units)
    for source in sources:
        refuse_overwriting(source.path, output, "the results file")
        if source.n_committed == 0:
            raise RequestError(f"{source.path} holds no designs yet, so there is nothing to draw")
    import matplotlib as mpl

    # A dollar sign in a file's name or in the results does not begin a formula.
    with block_bar("drawing"), mpl.rc_context({"text.parse_math": False}):
        if kind in _SIMULATED_KINDS:
            announce_compiling()
        chart = load_chart(kind if len(sources) == 1 else f"joint_{kind}")
        figure = chart(sources[0] if len(sources) == 1 else sources, **options)
        if output is None:
            names = "+".join(results_name(source) for source in sources)
            output = Path("results") / f"{names}-{kind}.png"
            output.parent.mkdir(exist_ok=True)
        save_figure(figure, output)
    say(str(output), data=True)


def _check_options(kind: str, options: Mapping[str, str | int]) -> None:
    """Refuse an unknown kind of figure and options that do not apply to it."""
    if kind not in KINDS:
        raise RequestError(f"unknown kind of figure '{kind}'; {suggestion(kind, KINDS)}")
    for option in options:
        if option not in KINDS[kind]:
            others = ", ".join(other for other, applicable in KINDS.items() if option in applicable)
            raise RequestError(f"--{option} does not apply to '{kind}', only to {others}")


def _check_several(kind: str, paths: Sequence[Path], options: Mapping[str, str | int]) -> None:
    """Refuse several results of a kind that draws one, and a number that designs of several results have."""
    if len(paths) == 1:
        return
    if kind != "pareto":
        raise RequestError(f"'{kind}' draws one results file, not {len(paths)}; only 'pareto' draws several together")
    if "design" in options:
        raise RequestError("--design applies to one results file: each of several has a design of this number")
