"""What the tolerances of a design do to its metrics: how each spreads, and which dimension the spread comes from."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from explore.base.errors import RequestError
from explore.figures.charts import style
from explore.results.labels import unit_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from explore.analysis.tolerancing.robustness import Robustness
    from explore.model.quantities import FloatArray
    from explore.studies.request.tolerances import Tolerance

#: Height of a row, inches.
_ROW_HEIGHT = 1.25
#: Height around the rows, inches.
_REST_HEIGHT = 1.5
#: Letters of a line of the legend.
_LEGEND_LETTERS = 110
#: Width of a mark of the legend with its margins, letters.
_MARK_LETTERS = 9
#: Number of bins of a histogram.
_N_BINS = 60
#: Colours of parameters in turn.
_COLOURS = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.SKY, style.BROWN, style.YELLOW, style.MUTED)
#: Hatches of further parameters that have the same colour.
_HATCHES = ("", "////", "....", "xxxx")
#: Colours on which text is white.
_DARK = (style.BLUE, style.GREEN, style.BROWN)


def tolerance_chart(robustness: Robustness, design: int | None = None) -> Figure:
    """Draw a row for each metric that has a better side or a constraint, for each of all metrics if none has.

    On the left the share of each dimension in the variance, to first order; on the right how the metric spreads over
    parts, with the design (solid), the worst cases over the box of the tolerances (dotted), and the constraints
    (red, the parts beyond them too).

    Parameters
    ----------
    robustness
        The result of `explore.tolerance`.
    design
        Number of the design; None for the first one.
    """
    number = int(robustness.designs.index[0]) if design is None else design
    if number not in robustness.designs.index:
        raise RequestError(f"design {number} was not analysed")
    constraints = robustness.designs.attrs["constraints"]
    senses = robustness.designs.attrs["senses"]
    rows, shares = robustness.metrics_of(number), robustness.by_dimension(number, "share")
    names = [name for name in rows if senses.get(name) or name in constraints] or list(rows)
    figure = style.new_figure(9.0, _REST_HEIGHT + _ROW_HEIGHT * len(names))
    panels = figure.subplots(len(names), 2, squeeze=False, width_ratios=[1, 2])
    sample = robustness.sample(number)
    for (bar, histogram), name in zip(panels, names, strict=True):
        _draw_shares(bar, shares[name])
        bar.set_ylabel(_label(name, rows[name]["unit"]), rotation=0, ha="right", va="center")
        _draw_histogram(histogram, sample[name].to_numpy(), rows[name], constraints.get(name, {}))
    handles, labels = panels[0, 0].get_legend_handles_labels()
    columns = max(1, _LEGEND_LETTERS // (max(map(len, labels)) + _MARK_LETTERS))
    figure.legend(handles, labels, loc="outside lower left", ncols=columns, frameon=False)
    panels[0, 0].set_title("share of the variance", fontsize=10, color=style.INK)
    panels[0, 1].set_title(f"{len(sample):,} parts", fontsize=10, color=style.INK)
    widths = ", ".join(_width(t, robustness.units[t.parameter]) for t in robustness.tolerances)
    text = f"design {number}, {_yield(*robustness.failures.loc[number, ['low', 'high']])}, {widths}"
    style.write_heading(figure, text, 90)
    return figure


def _yield(low: float, high: float) -> str:
    """The yield from the ends of the interval of the failure probability, which is told where the yield rounds to 1."""
    least, most = (f"{100 * (1 - failure):.6g}" for failure in (high, low))
    return f"failure probability {low:.3g} to {high:.3g}" if least == "100" else f"yield {least} to {most} %"


def _width(tolerance: Tolerance, unit: str) -> str:
    width = f"{tolerance.plus_minus:.6g} {unit_text(unit) if unit not in ('', '1') else ''}".rstrip()
    return f"{tolerance.parameter} ± {width} ({tolerance.distribution})"


def _label(name: str, unit: str) -> str:
    """A name with its unit, on lines of about 16 letters."""
    words = name.replace("_", " ") + (f" [{unit_text(unit)}]" if unit not in ("", "1") else "")
    return "\n".join(textwrap.wrap(words, 16))


def _draw_shares(panel: Axes, shares: Mapping[str, float]) -> None:
    start = 0.0
    for k, (name, share) in enumerate(shares.items()):
        width = 0.0 if math.isnan(share) else 100.0 * share
        colour = _COLOURS[k % len(_COLOURS)]
        hatch = _HATCHES[k // len(_COLOURS) % len(_HATCHES)]
        panel.barh(0, width, left=start, height=0.6, fc=colour, ec="white", lw=0, hatch=hatch, label=name)
        if width >= 12.0:
            ink = "white" if colour in _DARK else style.INK
            panel.text(start + width / 2, 0, f"{width:.0f} %", ha="center", va="center", fontsize=8, color=ink)
        start += width
    if start == 0.0:
        panel.text(50, 0, "undefined", ha="center", va="center", fontsize=8, color=style.MUTED)
    panel.set(xlim=(0, 100), ylim=(-0.5, 0.5), yticks=[], xticks=[])
    for side in ("top", "right", "left", "bottom"):
        panel.spines[side].set_visible(False)


def _range_of(values: FloatArray) -> tuple[float, float]:
    """The ends of a histogram, so far apart that its bins differ where the values do only by rounding."""
    low, high = float(values.min()), float(values.max())
    least = 4.0 * _N_BINS * np.spacing(max(abs(low), abs(high)))
    widening = 0.5 * max(0.0, least - (high - low)) if high > low else 0.5
    return low - widening, high + widening


def _draw_histogram(
    panel: Axes, values: FloatArray, row: Mapping[str, Any], bounds: Mapping[str, float | None]
) -> None:
    defined = values[np.isfinite(values)]
    if not len(defined):
        panel.text(0.5, 0.5, "undefined", ha="center", va="center", color=style.MUTED, transform=panel.transAxes)
        panel.set(xticks=[], yticks=[])
        return
    if len(defined) < len(values):
        panel.text(1.0, 1.0, f"{len(values) - len(defined):,} undefined", ha="right", va="top", fontsize=8,
                   color=style.MUTED, transform=panel.transAxes)  # fmt: skip
    counts, edges = np.histogram(defined, _N_BINS, _range_of(defined))
    low, high = bounds.get("min"), bounds.get("max")
    is_missed = (defined < (-math.inf if low is None else low)) | (defined > (math.inf if high is None else high))
    missed, _ = np.histogram(defined[is_missed], edges)
    places = {"x": (edges[1:] + edges[:-1]) / 2, "width": np.diff(edges)}
    panel.bar(height=counts - missed, color=style.SKY, **places)
    panel.bar(height=missed, bottom=counts - missed, color=style.RED, **places)
    panel.axvline(row["nominal"], color=style.INK, lw=1.0)
    for end in (row["low"], row["high"]):
        panel.axvline(end, color=style.INK, lw=1.0, ls=":")
    # The limit of a constraint far away would squeeze the histogram.
    left, right = panel.get_xlim()
    for bound in (low, high):
        if bound is not None and left - (right - left) < bound < right + (right - left):
            panel.axvline(bound, color=style.RED, lw=1.4, ls="-.")
    panel.set_yticks([])
    panel.ticklabel_format(axis="x", useOffset=False)
    panel.tick_params(axis="x", labelsize=8)
    for side in ("top", "right", "left"):
        panel.spines[side].set_visible(False)
