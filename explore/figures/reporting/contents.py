"""The data of a report: facts of the study, and its columns."""

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from explore._version import __version__
from explore.base.errors import RequestError
from explore.base.units.shown import Scale
from explore.figures.charts.bounds import drive_of, interval_of, signal_bounds, uses_drive_stroke
from explore.figures.reporting.density import count_densities
from explore.figures.reporting.figures import DrawnFigure, draw_figures
from explore.figures.reporting.motion import describe_motion, kernel_for, translate_functions
from explore.figures.reporting.packing import ColumnPacker
from explore.figures.reporting.rows import FEASIBLE, FRONT, INFEASIBLE, ReportRows, choose_rows
from explore.model.columns import Attribute, Column
from explore.model.mechanism import Mechanism
from explore.results.labels import results_name, unit_text
from explore.results.ranking.nearest import find_nearest, is_little
from explore.results.ranking.rankings import Ranking, rank_source
from explore.results.store.results import Results
from explore.studies.config.linkage import mechanism_entries, mechanism_source
from explore.studies.config.toml_text import format_toml

#: Attributes that the page shows elsewhere, or that mean nothing to a reader.
_HIDDEN_ATTRIBUTES = frozenset(
    ["config", "determines", "senses", "speed", "speed_powers", "status_sentences", "label_sentences",
     "objectives", "tally", "studied_counts", "n_designs", "block_size", "task"]
)  # fmt: skip
#: Words of the column `feasible`.
_BOOLEAN_LABELS = {0: "no", 1: "yes"}

#: Function that is told the name of each step at its start.
ReportStep = Callable[[str], None]
#: Number of steps of `collect_contents`.
STEPS = 5
#: Largest number of designs that a page lists.
_MOST_DESIGNS = 10
#: Largest number of combinations of constraints that a page lists.
_MOST_COMBINATIONS = 5
#: Numbers of designs to let in by relaxing a constraint.
_LET_IN = (1, 10, 100)


@dataclass(frozen=True)
class Contents:
    """The data of a page.

    Facts of the study, and where the columns are among the packed `texts`, as JSON; the mechanism's functions in
    JavaScript, empty where the page draws no motion; figures of a synthesis.
    """

    study: dict[str, Any]
    texts: list[str]
    kernel: str = ""
    figures: tuple[DrawnFigure, ...] = ()


def collect_contents(results: Results, mechanism: Mechanism | None, command: str, step: ReportStep) -> Contents:
    """Collect the data of a page of results with at least one design, else `RequestError`.

    The mechanism is None if this version does not know it; the page shows the command, which ranks these results.
    `step` is called `STEPS` times, at the start of each step with its name.
    """
    if results.n_committed == 0:
        raise RequestError(f"{results.path} holds no designs yet, so there is nothing to report")
    step("ranking")
    ranking = rank_source(results) if results.objectives else None
    step("choosing designs")
    nearest = describe_nearest(results, _count_feasible(ranking))
    nearest_designs = [design for design, *_ in nearest["designs"]] if nearest else []
    front = ranking.frame.index.to_numpy(np.int64) if ranking else np.empty(0, np.int64)
    rows = choose_rows(results, front, nearest_designs)
    step("reading")
    frame = results.declared.designs(rows.numbers)
    step("packing")
    packer = ColumnPacker()
    # The page computes motions from the declared values and converts the columns itself.
    columns = [
        {**describe_column(c, results.scales[c.name]), "packed": packer.add(frame[c.name].to_numpy())}
        for c in results.columns
        if c.role != "index"
    ]
    study = {
        **describe_study(results, mechanism, ranking),
        "command": command,
        "columns": columns,
        "designs": packer.add(rows.numbers),
        "kinds": packer.add(rows.kinds),
        "parts": [vars(part) for part in rows.parts],
        "nearest": nearest,
        "chosen": _initial_row(ranking, rows, nearest_designs),
    }
    step("counting")
    feasible = rows.parts[FEASIBLE]
    objectives = [metric for metric, _ in study["objectives"]]
    study["density"] = (
        count_densities(results, objectives, results.show(frame), rows, packer)
        if feasible.held < feasible.total
        else None
    )
    kernel = translate_functions(design_kernel(results, mechanism)) if mechanism else ""
    chosen = int(rows.numbers[study["chosen"]])
    return Contents(study, packer.texts, kernel, draw_figures(results, chosen) if mechanism else ())


def _describe_motion(results: Results, mechanism: Mechanism) -> dict[str, Any]:
    kernel = design_kernel(results, mechanism)
    return describe_motion(kernel, results.shown_units, interval_of(results, mechanism))


def describe_column(column: Column, scale: Scale) -> dict[str, Any]:
    """Facts of a column that a page needs beside its values."""
    labels = _BOOLEAN_LABELS if column.name == "feasible" else column.labels
    return {
        "name": column.name,
        "unit": "" if column.unit == "1" else unit_text(column.unit),
        "meaning": column.long_name,
        "role": column.role,
        "labels": {str(code): label for code, label in labels.items()} or None,
        "whole": column.dtype[1] in "iub" or column.name == "feasible",
        "ratio": None if scale.factor == 1 else scale.ratio,
        "heading": column.name if scale.is_declared else f"{column.name} [{column.unit}]",
    }


def describe_study(results: Results, mechanism: Mechanism | None, ranking: Ranking | None) -> dict[str, Any]:
    """Facts of the study as a whole."""
    sentences = results.status_sentences
    parameters = mechanism.parameters if mechanism else ()
    return {
        "name": results_name(results),
        "version": __version__,
        "mechanism": results.mechanism,
        "head": _head(results, mechanism),
        "points": list(results.points),
        "summary": mechanism.summary if mechanism else "",
        "motion": _describe_motion(results, mechanism) if mechanism else None,
        "defaults": {p.name: p.default for p in parameters if p.default is not None},
        **_window_and_drive(results, mechanism),
        "target": _describe_target(results, mechanism),
        "studied": results.n_studied,
        "committed": results.n_committed,
        "complete": results.is_complete,
        "keep": results.keep,
        "counts": [[label, count, sentences.get(label, "")] for label, count in results.counts.items()],
        "sentences": sentences,
        "objectives": [[o.metric, o.sense] for o in ranking.objectives] if ranking else [],
        "feasible": _count_feasible(ranking),
        "missed": _describe_constraints(results, ranking),
        "bounds": _bounds(results, mechanism),
        "facts": [[k, _words(k, v)] for k, v in sorted(results.attributes.items()) if k not in _HIDDEN_ATTRIBUTES],
        "config": results.config,
    }


def _head(results: Results, mechanism: Mechanism | None) -> str:
    """What the study of a design alone says before its parameters: of the mechanism, and its target."""
    target = {"target": results.target.to_content()} if results.target else {}
    return format_toml({**mechanism_entries(mechanism_source(results) if mechanism else results.mechanism), **target})


def _words(name: str, value: Attribute) -> str:
    """A fact in words: what a synthesis tried is a list of sentences."""
    return "; ".join(json.loads(str(value))) if name == "tried" else str(value)


def _count_feasible(ranking: Ranking | None) -> int | None:
    return ranking.tally.n_feasible if ranking else None


def design_kernel(results: Results, mechanism: Mechanism) -> Mechanism:
    """The mechanism that computes the motions of the page: with forces only where the study has loads."""
    return kernel_for(mechanism, {column.name for column in results.columns if column.role == "parameter"})


def _window_and_drive(results: Results, mechanism: Mechanism | None) -> dict[str, str]:
    """The window of the study, and the drive stroke, "none" where the study does not use it."""
    window = results.window
    if not isinstance(window, str):
        window = f"{window['from']:g} to {window['to']:g} deg"
    drive = drive_of(results, mechanism) if mechanism else ""
    uses_stroke = mechanism is not None and uses_drive_stroke(results, mechanism)
    return {"window": window, "drive": drive if uses_stroke else "none"}


def _describe_target(results: Results, mechanism: Mechanism | None) -> dict[str, Any] | None:
    """The path that a point of the linkage shall follow, in declared units; None where there is none."""
    target, scale = results.target.path if results.target else None, results.shown_units.scale("mm")
    if target is None:
        return None
    return {
        "point": mechanism.drawn_point(target.point) if mechanism else target.point,
        "points": [list(place) for place in target.points],
        "closed": target.closed,
        "timed": bool(target.crank_angles),
        "unit": scale.shown,
        "factor": float(scale.factor),
    }


def _bounds(results: Results, mechanism: Mechanism | None) -> list[list[Any]]:
    """Each bound on a signal: its name, side, declared value, and the input angles or the stroke where it holds."""
    bounds = signal_bounds(results.declared, mechanism) if mechanism else []
    return [[bound.signal, bound.side, bound.value, bound.stroke or bound.span] for bound in bounds]


def _describe_constraints(results: Results, ranking: Ranking | None) -> list[list[Any]]:
    """Metric, bounds and unit of each constraint, and how many designs miss it and have it undefined."""
    tally = ranking.tally if ranking else None
    return [
        [metric, _finite(sides["min"]), _finite(sides["max"]), unit_text(results.units.get(f"{metric}_margin", "")),
         tally.by_constraint[f"{metric}_margin"] if tally else None,
         tally.by_undefined_constraint[f"{metric}_margin"] if tally else None]
        for metric, sides in results.constraints.items()
    ]  # fmt: skip


def _finite(bound: float | None) -> float | None:
    """The bound; None if it is infinite."""
    return bound if bound is not None and math.isfinite(bound) else None


def _initial_row(ranking: Ranking | None, rows: ReportRows, nearest: Sequence[int]) -> int:
    """Row of the design that is shown first: the best by the first objective, else a feasible one, else the nearest."""
    if ranking is not None and len(ranking.frame):
        place = int(np.searchsorted(rows.numbers, int(ranking.frame.index[0])))
        if place < len(rows.numbers) and rows.numbers[place] == ranking.frame.index[0]:
            return place
    best = np.flatnonzero(rows.kinds == FRONT)
    feasible = best if len(best) else np.flatnonzero(rows.kinds != INFEASIBLE)
    if len(feasible):
        return int(feasible[0])
    return int(np.searchsorted(rows.numbers, nearest[0])) if nearest else 0


def data_elements(contents: Contents) -> Iterator[str]:
    """The data as HTML elements; no text of the data can close its element or open another."""
    text = json.dumps(contents.study, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    yield '<script type="application/json" id="study">'
    yield text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    yield "</script>\n"
    for number, packed in enumerate(contents.texts):
        yield f'<script type="text/plain" id="data-{number}">{packed}</script>\n'


def describe_nearest(results: Results, n_feasible: int | None) -> dict[str, Any] | None:
    """The designs nearest to feasible and what excludes the others, as JSON; None where enough is feasible.

    Results of the front alone have no infeasible designs.
    """
    if n_feasible is None or results.keep != "all" or not results.constraints:
        return None
    if not is_little(n_feasible, results.n_committed):
        return None
    nearness = find_nearest(results, _MOST_DESIGNS)
    exclusions = nearness.exclusions
    units = {metric: unit_text(results.units.get(f"{metric}_margin", "")) for metric in nearness.scales}
    designs = []
    for design, row in zip(nearness.frame.index, nearness.frame.to_dict(orient="records"), strict=True):
        margins = {metric: float(row[f"{metric}_margin"]) for metric in nearness.scales}
        missed = [[metric, -margin, units[metric]] for metric, margin in margins.items() if margin < 0.0]
        unknown = [metric for metric, margin in margins.items() if math.isnan(margin)]
        designs.append([int(design), float(row["violation"]), missed, unknown])
    widths = {metric: [[n, exclusions.relaxation(metric, n)] for n in _LET_IN] for metric in nearness.scales}
    return {
        "designs": designs,
        "alone": {metric: exclusions.alone(metric) for metric in nearness.scales},
        "lets_in": {metric: [pair for pair in pairs if pair[1] is not None] for metric, pairs in widths.items()},
        "together": [[list(metrics), count] for metrics, count in exclusions.together()[:_MOST_COMBINATIONS]],
    }
