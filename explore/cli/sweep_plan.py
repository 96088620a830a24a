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
    from explore.model.columns import Arrays

#: Designs are timed for the estimate in pieces spread over the study, of more designs as long as they take less time
#: than this. In a piece, designs that differ only in speed share a motion as in the sweep.
_PIECES, _PIECE_SIZES = 32, (4, 16, 64)
_LEAST_SECONDS = 0.1


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


def _seconds_per_design(study: Study) -> float:
    """Time of one worker per design, measured on designs spread over the study."""
    from explore.evaluation.evaluate import evaluate_columns

    seconds, count = 0.0, 1
    for size in _PIECE_SIZES:
        designs = _spread_designs(study, size)
        # Functions are compiled or loaded when a design first needs them, which takes longer than all these designs.
        evaluate_columns(study.request, designs)
        start = time.perf_counter()
        evaluate_columns(study.request, designs)
        seconds, count = time.perf_counter() - start, len(next(iter(designs.values())))
        if seconds >= _LEAST_SECONDS or count == study.space.n_designs:
            break
    return seconds / count


def _spread_designs(study: Study, size: int) -> Arrays:
    """The designs of pieces of a study, each once: all where the pieces would overlap."""
    space = study.space
    if space.n_designs <= _PIECES * size:
        return space.designs(0, space.n_designs)
    firsts = np.linspace(0, space.n_designs - size, _PIECES).astype(np.int64).tolist()
    pieces = [space.designs(first, first + size) for first in firsts]
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}


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
