"""`explore refine`: draw designs around the Pareto front of results, generation by generation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from explore.cli.options import objective_option, output_option, results_argument
from explore.cli.output import count_of, say
from explore.cli.paths import check_output
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
    from explore.analysis.refining.plan import RefinementPlan
    from explore.running.runs import Summary


def refine(
    results: Annotated[Path, results_argument(help="A finished results file.")],
    output: Annotated[Path | None, output_option(help="New results file; by default RESULTS-refined.h5.")] = None,
    metric: Annotated[
        list[str] | None,
        objective_option(help="NAME, NAME:min or NAME:max, two or more: objectives in place of the study's."),
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
    from explore.analysis.refining.plan import EVALUATIONS, plan_refinement
    from explore.analysis.refining.runs import run_refinement
    from explore.results.store.open_results import open_results

    work = WorkerOptions(workers, processes, scheduler, quiet)
    source = open_results(results)
    path = output or results.with_name(f"{results.stem}-refined.h5")
    check_output(path, (".h5",))
    plan = plan_refinement(source, objectives=metric or None, evaluations=evaluations or EVALUATIONS, seed=seed)
    safe = f"finished generations are safe. To continue: {same_command()}"
    with work.computing(plan.study.request, plan.n_designs, safe) as (connected, progress):
        summary = run_refinement(
            plan, source.path, path, connected, restart=restart, progress=progress,
            listener=EventPrinter(verbose=verbose),
        )  # fmt: skip
    if not quiet:
        _report(summary, plan)


def _report(summary: Summary, plan: RefinementPlan) -> None:
    """Say how many designs were computed, and how the front grew."""
    say_computed(summary)
    from explore.analysis.refining.plan import count_distinct, growth
    from explore.results.ranking.rankings import rank_source
    from explore.results.store.open_results import open_results

    ranking = rank_source(open_results(summary.path))
    if not plan.has_front and ranking.frame.empty:
        say(f"none of the designs is feasible; the nearest of all: explore rank {summary.path} --nearest 10", "yellow")
        return
    frame = {objective.metric: ranking.frame[objective.metric] for objective in plan.objectives}
    n_end = count_distinct(frame, plan.objectives)  # of designs alike, as at a corner of the ranges, one counts
    if plan.has_front:
        n_start = count_distinct(plan.start, plan.objectives)
        verb = "grew" if n_end > n_start else "went"
        text = f"the front {verb} from {count_of(n_start, 'design')} to {n_end:,}"
    else:
        n_start = len(plan.start["design"])
        text = f"from {count_of(n_start, 'design')} near feasible to a front of {count_of(n_end, 'design')}"
    share = growth(plan, ranking)
    say(text if share is None else f"{text}, its hypervolume by {share:.2%}")
