"""`explore sweep`: run, show progress, plan."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from explore.cli.output import compiled_kernels, complain, number, print_table, say
from explore.errors import RequestError

if TYPE_CHECKING:
    from explore.study import Study
    from explore.sweeping import Progress, Summary

#: Seconds between progress lines where there is no terminal.
LINE_INTERVAL = 5.0


def run_sweep(
    config: Path, output: Path | None, workers: int | None, *, dry_run: bool, restart: bool, quiet: bool
) -> int:
    """Sweep a study and return the exit code."""
    with compiled_kernels():
        from explore import sweeping
        from explore.config.study_file import load_study
    study = load_study(config)
    path = output or Path("results") / f"{config.stem}.h5"
    if dry_run:
        _print_plan(study, path)
        return 0
    if path.exists() and path.samefile(config):
        raise RequestError(f"-o {path} is the study itself; name another file")
    try:
        with _progress(study.space.count, quiet=quiet) as progress:
            summary = sweeping.run_study(study, path, workers=workers, restart=restart, progress=progress)
    except KeyboardInterrupt:
        kept = f" -o {output}" if output else ""
        say(f"interrupted; finished blocks are safe in {path}. To go on: explore sweep {config}{kept}")
        return 130
    _report(summary, quiet=quiet)
    _compare_objectives(study, path)
    return 3 if summary.failed else 0


def _compare_objectives(study: Study, path: Path) -> None:
    """[rank] may change without a new sweep, but the file keeps the aims it was made with: say how to use the new."""
    import json

    from explore.store.results import open_results

    aims = [f"{objective.metric}:{objective.sense}" for objective in study.objectives]
    if json.loads(str(open_results(path).attributes["objectives"])) != aims:
        say(f"[rank] differs from the one that {path} was made with; to rank by it: "
            f"explore rank {path} {' '.join(f'--metric {aim}' for aim in aims)}")  # fmt: skip


def _report(summary: Summary, *, quiet: bool) -> None:
    for block, problem in summary.failed.items():
        complain(f"block {block} failed twice and was left out: {problem}")
    if quiet:
        return
    if summary.computed == 0 and not summary.failed:
        say(f"{summary.path} is complete already: {summary.designs:,} designs")
        return
    rate = summary.computed / summary.seconds
    resumed = f", {summary.resumed:,} were there" if summary.resumed else ""
    say(
        f"{summary.computed:,} designs in {summary.seconds:.1f} s ({rate:,.0f}/s){resumed}; "
        f"{summary.feasible:,} feasible; {summary.kinematic_evaluations:,} kinematic evaluations -> {summary.path}"
    )


@contextmanager
def _progress(total: int, *, quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """A bar on a terminal, a line now and then elsewhere."""
    if quiet:
        yield None
    elif sys.stderr.isatty():
        with _bar(total) as update:
            yield update
    else:
        yield _lines()


@contextmanager
def _bar(total: int) -> Iterator[Callable[[Progress], None]]:
    from rich import progress
    from rich.console import Console

    columns = (
        progress.TextColumn("{task.completed:,.0f} of {task.total:,.0f} designs"),
        progress.BarColumn(),
        progress.TaskProgressColumn(),
        progress.TextColumn("{task.fields[rate]}"),
        progress.TextColumn("{task.fields[share]}"),
        progress.TimeRemainingColumn(),
    )
    begun = time.monotonic()
    with progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=total, rate="", share="")

        def update(state: Progress) -> None:
            rate = state.computed / (time.monotonic() - begun)
            share = f"{state.feasible / state.computed:.0%} feasible"
            bar.update(task, completed=state.done, rate=f"{rate:,.0f}/s", share=share)

        yield update


def _lines() -> Callable[[Progress], None]:
    begun = last = time.monotonic()

    def update(state: Progress) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last < LINE_INTERVAL:
            return
        last = now
        rate = state.computed / (now - begun)
        left = (state.total - state.done) / rate
        say(
            f"{state.done:,} of {state.total:,} designs, {rate:,.0f}/s, "
            f"{state.feasible / state.computed:.0%} feasible, {left:.0f} s left"
        )

    return update


def _print_plan(study: Study, path: Path) -> None:
    """What a sweep would do: counts, bytes, an estimate, the first and the last designs."""
    from explore.sweeping import results_columns, row_bytes

    space = study.space
    columns = [column for column in results_columns(study) if column.role == "parameter"]
    edges = [(0, min(2, space.count)), (max(space.count - 2, min(2, space.count)), space.count)]
    rows = []
    for start, stop in edges:
        designs = space.designs(start, stop)
        rows += [
            [str(start + i), *(number(float(designs[column.name][i])) for column in columns)]
            for i in range(stop - start)
        ]
    size = space.count * row_bytes(study)
    say(
        f"{space.count:,} designs ({space.method}) in {space.n_blocks:,} blocks, "
        f"{len(results_columns(study))} columns, {size / 1e6:,.1f} MB -> {path}"
    )
    print_table("first and last designs", [("design", ""), *((c.name, c.unit) for c in columns)], rows)
