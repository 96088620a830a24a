"""What `explore sweep --dry-run` prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from explore.cli.output import count_of, number, say
from explore.cli.tables import print_table

if TYPE_CHECKING:
    from pathlib import Path

    from explore.studies.config.study import Study


def print_plan(study: Study, path: Path, *, keep: str, workers: int | None, on_cluster: bool) -> None:
    """Print counts, bytes, an estimate of the time, the first and the last designs."""
    from explore.running.clusters import processors
    from explore.running.collectors import results_columns, row_bytes
    from explore.running.timing import seconds_per_design

    space, columns = study.space, results_columns(study)
    n_designs = space.n_designs
    row = row_bytes(study)
    size = _bytes(n_designs * row) if keep == "all" else f"{row} bytes for each design kept"
    say(
        f"{n_designs:,} designs ({space.method}) in {count_of(space.n_blocks, 'block')}, {len(columns)} columns, "
        f"{size} -> {path}"
    )
    workers = workers or processors()
    seconds = seconds_per_design(study) * n_designs
    if not on_cluster:
        say(f"{_duration(seconds / workers)} of computing with {count_of(workers, 'worker')}")
    else:
        say(f"{_duration(seconds)} of computing, divided by the workers of the cluster")
    parameters = [column for column in columns if column.role == "parameter"]
    scales = study.units.scales({parameter.name: parameter.unit for parameter in parameters})
    rows = []
    for start, stop in ((0, min(2, n_designs)), (max(n_designs - 2, min(2, n_designs)), n_designs)):
        designs = space.designs(start, stop)  # in the order of the study, which may be another than that of the columns
        rows += [
            [str(design), *(number(scale.show(float(designs[name][design - start]))) for name, scale in scales.items())]
            for design in range(start, stop)
        ]
    print_table(
        "first and last designs", [("design", ""), *((name, scale.shown) for name, scale in scales.items())], rows
    )


def _duration(seconds: float) -> str:
    """A duration with two digits: the estimate is no better."""
    if seconds < 1:
        return "a second or less"
    for length, unit in ((86_400.0, "days"), (3_600.0, "h"), (60.0, "min")):
        if seconds >= 2 * length:
            return f"about {float(f'{seconds / length:.2g}'):,g} {unit}"
    return f"about {seconds:.2g} s"


def _bytes(count: float) -> str:
    for factor, unit in ((1e12, "TB"), (1e9, "GB")):
        if count >= factor:
            return f"{count / factor:,.1f} {unit}"
    return f"{count / 1e6:,.1f} MB"
