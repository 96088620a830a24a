"""`explore tolerance`: what tolerances of the dimensions do to chosen designs, and how many parts are good."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.base.errors import RequestError
from explore.cli.options import JsonOption, ResultsArgument, output_option
from explore.cli.output import count_of, number, print_json, say, shown_unit
from explore.cli.paths import newest_results, refuse_overwriting
from explore.cli.progress import block_bar
from explore.cli.settings import number_or_text
from explore.cli.table_files import check_outputs, with_labels, with_units, write_output
from explore.cli.tables import print_table
from explore.cli.termination import terminable
from explore.cli.units import UnitsOption, units_of
from explore.cli.workers import ProcessesOption, SchedulerOption, WorkerOptions, WorkersOption

if TYPE_CHECKING:
    import pandas as pd

    from explore.analysis.tolerancing.robustness import Robustness, TolerancePlan
    from explore.base.units.shown import Scale, ShownUnits
    from explore.results.store.results import Results

_RESULTS_ENDING = ".h5"
#: Number of lines of the printed yield front.
_N_LINES = 20
#: Spread below which that of a metric is rounding, as a share of the metric.
_NOISE = 1e-9


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
            help="Half the width: crank=0.1, 'coupler=50 um', rocker=0.2:uniform, or 0.1 of all lengths; in place of "
            "the study's. A number without a unit is in the unit of the tables.",
        ),
    ] = None,
    draws: Annotated[
        int | None, typer.Option(min=2, metavar="N", help="Parts to draw of each design; default: 262,144.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the draws.")] = 0,
    output: Annotated[
        list[Path] | None,
        output_option(
            help="Also write the designs: a results file .h5; .csv, .json, .md, .parquet; a figure .png, .svg, .pdf."
        ),
    ] = None,
    units: UnitsOption = None,
    as_json: JsonOption = False,
    restart: Annotated[bool, typer.Option("--restart", help="Move an existing results file aside.")] = False,
    workers: WorkersOption = None,
    processes: ProcessesOption = False,
    scheduler: SchedulerOption = None,
) -> None:
    """Find how far tolerances move the metrics of designs, and how many parts meet the constraints."""
    path = results or newest_results()
    for target in output or []:
        refuse_overwriting(path, target, "the results file")
    check_outputs(output or [], (_RESULTS_ENDING,))
    import explore
    from explore.analysis.tolerancing.public import DRAWS, check_target, plan_tolerances
    from explore.results.store.open_results import open_results

    source = open_results(path)
    shown_units = units_of(source, units)
    entries = _parse(tolerances or [], source, shown_units)
    plan = plan_tolerances(source, entries, design or None, draws=draws or DRAWS, seed=seed)
    for target in output or []:
        if target.suffix.lower() == _RESULTS_ENDING:
            check_target(plan, target, restart=restart)
    robustness = _compute(plan, WorkerOptions(workers, processes, scheduler))
    scales = robustness.scales(shown_units)
    shown = robustness.in_units(scales)
    if as_json:
        print_json(_as_json(shown, scales))
    elif len(shown.designs) == 1:
        _print_design(shown, scales)
    else:
        _print_front(shown, explore.rank(robustness.designs).index, source)
    for target in output or []:
        if target.suffix.lower() == _RESULTS_ENDING:
            is_new = plan.write(robustness, target, restart=restart)
            say(f"wrote {target}" if is_new else f"{target} is complete already: {len(robustness.designs):,} designs")
        else:
            table = with_units(with_labels(shown.designs, source.columns), scales)
            write_output(target, table, shown.designs.attrs["units"], "tolerance", shown)


def _compute(plan: TolerancePlan, work: WorkerOptions) -> Robustness:
    """Draw and analyse the parts, with progress on stderr."""
    workers = work.prepare(plan.run.request.exact.request)
    try:
        with terminable(), block_bar("parts evaluated", lines=True) as progress:
            return plan.robustness(plan.run.compute(workers, progress))
    except KeyboardInterrupt:
        say("interrupted; nothing was written")
        raise typer.Exit(130) from None


def _parse(texts: Sequence[str], source: Results, units: ShownUnits) -> dict[str, object]:
    """Tolerances from NAME=VALUE or NAME=VALUE:DISTRIBUTION; numbers without a unit are in the shown one.

    A VALUE without a name is that of all lengths that no other text names.
    """
    from explore.studies.config.linkage import mechanism_of

    mechanism = mechanism_of(source)
    scales = units.scales({parameter.name: parameter.unit for parameter in mechanism.parameters})
    swept = {column.name for column in source.columns if column.role == "parameter"}
    lengths = [p.name for p in mechanism.parameters if p.unit == "mm" and p.affects in ("motion", "point")]
    entries: dict[str, object] = {}
    named: set[str] = set()
    for text in sorted(texts, key=lambda text: "=" in text):
        if "=" not in text:
            if entries:
                raise RequestError(f"--tolerance {text}: a tolerance of all lengths is given already; give it once")
            if not text.lstrip("+-.")[:1].isdecimal():
                raise RequestError(f"--tolerance {text}: write NAME=VALUE, such as crank=0.1, or 0.1 of all lengths")
            of_all = [f"{name}={text}" for name in lengths if name in swept]
            entries |= _parse(of_all, source, units)
            continue
        name, _, value = text.partition("=")
        if name in named:
            raise RequestError(f"--tolerance {name} is given several times; give it once")
        named.add(name)
        width, colon, distribution = value.partition(":")
        try:
            entry: dict[str, object] = {"plus_minus": number_or_text(width, scales.get(name))}
        except RequestError as error:
            raise RequestError(f"--tolerance {name}: {error}") from None
        entries[name] = entry | ({"distribution": distribution} if colon else {})
    return entries


def _print_design(robustness: Robustness, scales: Mapping[str, Scale]) -> None:
    """Print the yield of one design, its metrics and what their spread comes from."""
    from explore.base.units.shown import headings

    design = int(robustness.designs.index[0])
    for line in _yield_lines(design, {str(name): value for name, value in robustness.failures.iloc[0].items()}):
        say(line, data=True)
    metrics = robustness.metrics_of(design)
    columns = [("metric", ""), *((name, "") for name in ("nominal", "mean", "std", "lowest", "highest"))]
    rows = [
        [
            f"{name} [{unit}]" if (unit := shown_unit(row["unit"])) else name, number(row["nominal"], 7),
            number(row["mean"], 7), number(row["std"], 3), _extreme(row, "low"), _extreme(row, "high"),
        ]
        for name, row in metrics.items()
    ]  # fmt: skip
    caption = "lowest and highest over the box of the tolerances; * found by a search, not at a corner"
    named = headings(scales, metrics)
    print_table("metrics of parts", columns, rows, caption, droppable=["mean"], hint="--json prints all")
    for column, title, scale, digits in (
        ("share", "share of the variance to first order, %", 100.0, 3),
        ("derivative", f"first derivatives, in the unit of the metric per {_unit_of(robustness, scales)}", 1.0, 6),
    ):
        table = robustness.by_dimension(design, column)
        rows = [
            [named.get(name, name), *(number(scale * value, digits) for value in table[name].values())]
            for name in metrics
        ]
        widths = [(t.parameter, _width(t.plus_minus, scales[t.parameter])) for t in robustness.tolerances]
        print_table(title, [("metric", ""), *widths], rows, hint="--json prints all")
    if unexplained := [name for name, row in metrics.items() if _is_unexplained(row)]:
        reason = "because of a fold, bend or jump within the tolerances"
        say(f"derivatives do not tell the std of {', '.join(unexplained)}, {reason}", data=True)
    for name, row in metrics.items():
        if row["undefined"]:
            say(f"{row['undefined']:,} parts that move have no {name}: mean and std are of the others", data=True)


def _is_unexplained(row: Mapping[str, Any]) -> bool:
    """Whether the spread of the parts is quite another one than derivatives tell."""
    std, told = row["std"], row["std_first_order"]
    return bool((std > 2.0 * told or told > 2.0 * std) and max(std, told) > _NOISE * abs(row["nominal"]))


def _unit_of(robustness: Robustness, scales: Mapping[str, Scale]) -> str:
    """The unit that all dimensions with tolerances have."""
    units = {scales[tolerance.parameter].shown for tolerance in robustness.tolerances}
    return units.pop() if len(units) == 1 else "unit of the dimension"


def _width(plus_minus: float, scale: Scale) -> str:
    """A tolerance above its column, with the unit if that is not the declared one."""
    return f"± {plus_minus:g}" if scale.is_declared else f"± {plus_minus:.3g} {scale.shown}"


def _yield_lines(design: int, row: Mapping[str, Any]) -> list[str]:
    """The yield, how the failures were counted, and what the box of the tolerances holds."""
    from explore.model.status import Status

    parts, probability, low, high = row["parts"], row["probability"], row["low"], row["high"]
    interval = f"{100 * (1 - high):.8g} to {100 * (1 - low):.8g} %"
    lines = [f"design {design}: yield {100 * (1 - probability):.8g} %, with 95 % confidence {interval}"]
    counts = {name.removeprefix("missed_"): n for name, n in row.items() if name.startswith("missed_")}
    reasons = [f"{count:,} miss {name}" for name, count in counts.items() if count]
    words = {Status.TOLERANCE_NOT_MET.label: "miss the error bound"}
    reasons += [f"{count:,} {words.get(label, f'have the status {label}')}" for label, count in row["statuses"].items()]
    lines.append(f"of {parts:,} parts drawn {', '.join(reasons) or 'none fails'}")
    if row["method"] == "weighted":
        lines.append(
            f"a part fails with probability {probability:.3g} ({low:.3g} to {high:.3g}), by importance sampling"
        )
    if not row["box_assembled"]:
        return [*lines, "some parts within the tolerances have no values"]
    if not row["box_tolerance_met"]:
        return [*lines, "some parts within the tolerances miss the error bound"]
    if not row["box_feasible"]:
        return [*lines, "some parts within the tolerances miss a constraint"]
    return [*lines, "no part within the tolerances was found that fails"]


def _extreme(row: Mapping[str, Any], side: str) -> str:
    is_found = not (row[f"{side}_is_corner"] or math.isnan(row[side]))
    return number(row[side], 7) + " *" * is_found


def _print_front(robustness: Robustness, front: pd.Index, source: Results) -> None:
    """Print the yield front, or all designs where none is feasible, with what they are built from."""
    frame = robustness.designs
    units = frame.attrs["units"]
    best = frame.loc[front]
    objectives = [text.partition(":")[0] for text in frame.attrs["objectives"]]
    shown = (best if len(best) else frame).head(_N_LINES)
    speed = [name for name in _parameters(source) if name == source.speed]
    built = [name for name in _parameters(source) if name not in speed]
    names = [*objectives[:1], "failure_probability", *objectives[1:], *built, *speed]
    rows = [[str(index), *(number(float(row[name])) for name in names)] for index, row in shown.iterrows()]
    title = f"{len(best):,} of {count_of(len(frame), 'design')} that nothing beats in {', '.join(objectives)}"
    if not len(best):
        title = f"{count_of(len(frame), 'design')}, none of them feasible"
    n_rows = len(best) or len(frame)
    caption = f"the first {_N_LINES} of {n_rows:,}; -o FILE.h5 writes all" if n_rows > _N_LINES else ""
    headings = [("design", ""), *((name, units[name]) for name in names)]
    # what a linkage is built from stays longest
    droppable = [*speed, *reversed(objectives[2:]), "failure_probability", *objectives[1:2], *reversed(built)]
    print_table(title, headings, rows, caption, droppable=droppable, hint="--json prints all")
    undefined = robustness.metrics["undefined"].groupby("metric", sort=False).agg(lambda counts: (counts > 0).sum())
    for name in undefined.index[undefined > 0]:
        count = count_of(int(undefined[name]), "design")
        say(f"{name} is undefined in parts of {count} that move: mean and std are of the others", data=True)


def _parameters(source: Results) -> list[str]:
    """The parameters of the designs that the study gives."""
    return [column.name for column in source.columns if column.role == "parameter"]


def _as_json(robustness: Robustness, scales: Mapping[str, Scale]) -> dict[str, Any]:
    from explore.base.units.shown import headings

    named = headings(scales, scales)
    tables = {
        "designs": with_units(robustness.designs, scales),
        "failures": robustness.failures,
        "metrics": robustness.metrics.rename(index=named, level="metric"),
        "derivatives": robustness.derivatives.rename(index=named, level="metric").rename(
            index=named, level="parameter"
        ),
    }
    return {
        "tolerances": {
            named.get(t.parameter, t.parameter): {"plus_minus": t.plus_minus, "distribution": t.distribution}
            for t in robustness.tolerances
        },
        "draws": robustness.draws,
        "seed": robustness.seed,
        **{name: table.reset_index().to_dict(orient="records") for name, table in tables.items()},
    }
