"""`explore refine`: draw designs around the Pareto front of results, generation by generation."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from explore.cli.completion import complete_objectives
from explore.cli.output import announce_compiling, count_of, say
from explore.cli.paths import check_output
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
    from explore.analysis.refining.plan import RefinementPlan
    from explore.running.runs import Summary


def refine(
    results: Annotated[Path, typer.Argument(metavar="RESULTS", help="A finished results file.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="New results file; by default RESULTS-refined.h5.")
    ] = None,
    metric: Annotated[
        list[str] | None,
        typer.Option(
            autocompletion=complete_objectives,
            help="NAME, NAME:min or NAME:max, two or more: objectives in place of the study's.",
        ),
    ] = None,
    evaluations: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Number of designs to evaluate; default: 262,144.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random steps.")] = 0,
    workers: WorkersOption = None,
    processes: ProcessesOption = False,
    scheduler: SchedulerOption = None,
    restart: Annotated[bool, typer.Option("--restart", help="Move existing results aside and start over.")] = False,
    verbose: VerboseOption = False,
    quiet: QuietOption = False,
) -> None:
    """Improve the Pareto front of results; run it again to continue an interrupted refinement."""
    work = WorkerOptions(workers, processes, scheduler, verbose, quiet)
    raise typer.Exit(_refine(RefineOptions(results, output, metric or [], evaluations, seed, restart, work)))


@dataclass(frozen=True)
class RefineOptions:
    """The options of a refinement."""

    results: Path
    output: Path | None
    metrics: list[str]
    evaluations: int | None
    seed: int
    restart: bool
    work: WorkerOptions

    @property
    def path(self) -> Path:
        """The new results file."""
        return self.output or self.results.with_name(f"{self.results.stem}-refined.h5")

    @property
    def command(self) -> str:
        """The command line that continues this refinement: the same without --restart."""
        words = ["explore", "refine", str(self.results)]
        words += ["-o", str(self.output)] if self.output else []
        words += [word for metric in self.metrics for word in ("--metric", metric)]
        words += ["--evaluations", str(self.evaluations)] if self.evaluations else []
        words += ["--seed", str(self.seed)] if self.seed else []
        return shlex.join(words + self.work.places + self.work.prints)


def _refine(options: RefineOptions) -> int:
    """Refine the front of results and return the exit code."""
    from explore.analysis.refining.plan import EVALUATIONS, plan_refinement
    from explore.analysis.refining.runs import run_refinement
    from explore.evaluation.evaluate import compile_kernels
    from explore.results.store.open_results import open_results

    source = open_results(options.results)
    check_output(options.path, (".h5",))
    evaluations = options.evaluations or EVALUATIONS
    plan = plan_refinement(source, objectives=options.metrics or None, evaluations=evaluations, seed=options.seed)
    request, work = plan.study.request, options.work
    cluster = work.cluster(request.mechanism.name)
    if not work.quiet:
        announce_compiling()
    if work.scheduler is None:
        compile_kernels(request)
    try:
        with work.connected(cluster, plan.n_designs) as (connected, progress):
            summary = run_refinement(
                plan, source.path, options.path, connected, restart=options.restart, progress=progress,
                listener=EventPrinter(verbose=work.verbose),
            )  # fmt: skip
    except KeyboardInterrupt:
        say(f"interrupted; finished generations are safe. To continue: {options.command}")
        return 130
    if not work.quiet:
        _report(summary, plan)
    return 0


def _report(summary: Summary, plan: RefinementPlan) -> None:
    """Say how many designs were computed, and how the front grew."""
    if summary.n_computed:
        rate = summary.n_computed / summary.seconds
        resumed = f", {summary.n_resumed:,} were there" if summary.n_resumed else ""
        say(
            f"{count_of(summary.n_computed, 'design')} in {summary.seconds:.1f} s ({rate:,.0f}/s){resumed}; "
            f"{summary.n_feasible:,} feasible -> {summary.path}"
        )
    else:
        say(f"{summary.path} is complete already: {summary.n_designs:,} designs")
    from explore.analysis.refining.plan import growth
    from explore.results.ranking.rankings import rank_source
    from explore.results.store.open_results import open_results

    ranking = rank_source(open_results(summary.path))
    n_start = len(plan.start["design"])
    if not plan.has_front and ranking.frame.empty:
        say(f"none of the designs is feasible; the nearest of all: explore rank {summary.path} --nearest 10", "yellow")
        return
    if plan.has_front:
        text = f"the front grew from {count_of(n_start, 'design')} to {len(ranking.frame):,}"
    else:
        text = f"from {n_start:,} designs near feasible to a front of {count_of(len(ranking.frame), 'design')}"
    share = growth(plan, ranking)
    say(text if share is None else f"{text}, its hypervolume by {share:.2%}")
