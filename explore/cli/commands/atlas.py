"""`explore atlas`: an atlas of coupler curves, as results."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from explore.cli.options import output_option
from explore.cli.output import count_of, say
from explore.cli.paths import check_results_file
from explore.cli.workers import EventPrinter, QuietOption, WorkerOptions, WorkersOption


def atlas(
    output: Annotated[Path | None, output_option(help="Results file; by default results/atlas.h5.")] = None,
    count: Annotated[
        int, typer.Option(min=1, max=10_000_000, help="Number of linkages, a power of two at best.")
    ] = 65_536,
    workers: WorkersOption = None,
    restart: Annotated[bool, typer.Option("--restart", help="Move existing results aside and start over.")] = False,
    quiet: QuietOption = False,
) -> None:
    """Compute coupler curves of crank-rockers of all proportions, as results that all other commands read."""
    from explore.running.runs import run_study
    from explore.studies.config.study_file import atlas_text, parse_study

    study = parse_study(atlas_text(count), "atlas.toml", Path())
    path = output or Path("results") / "atlas.h5"
    check_results_file(path)
    work = WorkerOptions(workers, quiet=quiet)
    safe = "finished blocks are safe, and the same command continues"
    with work.computing(study.request, study.space.n_designs, safe) as (connected, progress):
        summary = run_study(
            study, path, connected, restart=restart, progress=progress, listener=EventPrinter(verbose=False)
        )
    if not quiet:
        turning = f", {summary.n_feasible:,} with transmission from 20 deg" if summary.n_computed == count else ""
        say(f"{count_of(count, 'linkage')}{turning} -> {path}; now run: {shlex.join(['explore', 'rank', str(path)])}")
    if summary.failures:
        raise typer.Exit(3)
