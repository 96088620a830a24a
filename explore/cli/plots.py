"""`explore plot`: a figure of results in a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from explore.cli.bars import block_bar
from explore.cli.output import check_output, newest_results, refuse_same, say
from explore.errors import RequestError
from explore.suggest import suggestion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from explore.store.results import Results

_ENDINGS = (".png", ".svg", ".pdf")


@dataclass(frozen=True)
class PlotOptions:
    """What was asked for; None where nothing was."""

    x: str | None = None
    y: str | None = None
    metric: str | None = None
    design: int | None = None


@dataclass(frozen=True)
class Kind:
    """A figure and the options that mean something for it."""

    draw: Callable[[Results, PlotOptions], Figure]
    options: tuple[str, ...] = ()


def check_figure(output: Path | None) -> None:
    """Refuse a file that is no picture, before anything is drawn."""
    check_output(output, _ENDINGS)


def plot_results(name: str, path: Path | None, output: Path | None, options: PlotOptions) -> None:
    """Draw results into a file and print its name."""
    if name not in KINDS:
        raise RequestError(f"unknown kind of figure '{name}'; {suggestion(name, KINDS)}")
    kind = KINDS[name]
    for option, value in vars(options).items():
        if value is not None and option not in kind.options:
            others = ", ".join(known for known, other in KINDS.items() if option in other.options)
            raise RequestError(f"--{option} means nothing for '{name}'; it belongs to {others}")
    check_figure(output)
    from explore.charts.columns import study_name
    from explore.charts.style import save
    from explore.store.opening import open_results

    results = open_results(path or newest_results())
    refuse_same(output, results.path, "the results file")
    if results.n_committed == 0:
        raise RequestError(f"{results.path} holds no designs yet, so there is nothing to draw")
    with block_bar("drawing"):
        figure = kind.draw(results, options)
        if output is None:
            output = Path("results") / f"{study_name(results)}-{name}.png"
            output.parent.mkdir(exist_ok=True)
        save(figure, output)
    say(str(output), data=True)


def _pareto(results: Results, options: PlotOptions) -> Figure:
    from explore.charts.pareto import pareto_chart

    return pareto_chart(results, options.x, options.y, options.design)


def _motion(results: Results, options: PlotOptions) -> Figure:
    from explore.charts.load import load_chart
    from explore.charts.motion import motion_chart
    from explore.cli.simulated import simulated_design

    one = simulated_design(results, options.design)
    if "drive_torque" in one.motion:
        return load_chart(one.motion, one.title, one.limits)
    return motion_chart(one.motion, one.title, one.drive, one.limits, one.phases)


def _mechanism(results: Results, options: PlotOptions) -> Figure:
    from explore.charts.mechanism import mechanism_chart
    from explore.cli.simulated import simulated_design

    one = simulated_design(results, options.design)
    return mechanism_chart(one.motion, one.parameters, one.title, one.drive, one.limits)


def _map(results: Results, options: PlotOptions) -> Figure:
    from explore.charts.map import map_chart

    return map_chart(results, options.x, options.y, options.metric, options.design)


def _parallel(results: Results, _: PlotOptions) -> Figure:
    from explore.charts.parallel import parallel_chart

    return parallel_chart(results)


def _ratio(results: Results, options: PlotOptions) -> Figure:
    from explore.charts.ratio import ratio_chart

    return ratio_chart(results, options.design)


KINDS = {
    "pareto": Kind(_pareto, ("x", "y", "design")),
    "motion": Kind(_motion, ("design",)),
    "mechanism": Kind(_mechanism, ("design",)),
    "map": Kind(_map, ("x", "y", "metric", "design")),
    "parallel": Kind(_parallel),
    "ratio": Kind(_ratio, ("design",)),
}
