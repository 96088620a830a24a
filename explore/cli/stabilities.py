"""`explore stability`: map where methods break, write table and chart, say how near each may be trusted."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from explore.cli.bars import counted
from explore.cli.output import compiled_kernels, print_json, print_table, say, say_left_out, whole_files


def map_methods(folder: Path, accuracy: float, *, as_json: bool) -> None:
    """Judge every method at every distance from the change point."""
    with compiled_kernels():
        from explore.comparison.convergence import measure_orders
        from explore.comparison.stability import map_stability, runs, safe_margins
        from explore.methods.registry import METHODS
    say_left_out(METHODS)
    with whole_files(folder) as place:
        with counted("judging methods", len(runs())) as step:
            rows = map_stability(accuracy, step)
            orders = measure_orders()
        safe = safe_margins(rows)
        _write(place, rows, safe, orders, accuracy)
    if as_json:
        print_json({"map": rows, "safe": safe, "orders": orders})
    else:
        _print_safe(safe, accuracy)
        _print_orders(orders)
    say(f"tables and charts are in {folder}: map.csv, safe.csv, orders.csv, map.png, map.svg")


def _write(
    folder: Path, rows: list[dict[str, Any]], safe: list[dict[str, Any]], orders: list[dict[str, Any]], accuracy: float
) -> None:
    import pandas as pd

    from explore.charts.stability import stability_chart
    from explore.charts.style import save

    for name, table in (("map", rows), ("safe", safe), ("orders", orders)):
        pd.DataFrame(table).to_csv(folder / f"{name}.csv", index=False)
    figure = stability_chart(pd.DataFrame(rows), accuracy)
    for kind in ("png", "svg"):
        save(figure, folder / f"map.{kind}")


def _print_safe(safe: list[dict[str, Any]], accuracy: float) -> None:
    """A line for each setting; what follows below the margin is that of the usual number of angles."""
    from explore.comparison.stability import STEPS, USUAL_STEPS

    settings: dict[str, dict[int, dict[str, Any]]] = {}
    for row in safe:
        settings.setdefault(row["setting"], {})[row["angles"]] = row
    lines = []
    for setting, by_angles in settings.items():
        margins = [_margin(by_angles[steps]["safe_down_to"]) if steps in by_angles else "" for steps in STEPS]
        usual = by_angles[USUAL_STEPS]
        lines.append([setting, *margins, usual["then"], usual["worst"]])
    columns = [("method", ""), *((f"{steps}", "angles") for steps in STEPS), ("then", f"at {USUAL_STEPS} angles"),
               ("worst", f"at {USUAL_STEPS} angles")]  # fmt: skip
    print_table(f"Right to {accuracy:g} down to a Grashof margin, over the longest link, of", columns, lines)


def _margin(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.0e}"


def _print_orders(orders: list[dict[str, Any]]) -> None:
    lines = [
        [row["method"], row["steps"], str(row["theory"]), f"{row['measured']:.2f}", f"{row['deviation']:.2f}"]
        for row in orders
    ]
    columns = [("method", ""), ("steps", ""), ("order", "theory"), ("measured", ""), ("standard error", "")]
    print_table("Order of convergence", columns, lines)
