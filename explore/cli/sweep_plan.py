"""What `explore sweep --dry-run` prints."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from explore.cli.output import count_of, number, say
from explore.cli.tables import print_table

if TYPE_CHECKING:
    from pathlib import Path

    from explore.config.study import Study

#: Designs that are timed for the estimate, in pieces spread over the study: a fraction of a second.
_PIECES = 32
_PIECE_SIZE = 256


def print_plan(study: Study, path: Path, *, keep: str, workers: int | None, on_cluster: bool) -> None:
    """Print counts, bytes, an estimate of the time, the first and the last designs."""
    from explore.sweeping.clusters import processors
    from explore.sweeping.collectors import results_columns, row_bytes

    space, columns = study.space, results_columns(study)
    n_designs = space.n_designs
    row = row_bytes(study)
    size = _bytes(n_designs * row) if keep == "all" else f"{row} bytes for each design kept"
    say(
        f"{n_designs:,} designs ({space.method}) in {count_of(space.n_blocks, 'block')}, {len(columns)} columns, "
        f"{size} -> {path}"
    )
    workers = workers or processors()
    seconds = _seconds_per_design(study) * n_designs
    if not on_cluster:
        say(f"{_duration(seconds / workers)} of computing with {count_of(workers, 'worker')}")
    else:
        say(f"{_duration(seconds)} of computing, divided by the workers of the cluster")
    parameters = [column for column in columns if column.role == "parameter"]
    rows = [
        [str(design), *(number(float(value)) for value in values)]
        for start, stop in ((0, min(2, n_designs)), (max(n_designs - 2, min(2, n_designs)), n_designs))
        for design, *values in zip(range(start, stop), *space.designs(start, stop).values(), strict=True)
    ]
    print_table("first and last designs", [("design", ""), *((c.name, c.unit) for c in parameters)], rows)


def _seconds_per_design(study: Study) -> float:
    """Time of one worker per design, measured on designs spread over the study."""
    from explore.evaluation.evaluate import evaluate_columns

    n_designs = study.space.n_designs
    firsts = np.unique(np.linspace(0, max(n_designs - _PIECE_SIZE, 0), _PIECES).astype(np.int64)).tolist()
    pieces = [study.space.designs(first, min(first + _PIECE_SIZE, n_designs)) for first in firsts]
    designs = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    # Functions are compiled or loaded when a design first needs them, which takes longer than all these designs.
    evaluate_columns(study.request, designs)
    timed = {name: column[::4] for name, column in designs.items()}
    start = time.perf_counter()
    evaluate_columns(study.request, timed)
    return (time.perf_counter() - start) / len(next(iter(timed.values())))


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
