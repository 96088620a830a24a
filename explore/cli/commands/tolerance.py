"""`explore tolerance`: what tolerances of the dimensions do to chosen designs, and how many parts are good."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.cli.options import JsonOption, ResultsArgument
from explore.cli.output import announce_compiling, count_of, number, print_json, say, shown_unit
from explore.cli.paths import FIGURE_ENDINGS, check_new_file, check_output, newest_results, refuse_overwriting
from explore.cli.progress import block_bar
from explore.cli.settings import number_or_text
from explore.cli.table_files import ENDINGS, check_table, with_labels, write_table
from explore.cli.tables import print_table
from explore.cli.termination import terminable
from explore.cli.workers import ProcessesOption, SchedulerOption, WorkerOptions, WorkersOption
from explore.errors import RequestError

if TYPE_CHECKING:
    from explore.api.robustness import Robustness

_RESULTS_ENDING = ".h5"
#: Rows of the printed yield front.
_N_LINES = 20


def tolerance(
    results: ResultsArgument = None,
    design: Annotated[
        list[int] | None, typer.Option(help="A design, several times for several; by default the Pareto set.")
    ] = None,
    tolerances: Annotated[
        list[str] | None,
        typer.Option(
            "--tolerance",
            metavar="NAME=VALUE",
            help="Half the width: crank=0.1, 'coupler=50 um', rocker=0.2:uniform; in place of the study's.",
        ),
    ] = None,
    draws: Annotated[
        int | None, typer.Option(min=2, metavar="N", help="Parts to draw of each design; default: 262,144.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the draws.")] = 0,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="Also write the designs: a results file .h5; .csv, .json, .md, .parquet; a figure .png, .svg, .pdf.",
        ),
    ] = None,
    as_json: JsonOption = False,
    restart: Annotated[bool, typer.Option("--restart", help="Move an existing results file aside.")] = False,
    workers: WorkersOption = None,
    processes: ProcessesOption = False,
    scheduler: SchedulerOption = None,
) -> None:
    """Find how far tolerances move the metrics of designs, and how many parts meet the constraints."""
    path = results or newest_results()
    _check_outputs(path, output or [])
    work = WorkerOptions(workers, processes, scheduler, verbose=False, quiet=False)
    from explore.api.tolerances import DRAWS, check_target, plan_tolerances
    from explore.evaluation.evaluate import compile_kernels
    from explore.store.open_results import open_results

    source = open_results(path)
    plan = plan_tolerances(source, _parse(tolerances or []), design or None, draws=draws or DRAWS, seed=seed)
    for target in output or []:
        if target.suffix.lower() == _RESULTS_ENDING:
            check_target(source, target, restart=restart)
    announce_compiling()
    cluster = work.cluster(plan.run.request.request.mechanism.name)
    if work.scheduler is None:
        compile_kernels(plan.run.request.exact.request)
    try:
        with terminable(), block_bar("parts drawn") as progress:
            robustness = plan.robustness(plan.run.compute(cluster, progress))
    except KeyboardInterrupt:
        say("interrupted; nothing was written")
        raise typer.Exit(130) from None
    if as_json:
        print_json(_as_json(robustness))
    elif len(robustness.designs) == 1:
        _print_design(robustness)
    else:
        _print_front(robustness)
    for target in output or []:
        if target.suffix.lower() == _RESULTS_ENDING:
            plan.write(robustness, target, restart=restart)
        else:
            _write(robustness, target, source.columns)
        say(f"wrote {target}")


def _check_outputs(path: Path, outputs: Sequence[Path]) -> None:
    for target in outputs:
        refuse_overwriting(path, target, "the results file")
        if target.suffix.lower() == _RESULTS_ENDING:
            check_new_file(target)
            continue
        check_output(target, (_RESULTS_ENDING, *FIGURE_ENDINGS, *ENDINGS))
        if target.suffix.lower() in ENDINGS:
            check_table(target)


def _parse(texts: Sequence[str]) -> dict[str, object]:
    """Tolerances from NAME=VALUE or NAME=VALUE:DISTRIBUTION."""
    entries: dict[str, object] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise RequestError(f"--tolerance {text}: write NAME=VALUE, such as crank=0.1")
        width, colon, distribution = value.partition(":")
        entry: dict[str, object] = {"plus_minus": number_or_text(width)}
        entries[name] = entry | ({"distribution": distribution} if colon else {})
    return entries


def _print_design(robustness: Robustness) -> None:
    """Print the yield of one design, its metrics and what their spread comes from."""
    design = int(robustness.designs.index[0])
    for line in _yield_lines(design, {str(name): value for name, value in robustness.failures.iloc[0].items()}):
        say(line, data=True)
    metrics = robustness.metrics_of(design)
    columns = [("metric", ""), ("unit", ""), *((name, "") for name in ("nominal", "mean", "std", "lowest", "highest"))]
    rows = [
        [
            name, shown_unit(row["unit"]), number(row["nominal"], 7), number(row["mean"], 7), number(row["std"], 3),
            _extreme(row, "low"), _extreme(row, "high"),
        ]
        for name, row in metrics.items()
    ]  # fmt: skip
    caption = "lowest and highest over the box of the tolerances; * found by a search, not at a corner"
    print_table("metrics of parts", columns, rows, caption, droppable=["unit"], hint="--json prints all")
    for column, title, scale, digits in (
        ("share", "share of the variance to first order, %", 100.0, 3),
        ("derivative", "first derivatives", 1.0, 6),
    ):
        table = robustness.by_dimension(design, column)
        rows = [[name, *(number(scale * value, digits) for value in table[name].values())] for name in metrics]
        headings = [("metric", ""), *((f"{t.parameter}", f"± {t.plus_minus:g}") for t in robustness.tolerances)]
        print_table(title, headings, rows, hint="--json prints all")


def _yield_lines(design: int, row: Mapping[str, Any]) -> list[str]:
    """The yield, how the failures were counted, and what the box of the tolerances holds."""
    parts, probability, low, high = row["parts"], row["probability"], row["low"], row["high"]
    interval = f"{100 * (1 - high):.8g} to {100 * (1 - low):.8g} %"
    lines = [f"design {design}: yield {100 * (1 - probability):.8g} %, with 95 % confidence {interval}"]
    counts = {name.removeprefix("missed_"): n for name, n in row.items() if name.startswith("missed_")}
    reasons = [f"{count:,} miss {name}" for name, count in counts.items() if count]
    reasons += [f"{row['not_assembled']:,} do not move"] if row["not_assembled"] else []
    lines.append(f"of {parts:,} parts drawn {', '.join(reasons) or 'none fails'}")
    if row["method"] == "weighted":
        lines.append(
            f"a part fails with probability {probability:.3g} ({low:.3g} to {high:.3g}), by importance sampling"
        )
    if not row["box_assembled"]:
        return [*lines, "some parts within the tolerances do not move"]
    if not row["box_feasible"]:
        return [*lines, "some parts within the tolerances miss a constraint"]
    return [*lines, "no part within the tolerances was found that fails"]


def _extreme(row: Mapping[str, Any], side: str) -> str:
    is_found = not (row[f"{side}_is_corner"] or math.isnan(row[side]))
    return number(row[side], 7) + " *" * is_found


def _print_front(robustness: Robustness) -> None:
    """Print the yield front, or all designs where none is feasible."""
    import explore

    frame = robustness.designs
    units = frame.attrs["units"]
    best = explore.rank(frame)
    objectives = [text.partition(":")[0] for text in frame.attrs["objectives"]]
    shown = (best if len(best) else frame).head(_N_LINES)
    names = [*objectives[:1], "failure_probability", *objectives[1:]]
    rows = [[str(index), *(number(float(row[name])) for name in names)] for index, row in shown.iterrows()]
    title = f"{len(best):,} of {count_of(len(frame), 'design')} that nothing beats in {', '.join(objectives)}"
    if not len(best):
        title = f"{count_of(len(frame), 'design')}, none of them feasible"
    n_rows = len(best) or len(frame)
    caption = f"the first {_N_LINES} of {n_rows:,}; -o FILE.h5 writes all" if n_rows > _N_LINES else ""
    headings = [("design", ""), *((name, units[name]) for name in names)]
    print_table(title, headings, rows, caption)


def _as_json(robustness: Robustness) -> dict[str, Any]:
    return {
        "tolerances": {
            t.parameter: {"plus_minus": t.plus_minus, "distribution": t.distribution} for t in robustness.tolerances
        },
        "draws": robustness.draws,
        "seed": robustness.seed,
        **{
            name: getattr(robustness, name).reset_index().to_dict(orient="records")
            for name in ("designs", "failures", "metrics", "derivatives")
        },
    }


def _write(robustness: Robustness, path: Path, columns: Sequence[Any]) -> None:
    """Write a table of the designs, or the figure of the first one."""
    if path.suffix.lower() in ENDINGS:
        write_table(with_labels(robustness.designs, columns), path, robustness.designs.attrs["units"])
        return
    from explore.charts.style import save_figure
    from explore.charts.tolerances import tolerance_chart

    save_figure(tolerance_chart(robustness), path)
