"""`explore sweep`: compute every design of a study, or with --dry-run say what that takes."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from explore.cli.explanations import explain_unreachable
from explore.cli.nearness import summarise_nearest
from explore.cli.options import KeepOption, output_option
from explore.cli.output import announce_compiling, complain, count_of, number, say
from explore.cli.paths import check_results_file, refuse_overwriting
from explore.cli.tables import print_table
from explore.cli.workers import (
    EventPrinter,
    ProcessesOption,
    QuietOption,
    SchedulerOption,
    VerboseOption,
    WorkerOptions,
    WorkersOption,
    same_command,
    say_computed,
)

if TYPE_CHECKING:
    from explore.running.runs import Summary
    from explore.studies.config.study import Study


def sweep(
    config: Annotated[Path, typer.Argument(metavar="STUDY", help="The study, a TOML file.")],
    output: Annotated[Path | None, output_option(help="Results file; by default results/NAME.h5.")] = None,
    workers: WorkersOption = None,
    processes: ProcessesOption = False,
    scheduler: SchedulerOption = None,
    keep: Annotated[KeepOption, typer.Option(help="Keep every design, or only the Pareto set.")] = KeepOption.all,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show what would be computed, and compute nothing.")
    ] = False,
    restart: Annotated[bool, typer.Option("--restart", help="Move existing results aside and start over.")] = False,
    max_failures: Annotated[
        int | None, typer.Option(min=0, help="Stop when more blocks than this have failed.")
    ] = None,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop at the first block that fails.")] = False,
    verbose: VerboseOption = False,
    quiet: QuietOption = False,
) -> None:
    """Compute every design of a study; run it again to continue an interrupted sweep."""
    from explore.studies.config import toml_text

    work = WorkerOptions(workers, processes, scheduler, quiet)
    toml_text.read_text(str(config))  # reports a missing file before anything slow is imported
    from explore.studies.config.study_file import load_study

    study, path = load_study(config), output or Path("results") / f"{config.stem}.h5"
    if dry_run:
        announce_compiling()
        _print_plan(study, path, keep=keep.value, workers=workers, on_cluster=scheduler is not None)
        return
    refuse_overwriting(config, path, "the study")
    check_results_file(path)
    from explore.running.runs import run_study

    safe = f"finished blocks are safe. To continue: {same_command()}"
    with work.computing(study.request, study.space.n_designs, safe) as (connected, progress):
        summary = run_study(
            study, path, connected, keep=keep.value, max_failures=0 if fail_fast else max_failures, restart=restart,
            progress=progress, listener=EventPrinter(verbose=verbose),
        )  # fmt: skip
    _report(summary, study, keep, quiet=quiet)
    if path.exists():
        _report_changes(study, path, keep)
    raise typer.Exit(3 if summary.failures else 0)


def _report_changes(study: Study, path: Path, keep: KeepOption) -> None:
    """Print what shows the results by the study's objectives and in its units, if they were made with others."""
    from explore import open_results
    from explore.results.store.study_units import units_of_study

    results = open_results(path)
    objectives = [f"{objective.metric}:{objective.sense}" for objective in study.objectives]
    if keep == KeepOption.all and results.objectives != tuple(objectives):
        options = [word for objective in objectives for word in ("--metric", objective)]
        command = shlex.join(["explore", "rank", str(path), *options])
        say(f"[rank] differs from the one that {path} was made with; to rank by it: {command}")
    if study.units.units != units_of_study(results):
        units = [f"{name}={unit}" for name, unit in study.units.units.items()] or ["declared"]
        option = shlex.join(word for unit in units for word in ("--units", unit))
        say(f"[units] differs from the one that {path} was made with; to show it in these units: {option}")


def _report(summary: Summary, study: Study, keep: KeepOption, *, quiet: bool) -> None:
    if summary.failures:
        blocks = count_of(len(summary.failures), "block")
        until = "; the front is written when all are computed" if keep == KeepOption.front else ""
        complain(f"{blocks} failed; run the same command again to compute what is missing{until}")
    if quiet or (summary.failures and keep == KeepOption.front):
        return
    say_computed(summary, f"; {count_of(summary.kinematic_evaluations, 'kinematic evaluation')}")
    if not summary.n_computed and not summary.failures:
        return
    from explore import open_results
    from explore.results.ranking.nearest import is_little
    from explore.studies.designs.solved_lengths import SolvedSpace

    results = open_results(summary.path).in_units(study.units)
    if isinstance(study.space, SolvedSpace):
        explain_unreachable(results, study.space.solved_length, study.units)
    # A resumed sweep counts only those that it computed.
    if not summary.n_resumed and is_little(summary.n_feasible, summary.n_computed):
        summarise_nearest(results, with_unmeasured=True)


def _print_plan(study: Study, path: Path, *, keep: str, workers: int | None, on_cluster: bool) -> None:
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
