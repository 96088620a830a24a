"""A linkage with the slider that it lets rest, and the travel of the slider with its dwell."""

from __future__ import annotations

from typing import TYPE_CHECKING

from explore.base.errors import RequestError
from explore.figures.charts.mechanism import draw_mechanism
from explore.figures.charts.motion import draw_panel
from explore.figures.charts.style import BLUE, new_figure, write_heading
from explore.figures.charts.turn import set_turn_axis
from explore.figures.simulation import simulate_design
from explore.model.output_slider import TRAVEL_PANEL
from explore.results.store.open_results import ResultsOrPath, results_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def dwell_chart(results: ResultsOrPath, *, design: int | None = None) -> Figure:
    """Draw the linkage of one design with its slider, beside the travel of the slider over the turn.

    Parameters and errors are those of `motion_chart`, and `RequestError` if the results have no slider.
    """
    simulated = simulate_design(results_of(results), design)
    if simulated.slider is None:
        raise RequestError("these designs have no slider that rests; draw their mechanism or motion instead")
    figure = new_figure(12.5, 5.6)
    left, right = figure.subplots(1, 2, width_ratios=[1.15, 1.0])
    draw_mechanism(left, simulated)
    draw_panel(right, simulated, TRAVEL_PANEL, BLUE)
    set_turn_axis(right, None, {})
    right.set_xlabel(f"{simulated.mechanism.input_angle} [deg]")
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=10, handlelength=3.5)
    write_heading(figure, simulated.title, 110)
    return figure
