"""`explore stability`: map how near to the change point each method stays accurate."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from explore.cli.options import JsonOption
from explore.cli.output import announce_compiling, print_json, say, say_missing_peers
from explore.cli.paths import atomic_files
from explore.cli.progress import progress_bar
from explore.cli.tables import print_table


def stability(
    output: Annotated[Path, typer.Option("-o", "--output", help="The folder for tables and charts.")] = Path(
        "results/stability"
    ),
    accuracy: Annotated[
        float, typer.Option(min=1e-14, max=0.1, help="Largest error that still counts as accurate.")
    ] = 1e-6,
    as_json: JsonOption = False,
) -> None:
    """Map how near to the change point each method of solving the motion stays accurate."""
    from explore.comparison.convergence import measure_orders
    from explore.comparison.stability import map_stability, safe_margins, stability_runs
    from explore.methods.registry import METHODS

    announce_compiling()
    say_missing_peers(METHODS)
    with atomic_files(output) as place:
        with progress_bar("judging methods", len(stability_runs())) as step:
            rows = map_stability(accuracy, step)
            orders = measure_orders()
        safe = safe_margins(rows)
        _write(place, rows, safe, orders, accuracy)
    if as_json:
        print_json({"map": rows, "safe": safe, "orders": orders})
    else:
        _print_safe(safe, accuracy)
        _print_orders(orders)
    say(f"tables and charts are in {output}: map.csv, safe.csv, orders.csv, map.png, map.svg")


def _write(
    folder: Path, rows: list[dict[str, Any]], safe: list[dict[str, Any]], orders: list[dict[str, Any]], accuracy: float
) -> None:
    import pandas as pd

    from explore.charts.stability import stability_chart
    from explore.charts.style import save_figure

    for name, table in (("map", rows), ("safe", safe), ("orders", orders)):
        pd.DataFrame(table).to_csv(folder / f"{name}.csv", index=False)
    figure = stability_chart(pd.DataFrame(rows), accuracy)
    for kind in ("png", "svg"):
        save_figure(figure, folder / f"map.{kind}")


def _print_safe(safe: list[dict[str, Any]], accuracy: float) -> None:
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
    title = f"Smallest Grashof margin, over the longest link, down to which errors are at most {accuracy:g}"
    print_table(title, columns, lines)


def _margin(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.0e}"


def _print_orders(orders: list[dict[str, Any]]) -> None:
    lines = [
        [row["method"], row["steps"], str(row["theory"]), f"{row['measured']:.2f}", f"{row['deviation']:.2f}"]
        for row in orders
    ]
    columns = [("method", ""), ("steps", ""), ("order", "theory"), ("measured", ""), ("standard error", "")]
    print_table("Order of convergence", columns, lines)
