"""Figures on the page of synthesised linkages, of the design that it shows first, drawn once by `figures.charts`."""

import base64
import html
from collections.abc import Iterator
from dataclasses import dataclass

from explore.base.errors import MotionError, RequestError
from explore.model.output_slider import COLUMNS
from explore.results.store.results import Results

#: Column of candidates that have cognates to draw.
_COGNATE = "cognate"
#: Column of candidates that guide a body.
_BODY_ANGLE = "body_angle"
#: Number of poses that have curves to draw.
_N_BURMESTER_POSES = 4


@dataclass(frozen=True)
class DrawnFigure:
    """A figure with its heading, as SVG; or, without one, the reason."""

    heading: str
    svg: bytes = b""
    reason: str = ""


def draw_figures(results: Results, design: int) -> tuple[DrawnFigure, ...]:
    """The cognates of a path, the Burmester curves of four poses, the slider of a dwell; none of other results."""
    from explore.figures.charts.burmester import burmester_chart
    from explore.figures.charts.cognates import cognates_chart
    from explore.figures.charts.dwell import dwell_chart
    from explore.figures.charts.style import content_of

    names = {column.name for column in results.columns}
    path = results.target.path if results.target else None
    n_places = len(path.points) if path else 0
    charts = {
        "Cognates": (cognates_chart, _COGNATE in names),
        "Burmester curves": (burmester_chart, _BODY_ANGLE in names and n_places == _N_BURMESTER_POSES),
        "Slider and its dwell": (dwell_chart, names.issuperset(COLUMNS)),
    }
    figures = []
    for heading, (chart, is_drawn) in charts.items():
        if not is_drawn:
            continue
        try:
            figures.append(
                DrawnFigure(f"{heading} of design {design}", content_of(chart(results, design=design), ".svg"))
            )
        except (MotionError, RequestError) as error:
            figures.append(DrawnFigure(f"{heading} of design {design}", reason=str(error)))
    return tuple(figures)


def figure_elements(figures: tuple[DrawnFigure, ...]) -> Iterator[str]:
    """The figures as HTML elements; an image cannot run scripts."""
    for figure in figures:
        heading = html.escape(figure.heading)
        yield f'<section class="panel figure" aria-label="{heading}"><div class="panel-head"><h2>{heading}</h2></div>\n'
        if figure.reason:
            yield f"<p>{html.escape(figure.reason)}</p>"
        else:
            image = base64.b64encode(figure.svg).decode()
            yield f'<img alt="{heading}" src="data:image/svg+xml;base64,{image}">'
        yield "</section>\n"
