"""What the service tells about results, in the words of `explore show` and `explore rank`."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from explore.base.errors import RequestError
from explore.base.json_text import json_value
from explore.base.units.shown import read_shown_units
from explore.figures.exporting.formats import export
from explore.model.mechanism import Mechanism
from explore.results.ranking.rankings import RankRequest, rank_source
from explore.results.records import label_record, summarise, with_status
from explore.results.store.open_results import open_results
from explore.results.store.results import Results
from explore.results.store.study_units import given_units, units_of_study
from explore.results.store.table_words import with_labels, with_units
from explore.studies.config.linkage import mechanism_of


def open_shown(path: Path) -> Results:
    """Results in the units of their study."""
    results = open_results(path)
    units = read_shown_units(units_of_study(results))
    return results.in_units(units.with_given(given_units(results)))


def with_mechanism(results: Results) -> tuple[Results, Mechanism]:
    """Results and their mechanism; `RequestError` if this version does not have it."""
    return results, mechanism_of(results)


def show(results: Results) -> dict[str, Any]:
    """What `explore show --json` prints, with the name in place of the path on the server, and what ranks them."""
    named = {"name": results.path.stem, "objectives": results.objectives, "constraints": results.constraints}
    return dict(json_value({**named, **summarise(results)}))


def list_columns(results: Results) -> list[dict[str, Any]]:
    """The columns: name, unit, role, meaning, and the words of codes."""
    return [
        {
            "name": column.name,
            "unit": column.unit,
            "role": column.role,
            "meaning": column.long_name,
            "labels": {str(code): label for code, label in column.labels.items()},
        }
        for column in results.columns
    ]


def show_design(results: Results, number: int) -> dict[str, Any]:
    """What `explore show --design NUMBER --json` prints."""
    return dict(json_value(with_status(results, label_record(results, results.design(number)))))


def export_design(path: Path, number: int, ending: str) -> bytes:
    """The file that `explore export --design NUMBER -o NAME.ENDING` writes, named without the server's folder."""
    with TemporaryDirectory() as folder:
        written = Path(folder) / f"design.{ending}"
        export(open_results(path), written, design=number)
        return written.read_bytes()


def rank_results(
    path: Path,
    metrics: Sequence[str],
    where: str | None,
    limits: Sequence[str],
    fronts: int,
    quality: bool,
    top: int,
) -> dict[str, Any]:
    """The Pareto set, as `explore rank` makes it: one metric orders it, several replace the study's objectives."""
    results = open_shown(path)
    request = RankRequest.from_words(metrics, where, limits, fronts=fronts, quality=quality)
    if results.n_committed == 0:
        raise RequestError("the results hold no designs yet")
    ranking = rank_source(results, request)
    table = with_units(with_labels(ranking.frame.head(top), results.columns), results.scales)
    return dict(
        json_value(
            {
                "objectives": [f"{objective.metric}:{objective.sense}" for objective in ranking.objectives],
                "order_by": ranking.order_by.metric,
                "complete": results.is_complete,
                "committed": results.n_committed,
                "found": len(ranking.frame),
                "units": results.units,
                "designs": table.reset_index().to_dict(orient="records"),
            }
        )
    )
