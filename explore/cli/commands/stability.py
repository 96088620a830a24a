"""`explore stability`: map how near to a singular position each method stays accurate."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.cli.completion import complete_mechanisms
from explore.cli.options import JsonOption, output_option
from explore.cli.output import announce_compiling, print_json, say, say_missing_peers
from explore.cli.paths import atomic_files
from explore.cli.progress import progress_bar
from explore.cli.table_files import write_all
from explore.cli.tables import print_table
from explore.mechanisms.entry_points import DEFAULT_MECHANISM

if TYPE_CHECKING:
    from explore.comparison.stability import StabilityCase

Rows = list[dict[str, Any]]


def stability(
    mechanism: Annotated[
        str,
        typer.Argument(
            metavar="MECHANISM|FILE",
            autocompletion=complete_mechanisms,
            help="A mechanism, or a study of one or of a linkage, a .toml file.",
        ),
    ] = DEFAULT_MECHANISM,
    output: Annotated[
        Path | None, output_option(help="The folder for tables and charts; by default results/stability-NAME.")
    ] = None,
    accuracy: Annotated[
        float, typer.Option(min=1e-14, max=0.1, help="Largest error that still counts as accurate.")
    ] = 1e-6,
    as_json: JsonOption = False,
) -> None:
    """Map how near to a singular position each method of solving the motion stays accurate."""
    from explore.comparison import random_starts
    from explore.comparison.convergence import measure_orders
    from explore.comparison.methods.registry import methods_for
    from explore.comparison.stability import (
        declared_case,
        map_stability,
        safe_margins,
        stability_runs,
        study_case,
        trace_turn,
    )

    folder = output or Path(f"results/stability-{Path(mechanism).stem}")
    if mechanism == random_starts.MECHANISM:
        _solve_from_starts(folder, accuracy, as_json=as_json)
        return
    case = study_case(Path(mechanism)) if mechanism.endswith(".toml") else declared_case(mechanism)
    announce_compiling()
    say_missing_peers(methods_for(case.loop))
    with atomic_files(folder) as place:
        with progress_bar("judging methods", len(stability_runs(case))) as step:
            rows = map_stability(case, accuracy, step)
        tables = {"map": rows, "safe": safe_margins(rows), "turn": trace_turn(case)}
        if case.smooth is not None:
            tables["orders"] = measure_orders(case.loop, case.smooth)
        _write(place, Path(mechanism).stem, case, tables, accuracy)
    if as_json:
        print_json(tables)
    else:
        _print_safe(tables["safe"], case.distance, accuracy)
        if case.smooth is not None:
            _print_orders(tables["orders"])
    names = ", ".join(f"{name}.csv" for name in tables)
    say(f"tables and charts are in {folder}: {names}, and map and turn as png, svg")


def _solve_from_starts(folder: Path, accuracy: float, *, as_json: bool) -> None:
    """Solve a law from random starts, write tables and a chart, and print the outcomes."""
    import pandas as pd

    from explore.comparison.random_starts import START_COUNT, TITLE, count_outcomes, solve_from_starts
    from explore.figures.charts.stability import starts_chart

    announce_compiling()
    with atomic_files(folder) as place:
        with progress_bar("solving", START_COUNT) as step:
            starts = solve_from_starts(accuracy, START_COUNT, progress=step)
        tables = {"starts": starts, "counts": count_outcomes(starts)}
        frames = {name: pd.DataFrame(rows) for name, rows in tables.items()}
        write_all(place, frames, {"starts": starts_chart(frames["starts"], frames["counts"])})
    if as_json:
        print_json(tables)
    else:
        lines = [[row["outcome"], f"{row['starts']:,}", f"{row['share']:.1%}"] for row in tables["counts"]]
        columns = [("outcome", ""), ("starts", ""), ("share", "")]
        print_table(TITLE, columns, lines)
    say(f"tables and charts are in {folder}: starts.csv, counts.csv, starts.png, starts.svg")


def _write(folder: Path, name: str, case: StabilityCase, tables: dict[str, Rows], accuracy: float) -> None:
    import pandas as pd

    from explore.comparison.stability import TRACED_DESIGN
    from explore.figures.charts.stability import stability_chart, turn_chart

    frames = {table: pd.DataFrame(rows) for table, rows in tables.items()}
    title = f"{name}, methods at their finest setting; {case.distance}: {case.margin[TRACED_DESIGN]:.1g}"
    charts = {
        "map": stability_chart(frames["map"], accuracy, case.distance, case.beyond),
        "turn": turn_chart(frames["turn"], [math.degrees(angle) for angle in case.singular_angles], title),
    }
    write_all(folder, frames, charts)


def _print_safe(safe: Rows, distance: str, accuracy: float) -> None:
    """Print a line per setting: its smallest accurate margins, and its verdicts at the default number of angles."""
    from explore.comparison.stability import DEFAULT_STEP_COUNT, STEP_COUNTS

    settings: dict[str, dict[int, dict[str, Any]]] = {}
    for row in safe:
        settings.setdefault(row["setting"], {})[row["angles"]] = row
    lines = []
    for setting, by_angles in settings.items():
        margins = [
            _margin(by_angles[steps]["smallest_accurate_margin"]) if steps in by_angles else "" for steps in STEP_COUNTS
        ]
        usual = by_angles[DEFAULT_STEP_COUNT]
        lines.append([setting, *margins, usual["verdict_below"], usual["worst_verdict"]])
    columns = [("method", ""), *((f"{steps}", "angles") for steps in STEP_COUNTS)]
    columns += [(heading, f"at {DEFAULT_STEP_COUNT} angles") for heading in ("verdict below", "worst verdict")]
    title = f"Smallest {distance}, down to which errors are at most {accuracy:g}"
    print_table(title, columns, lines)


def _margin(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.0e}"


def _print_orders(orders: Rows) -> None:
    lines = [
        [row["method"], row["steps"], str(row["theory"]), f"{row['measured']:.2f}", f"{row['deviation']:.2f}"]
        for row in orders
    ]
    columns = [("method", ""), ("steps", ""), ("order", "theory"), ("measured", ""), ("standard error", "")]
    print_table("Order of convergence", columns, lines)
