"""`explore precision`: compare the cost and the accuracy of the methods."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.base.errors import RequestError
from explore.cli.options import JsonOption, output_option
from explore.cli.output import announce_compiling, print_json, say, say_missing_peers
from explore.cli.paths import atomic_files
from explore.cli.progress import progress_bar
from explore.cli.table_files import write_all
from explore.cli.tables import print_table

if TYPE_CHECKING:
    from explore.comparison.method_precision import Standing
    from explore.comparison.scenes import Scene

Rows = list[dict[str, Any]]
#: Charts of all scenes together.
_CHARTS = ("overview", "averages")


def precision(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(metavar="SCENE", help="Names of bundled scenes, or .toml files; by default all bundled ones."),
    ] = None,
    output: Annotated[Path, output_option(help="The folder for tables and charts.")] = Path("results/precision"),
    as_json: JsonOption = False,
) -> None:
    """Chart the cost of each method of solving the motion against its error."""
    _compare_precision(scenes or [], output, as_json=as_json)


def _compare_precision(names: Sequence[str], folder: Path, *, as_json: bool) -> None:
    """Compare methods and averaging rules on scenes, write tables and charts, and print a summary."""
    from explore.comparison.averaging_rules import AVERAGING_RULES
    from explore.comparison.method_precision import compare_methods, measure_level_costs
    from explore.comparison.methods.registry import methods_for
    from explore.comparison.rule_precision import compare_rules
    from explore.comparison.timing import describe_machine

    announce_compiling()
    scenes = _load_scenes(names)
    tables: dict[str, Rows] = {"motions": [], "averages": [], "levels": []}
    methods = [methods_for(scene.designs.loop) for scene in scenes]
    say_missing_peers({name: settings for each in methods for name, settings in each.items()})
    n_rules = sum(map(len, AVERAGING_RULES.values()))
    n_steps = [sum(map(len, each.values())) + n_rules for each in methods]
    with atomic_files(folder) as place:
        with progress_bar("comparing", sum(n_steps)) as step:
            for scene in scenes:
                tables["motions"] += compare_methods(scene, step)
                tables["averages"] += compare_rules(scene, step)
                tables["levels"].append(measure_level_costs(scene))
        _write(place, scenes, tables, describe_machine())
    if as_json:
        print_json({"machine": describe_machine(), **tables})
    else:
        _print_standings(scenes, tables["motions"])
        _print_fastest(scenes, tables["motions"])
        _print_levels(tables["levels"])
    averaged = {row["scene"] for row in tables["averages"]}
    if others := [scene.name for scene in scenes if scene.name not in averaged]:
        reason = "no strokes of an output that is unknown in its loops"
        say(f"left out: averages of {', '.join(others)}: {reason}", "yellow")
    say(f"wrote motions.csv, averages.csv, levels.csv, overview.png and a chart for each scene to {folder}")


def _load_scenes(names: Sequence[str]) -> list[Scene]:
    """Load scenes, bundled ones by name and others by path; all bundled ones by default."""
    from explore.base.suggest import suggestion
    from explore.comparison.scenes import bundled_scenes, load_scene

    bundled = bundled_scenes()
    scenes = []
    for name in dict.fromkeys(names or bundled):
        if name in bundled:
            scenes.append(load_scene(bundled[name]))
        elif name.endswith(".toml"):
            scenes.append(load_scene(Path(name)))
        else:
            raise RequestError(
                f"unknown scene {name!r}; {suggestion(name, bundled)}; a scene of your own is a .toml file"
            )
    # Rows and charts are named after the scene.
    name_counts = Counter([*_CHARTS, *(scene.name for scene in scenes)])
    duplicate = next((name for name, count in name_counts.items() if count > 1), None)
    if duplicate:
        raise RequestError(f"two charts would be named {duplicate!r}; give the scene's file another name")
    return scenes


def _write(folder: Path, scenes: Sequence[Scene], tables: dict[str, Rows], machine: dict[str, str]) -> None:
    import pandas as pd

    from explore.figures.charts.averages import averages_chart
    from explore.figures.charts.precision import overview_chart, scene_chart

    frames = {name: pd.DataFrame(rows).assign(**machine) for name, rows in tables.items()}
    motions, averages = frames["motions"], frames["averages"]
    titles = {scene.name: _without_formulas(scene.title) for scene in scenes}
    charts = {}
    for scene in scenes:
        rows = motions[motions["scene"] == scene.name].dropna(axis="columns", how="all")
        charts[scene.name] = scene_chart(rows, f"{titles[scene.name]}: {_without_formulas(scene.question)}")
    charts["overview"] = overview_chart(motions, titles)
    if len(averages):
        charts["averages"] = averages_chart(averages, titles)
    write_all(folder, frames, charts)


def _without_formulas(text: str) -> str:
    """The text with its dollar signs escaped."""
    return text.replace("$", r"\$")


def _print_standings(scenes: Sequence[Scene], motions: Rows) -> None:
    from explore.comparison.method_precision import closed_form_standing

    lines = []
    for scene in scenes:
        rows = [row for row in motions if row["scene"] == scene.name]
        own = closed_form_standing(rows)
        cells = (
            [_time(own.seconds), f"{own.error:.0e}" if own.error else "0", _lead(own)]
            if own
            else ["–", "–", "no motion exists"]
        )
        silently_wrong = sum(row["silently_wrong"] > 0 for row in rows)
        lines.append([scene.name, *cells, f"{silently_wrong} of {len(rows)}"])
    columns = [("scene", ""), ("time", "per turn"), ("error", ""), ("next as accurate", "times as long"),
               ("silently wrong", "settings of all methods")]  # fmt: skip
    print_table("The closed form on each scene", columns, lines)


def _lead(own: Standing) -> str:
    """The time of the fastest other setting that is as accurate, over that of the closed form."""
    if own.cheaper_settings:
        return f"faster: {', '.join(own.cheaper_settings)}"
    return "none" if own.next_cost_ratio == math.inf else f"×{own.next_cost_ratio:.3g}"


def _print_fastest(scenes: Sequence[Scene], motions: Rows) -> None:
    from explore.comparison.method_precision import ACCURACIES, closed_form_standing, fastest_settings

    lines = []
    for scene in scenes:
        rows = [row for row in motions if row["scene"] == scene.name]
        if closed_form_standing(rows) is None:
            continue
        heading = scene.name
        fastest = [(_fastest_cells(fastest_settings(rows, goal)), f"{goal:.0e}") for goal in ACCURACIES]
        for cells, goals in groupby(fastest, itemgetter(0)):
            accuracies = [goal for _, goal in goals]
            lines.append([heading, " to ".join(dict.fromkeys((accuracies[0], accuracies[-1]))), *cells])
            heading = ""
    columns = [("scene", ""), ("accuracy", ""), ("fastest", ""), ("time", "per turn"), ("next", "times as long")]
    print_table("The fastest method at each accuracy of the velocities (angles in scenes of positions)", columns, lines)


def _fastest_cells(rows: Rows) -> tuple[str, str, str]:
    """The fastest method, its time, and the next with its time over that of the fastest."""
    if not rows:
        return "none", "–", "–"
    first = rows[0]
    if len(rows) == 1:
        return first["method"], _time(first["cpu_seconds"]), "–"
    ratio = rows[1]["cpu_seconds"] / first["cpu_seconds"]
    shown_ratio = f"{ratio:.3g}" if ratio < 999.5 else f"{round(ratio, -2):.0f}"
    return first["method"], _time(first["cpu_seconds"]), f"{rows[1]['method']} ×{shown_ratio}"


def _print_levels(levels: Rows) -> None:
    names = ("geometry", "positions", "velocities", "accelerations")
    lines = [
        [row["scene"], row["needs"], *(_time(row[name]) for name in names), f"×{row['full_cost_ratio']:.3g}"]
        for row in levels
    ]
    columns = [
        ("scene", ""),
        ("needs", ""),
        *((name, "per design") for name in names),
        ("full motion", "relative cost"),
    ]
    print_table("What each level of the model costs, by the closed form", columns, lines)


def _time(seconds: float) -> str:
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("µs", 1e6)):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"
