"""`explore sensitivity`: which parameters decide on feasibility, and on metrics where designs are feasible."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from explore.cli.options import JsonOption, ResultsArgument, objective_option, output_option
from explore.cli.output import number, print_json, say
from explore.cli.paths import newest_results, refuse_overwriting
from explore.cli.table_files import check_outputs, write_output
from explore.cli.tables import print_table
from explore.cli.workers import ProcessesOption, SchedulerOption, WorkerOptions, WorkersOption

if TYPE_CHECKING:
    import pandas as pd

    from explore.analysis.sensitivity.feasibility import FeasibilityIndices
    from explore.analysis.sensitivity.public import SensitivityPlan


#: Sentence on results whose parameters depend on each other.
_DEPENDENT = "the parameters of feasible designs depend on each other: shares overlap, and there is no total index"


def sensitivity(
    results: ResultsArgument = None,
    metric: Annotated[
        list[str] | None,
        objective_option(help="A metric to apportion, several times for several; by default the study's objectives."),
    ] = None,
    evaluations: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="N", help="Designs to draw for the feasibility; default: as many as the study has."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of these designs.")] = 0,
    workers: WorkersOption = None,
    processes: ProcessesOption = False,
    scheduler: SchedulerOption = None,
    as_json: JsonOption = False,
    output: Annotated[
        list[Path] | None, output_option(help="Also write the indices: a figure .png, .svg, .pdf; .csv, .json, .md.")
    ] = None,
) -> None:
    """Show which parameters decide on feasibility, and on metrics where designs are feasible."""
    path = results or newest_results()
    check_outputs(output or [])
    for other in output or []:
        refuse_overwriting(path, other, "the results file")
    from explore.analysis.sensitivity.public import plan_sensitivity
    from explore.results.store.open_results import open_results

    plan = plan_sensitivity(open_results(path), metric, evaluations, seed)
    found = _evaluate(plan, WorkerOptions(workers, processes, scheduler))
    try:
        table = plan.table(found)
    except KeyboardInterrupt:
        say("interrupted; nothing was written", "yellow")
        raise typer.Exit(130) from None
    if as_json:
        print_json({**table.attrs, "indices": table.to_dict(orient="records")})
    else:
        _print(table)
    for note in table.attrs["notes"]:
        say(note, "yellow")
    for other in output or []:
        write_output(other, table.set_index("output"), {}, "sensitivity", table)


def _evaluate(plan: SensitivityPlan, work: WorkerOptions) -> FeasibilityIndices | None:
    """Draw and evaluate designs, if the study has ranges to draw from."""
    if plan.feasibility is None:
        return None
    from explore.analysis.sensitivity.feasibility import run_feasibility

    request, n_designs = plan.feasibility.study.request, plan.feasibility.points.n_evaluations
    with work.computing(request, n_designs, "nothing was written") as (connected, progress):
        return run_feasibility(plan.feasibility, connected, progress)


def _print(table: pd.DataFrame) -> None:
    from explore.analysis.sensitivity.public import FEASIBLE

    for name, rows in table.groupby("output", sort=False):
        if name == FEASIBLE:
            _print_feasibility(rows, table.attrs["feasible"])
        else:
            _print_metric(str(name), rows)
    is_feasibility = table["output"] == FEASIBLE
    are_all_feasible = table.attrs["feasible"] > 0 and not is_feasibility.any()
    if not (is_feasibility.all() or are_all_feasible):
        say(_DEPENDENT, data=True)
    open_ones = [f"{row.output} over {row.parameter}" for row in table[~table["converged"]].itertuples()]
    if open_ones:
        say(f"not converged over bins, of which more designs make more: {', '.join(open_ones)}", data=True)


def _print_feasibility(rows: pd.DataFrame, n_feasible: int) -> None:
    """Print the indices of the feasibility, the most influential parameter first."""
    count = int(rows["designs"].iloc[0])
    columns = [(name, "") for name in ("parameter", "first order", "interval", "total", "interval")]
    cells = [
        [row["parameter"], _share(row["first_order"]), _interval(row, "first_order"), _share(row["total"]),
         _interval(row, "total")]
        for row in rows.sort_values("total", ascending=False).to_dict(orient="records")
    ]  # fmt: skip
    title = f"feasibility of {count:,} newly drawn designs, {n_feasible / count:.3%} feasible"
    alone = rows["first_order"].sum()
    print_table(title, columns, cells, f"alone the parameters explain {alone:.1%} of its variance, the rest together")


def _print_metric(name: str, rows: pd.DataFrame) -> None:
    """Print the indices of one metric, the most influential parameter first."""
    columns = [(name, "") for name in ("parameter", "first order", "interval", "bins", "half the bins", "converged")]
    cells = [
        [row["parameter"], _share(row["first_order"]), _interval(row, "first_order"), f"{row['bins']:,}",
         _share(row["coarser"]), number(row["converged"])]
        for row in rows.sort_values("first_order", ascending=False).to_dict(orient="records")
    ]  # fmt: skip
    undefined = int(rows["undefined"].max())
    left_out = f", without {undefined:,} where it is undefined" if undefined else ""
    print_table(f"{name} of {int(rows['designs'].max()):,} feasible designs{left_out}", columns, cells)


def _interval(row: Mapping[Hashable, float], kind: str) -> str:
    low, high = row[f"{kind}_low"], row[f"{kind}_high"]
    return "exact" if low == high else f"{_share(low)} to {_share(high)}"


def _share(value: float) -> str:
    return "–" if value != value else f"{value:.4f}"
