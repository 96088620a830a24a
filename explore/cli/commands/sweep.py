"""`explore sweep`: compute every design of a study."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from explore.base.errors import ResultsError
from explore.cli.explanations import explain_unreachable
from explore.cli.nearness import summarise_nearest
from explore.cli.options import KeepOption
from explore.cli.output import announce_compiling, complain, count_of, say
from explore.cli.paths import refuse_overwriting
from explore.cli.workers import (
    EventPrinter,
    ProcessesOption,
    QuietOption,
    SchedulerOption,
    VerboseOption,
    WorkerOptions,
    WorkersOption,
)

if TYPE_CHECKING:
    from explore.base.units.shown import ShownUnits
    from explore.cli.workers import Workers
    from explore.running.runs import Summary
    from explore.studies.config.study import Study


def sweep(
    config: Annotated[Path, typer.Argument(metavar="STUDY", help="The study, a TOML file.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Results file; by default results/NAME.h5.")
    ] = None,
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
    options = SweepOptions(
        config=config,
        output=output,
        keep=keep.value,
        restart=restart,
        max_failures=0 if fail_fast else max_failures,
        work=WorkerOptions(workers, processes, scheduler, verbose, quiet),
    )
    raise typer.Exit(_sweep(options, dry_run=dry_run))


@dataclass(frozen=True)
class SweepOptions:
    """The options of a sweep."""

    config: Path
    output: Path | None
    keep: Literal["all", "front"]
    restart: bool
    max_failures: int | None
    work: WorkerOptions

    @property
    def path(self) -> Path:
        """The results file."""
        return self.output or Path("results") / f"{self.config.stem}.h5"

    @property
    def command(self) -> str:
        """The command line that continues this sweep: the same without --restart."""
        words = ["explore", "sweep", str(self.config)]
        words += ["-o", str(self.output)] if self.output else []
        words += self.work.places
        words += ["--keep", self.keep] if self.keep != "all" else []
        words += ["--max-failures", str(self.max_failures)] if self.max_failures is not None else []
        return shlex.join(words + self.work.prints)


def _sweep(options: SweepOptions, *, dry_run: bool) -> int:
    """Sweep a study and return the exit code."""
    from explore.studies.config import toml_text

    toml_text.read_text(str(options.config))  # reports a missing file before anything slow is imported
    from explore.evaluation.evaluate import compile_kernels
    from explore.studies.config.study_file import load_study

    study = load_study(options.config)
    path, cluster = options.path, options.work.cluster(study.request.mechanism.name)
    if dry_run:
        from explore.cli.sweep_plan import print_plan

        announce_compiling()
        print_plan(
            study, path, keep=options.keep, workers=options.work.workers, on_cluster=options.work.scheduler is not None
        )
        return 0
    refuse_overwriting(options.config, path, "the study")
    if path.is_dir():
        raise ResultsError(f"{path} is a folder; name another file with -o")
    if not options.work.quiet:
        announce_compiling()
    if options.work.scheduler is None:
        compile_kernels(study.request)
    try:
        summary = _run(study, options, cluster)
    except KeyboardInterrupt:
        say(f"interrupted; finished blocks are safe. To continue: {options.command}")
        return 130
    _report(summary, study, options)
    if options.keep == "all":
        _report_changed_objectives(study, path)
    _report_changed_units(study, path)
    return 3 if summary.failures else 0


def _run(study: Study, options: SweepOptions, cluster: Workers) -> Summary:
    """Compute the study into the results file, with progress and events on stderr."""
    from explore.running.runs import run_study

    with options.work.connected(cluster, study.space.n_designs) as (connected, progress):
        return run_study(
            study,
            options.path,
            connected,
            keep=options.keep,
            max_failures=options.max_failures,
            restart=options.restart,
            progress=progress,
            listener=EventPrinter(verbose=options.work.verbose),
        )


def _report_changed_objectives(study: Study, path: Path) -> None:
    """Print the command that ranks by the study's objectives if the results were made with others."""
    from explore import open_results

    objectives = [f"{objective.metric}:{objective.sense}" for objective in study.objectives]
    if open_results(path).objectives != tuple(objectives):
        options = [word for objective in objectives for word in ("--metric", objective)]
        command = shlex.join(["explore", "rank", str(path), *options])
        say(f"[rank] differs from the one that {path} was made with; to rank by it: {command}")


def _report_changed_units(study: Study, path: Path) -> None:
    """Print the option that shows the results in the study's units if they were made with others."""
    from explore import open_results
    from explore.results.store.study_units import units_of_study

    if path.exists() and study.units.units != units_of_study(open_results(path)):
        units = [f"{name}={unit}" for name, unit in study.units.units.items()] or ["declared"]
        option = shlex.join(word for unit in units for word in ("--units", unit))
        say(f"[units] differs from the one that {path} was made with; to show it in these units: {option}")


def _report(summary: Summary, study: Study, options: SweepOptions) -> None:
    if summary.failures:
        blocks = count_of(len(summary.failures), "block")
        until = "; the front is written when all are computed" if options.keep == "front" else ""
        complain(f"{blocks} failed; run the same command again to compute what is missing{until}")
    if options.work.quiet or (summary.failures and options.keep == "front"):
        return
    if summary.n_computed == 0 and not summary.failures:
        say(f"{summary.path} is complete already: {summary.n_designs:,} designs")
        return
    rate = summary.n_computed / summary.seconds
    resumed = f", {summary.n_resumed:,} were there" if summary.n_resumed else ""
    evaluations = count_of(summary.kinematic_evaluations, "kinematic evaluation")
    say(
        f"{count_of(summary.n_computed, 'design')} in {summary.seconds:.1f} s ({rate:,.0f}/s){resumed}; "
        f"{summary.n_feasible:,} feasible; {evaluations} -> {summary.path}"
    )
    _report_unreachable(summary.path, study)
    _report_nearest(summary, study.units)


def _report_nearest(summary: Summary, units: ShownUnits) -> None:
    """Say which designs are nearest to feasible if few are; a resumed sweep counts only those that it computed."""
    from explore import open_results
    from explore.results.ranking.nearest import is_little

    if not summary.n_resumed and is_little(summary.n_feasible, summary.n_computed):
        summarise_nearest(open_results(summary.path).in_units(units), with_unmeasured=True)


def _report_unreachable(path: Path, study: Study) -> None:
    from explore import open_results
    from explore.studies.designs.solved_lengths import SolvedSpace

    if isinstance(study.space, SolvedSpace):
        results = open_results(path).in_units(study.units)
        explain_unreachable(results, study.space.solved_length, study.units)
