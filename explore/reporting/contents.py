"""What a page says of a study, and its columns, from a results file."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from explore._version import __version__
from explore.charts.columns import study_name, unit_text
from explore.errors import RequestError, ResultsError
from explore.ranking.rankings import Ranking, rank_source
from explore.reporting.density import densities
from explore.reporting.packing import Packed
from explore.reporting.rows import FEASIBLE, FRONT, INFEASIBLE, Rows, choose_rows
from explore.store.results import Results
from explore.vocabulary import Column, Mechanism

#: Facts that say nothing to a reader of the page, or are told elsewhere on it.
_UNTOLD = frozenset(
    ["config", "determines", "senses", "speed", "speed_powers", "status_sentences", "objectives", "tally",
     "studied_counts", "n_designs", "block_size"]
)  # fmt: skip
_BOOLEAN = {0: "no", 1: "yes"}

Step = Callable[[str], None]


@dataclass(frozen=True)
class Contents:
    """A page: what is said as plain data, and the texts that hold its columns."""

    study: dict[str, Any]
    texts: list[str]


def collect(results: Results, mechanism: Mechanism | None, command: str, step: Step) -> Contents:
    """Collect a page.

    Parameters
    ----------
    results
        With at least one design.
    mechanism
        The one of the study; None when it is not known here.
    command
        The command that ranks these results, for people to go on from.
    step
        Called at the beginning of each of `STEPS` steps, with what it is.

    Raises
    ------
    RequestError
        If there are no designs.
    ResultsError
        If what is known of the study cannot be read.
    """
    if results.n_committed == 0:
        raise RequestError(f"{results.path} holds no designs yet, so there is nothing to report")
    step("ranking")
    ranking = rank_source(results) if _texts(results, "objectives", []) else None
    step("choosing designs")
    rows = choose_rows(results, ranking)
    step("reading")
    frame = results.rows(rows.numbers)
    step("packing")
    packed = Packed()
    columns = [_column(c, packed.add(frame[c.name].to_numpy())) for c in results.columns if c.role != "index"]
    study = {
        **_study(results, mechanism, ranking),
        "command": command,
        "columns": columns,
        "designs": packed.add(rows.numbers),
        "kinds": packed.add(rows.kinds),
        "parts": [vars(part) for part in rows.parts],
        "chosen": _chosen(ranking, rows),
    }
    step("counting")
    left_out = rows.parts[FEASIBLE].held < rows.parts[FEASIBLE].there
    aims = [metric for metric, _ in study["objectives"]]
    study["density"] = densities(results, aims, frame, rows, packed) if left_out else None
    return Contents(study, packed.texts)


#: Steps of `collect`.
STEPS = 5


def _column(column: Column, place: dict[str, int | str]) -> dict[str, Any]:
    labels = _BOOLEAN if column.name == "feasible" else column.labels
    return {
        "name": column.name,
        "unit": "" if column.unit == "1" else unit_text(column.unit),
        "meaning": column.long_name,
        "role": column.role,
        "labels": {str(code): label for code, label in labels.items()} or None,
        "whole": column.dtype[1] in "iub" or column.name == "feasible",
        "packed": place,
    }


def _study(results: Results, mechanism: Mechanism | None, ranking: Ranking | None) -> dict[str, Any]:
    """What is known of the study as a whole."""
    sentences = _texts(results, "status_sentences", {})
    parameters = mechanism.parameters if mechanism else ()
    return {
        "name": study_name(results),
        "version": __version__,
        "mechanism": str(results.attributes.get("mechanism", "")),
        "summary": mechanism.summary if mechanism else "",
        "defaults": {p.name: p.default for p in parameters if p.default is not None},
        **_evaluated(results),
        "studied": results.n_studied,
        "committed": results.n_committed,
        "complete": results.complete,
        "keep": results.keep,
        "counts": [[label, count, sentences.get(label, "")] for label, count in results.counts.items()],
        "sentences": sentences,
        "objectives": [[o.metric, o.sense] for o in ranking.objectives] if ranking else [],
        "feasible": ranking.tally.ranked + ranking.tally.not_finite if ranking else None,
        "missed": _missed(results, ranking),
        "facts": [[k, str(v)] for k, v in sorted(results.attributes.items()) if k not in _UNTOLD],
        "config": results.config,
    }


def _evaluated(results: Results) -> dict[str, str]:
    """The window and the drive stroke of the study, as far as it names them."""
    try:
        found = json.loads(str(results.attributes.get("determines", "{}"))).get("evaluate", {})
        given = {name: found.get(name, "") for name in ("drive", "window")}
    except (ValueError, AttributeError) as error:
        raise ResultsError(f"{results.path} is damaged: its window cannot be read ({error})") from error
    return {name: value if isinstance(value, str) else json.dumps(value) for name, value in given.items()}


def _missed(results: Results, ranking: Ranking | None) -> list[list[Any]]:
    """Each constraint as written: metric, bounds, unit, how many designs miss it, and in how many it is undefined."""
    tally = ranking.tally if ranking else None
    return [
        [metric, _finite(sides["min"]), _finite(sides["max"]), unit_text(results.units.get(f"{metric}_margin", "")),
         tally.by_constraint[f"{metric}_margin"] if tally else None,
         tally.undefined[f"{metric}_margin"] if tally else None]
        for metric, sides in results.constraints.items()
    ]  # fmt: skip


def _finite(bound: float | None) -> float | None:
    """A bound that bounds nothing is none."""
    return bound if bound is not None and math.isfinite(bound) else None


def _chosen(ranking: Ranking | None, rows: Rows) -> int:
    """Place of the design that is shown first: the best by the first objective, else any that is feasible."""
    if ranking is not None and len(ranking.frame):
        place = int(np.searchsorted(rows.numbers, int(ranking.frame.index[0])))
        if place < len(rows.numbers) and rows.numbers[place] == ranking.frame.index[0]:
            return place
    best = np.flatnonzero(rows.kinds == FRONT)
    feasible = best if len(best) else np.flatnonzero(rows.kinds != INFEASIBLE)
    return int(feasible[0]) if len(feasible) else 0


def _texts(results: Results, name: str, otherwise: Any) -> Any:
    """A fact of the study that is kept as JSON."""
    return json.loads(str(results.attributes.get(name, "null"))) or otherwise


def pieces_of(contents: Contents) -> Iterator[str]:
    """The page's data as HTML, in pieces; nothing in it can end its element or begin another."""
    text = json.dumps(contents.study, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    yield '<script type="application/json" id="study">'
    yield text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    yield "</script>\n"
    for number, packed in enumerate(contents.texts):
        yield f'<script type="text/plain" id="data-{number}">{packed}</script>\n'
