"""`explore precision`: measure, write table and charts, say who is fastest."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from explore.cli.bars import counted
from explore.cli.output import compiled_kernels, print_json, print_table, say, say_left_out, whole_files
from explore.errors import RequestError

if TYPE_CHECKING:
    import pandas as pd

    from explore.comparison.scenes import Scene
    from explore.comparison.summaries import Standing

Rows = list[dict[str, Any]]
#: Charts of all scenes together.
_CHARTS = ("overview", "averages")


def compare_precision(names: Sequence[str], folder: Path, *, as_json: bool) -> None:
    """Compare methods and rules of averaging on scenes."""
    with compiled_kernels():
        from explore.comparison.averages import RULES
        from explore.comparison.averaging import compare_rules
        from explore.comparison.levels import level_costs
        from explore.comparison.precision import compare_methods
        from explore.comparison.timing import machine
        from explore.methods.registry import METHODS
    scenes = _scenes(names)
    tables: dict[str, Rows] = {"motions": [], "averages": [], "levels": []}
    say_left_out(METHODS)
    each = sum(map(len, METHODS.values())) + sum(map(len, RULES.values()))
    with whole_files(folder) as place:
        with counted("comparing", len(scenes) * each) as step:
            for scene in scenes:
                tables["motions"] += compare_methods(scene, step)
                tables["averages"] += compare_rules(scene, step)
                tables["levels"].append(level_costs(scene))
        _write(place, scenes, tables, machine())
    if as_json:
        print_json({"machine": machine(), **tables})
    else:
        _print_standings(scenes, tables["motions"])
        _print_fastest(scenes, tables["motions"])
        _print_levels(tables["levels"])
    say(f"wrote motions.csv, averages.csv, levels.csv, overview.png and a chart for each scene to {folder}")


def _scenes(names: Sequence[str]) -> list[Scene]:
    """The scenes named, bundled ones by name and others by path; all bundled ones unless named."""
    from explore.comparison.scenes import bundled_scenes, load_scene
    from explore.suggest import suggestion

    bundled = bundled_scenes()
    found = []
    for name in dict.fromkeys(names or bundled):
        if name in bundled:
            found.append(load_scene(bundled[name]))
        elif name.endswith(".toml"):
            found.append(load_scene(Path(name)))
        else:
            raise RequestError(
                f"unknown scene {name!r}; {suggestion(name, bundled)}; a scene of your own is a .toml file"
            )
    # Rows and charts go by the name of the scene.
    taken = Counter([*_CHARTS, *(scene.name for scene in found)])
    twice = next((name for name, times in taken.items() if times > 1), None)
    if twice:
        raise RequestError(f"two charts would be named {twice!r}; give the scene's file another name")
    return found


def _write(folder: Path, scenes: Sequence[Scene], tables: dict[str, Rows], machine: dict[str, str]) -> None:
    import pandas as pd

    from explore.charts.averages import averages_chart
    from explore.charts.precision import overview_chart, scene_chart
    from explore.charts.style import save

    frames = {name: pd.DataFrame(rows) for name, rows in tables.items()}
    for name, frame in frames.items():
        for key, value in machine.items():
            frame[key] = value
        frame.to_csv(folder / f"{name}.csv", index=False)
    motions, averages = frames["motions"], frames["averages"]
    titles = {scene.name: scene.title for scene in scenes}
    charts = {scene.name: scene_chart(_of(motions, scene), f"{scene.title}: {scene.question}") for scene in scenes}
    charts["overview"] = overview_chart(motions, titles)
    if len(averages):
        charts["averages"] = averages_chart(averages, titles)
    for name, figure in charts.items():
        for kind in ("png", "svg"):
            save(figure, folder / f"{name}.{kind}")


def _of(rows: pd.DataFrame, scene: Scene) -> pd.DataFrame:
    return rows[rows["scene"] == scene.name].dropna(axis="columns", how="all")


def _print_standings(scenes: Sequence[Scene], motions: Rows) -> None:
    from explore.comparison.summaries import standing

    lines = []
    for scene in scenes:
        rows = [row for row in motions if row["scene"] == scene.name]
        own = standing(rows)
        found = (
            [_time(own.seconds), f"{own.error:.0e}" if own.error else "0", _ahead(own)]
            if own
            else ["–", "–", "there is no motion"]
        )
        wrong = sum(row["silently_wrong"] > 0 for row in rows)
        lines.append([scene.name, *found, f"{wrong} of {len(rows)}"])
    columns = [("scene", ""), ("time", "per turn"), ("error", ""), ("the next as right takes", "times as long"),
               ("silently wrong", "settings of all methods")]  # fmt: skip
    print_table("The closed form on each scene", columns, lines)


def _ahead(own: Standing) -> str:
    if own.rivals:
        return f"less: {', '.join(own.rivals)}"
    return "nobody is as right" if own.ahead == math.inf else f"×{own.ahead:.3g}"


def _print_fastest(scenes: Sequence[Scene], motions: Rows) -> None:
    from explore.comparison.summaries import GOALS, fastest, standing

    lines = []
    for scene in scenes:
        rows = [row for row in motions if row["scene"] == scene.name]
        if standing(rows) is None:
            continue
        first = scene.name
        for cells, goals in groupby(GOALS, lambda goal: _best(fastest(rows, goal))):  # noqa: B023  # used at once
            same = [f"{goal:.0e}" for goal in goals]
            lines.append([first, " to ".join(dict.fromkeys((same[0], same[-1]))), *cells])
            first = ""
    columns = [("scene", ""), ("accuracy", ""), ("fastest", ""), ("time", "per turn"), ("next", "times as long")]
    print_table("Who is fastest at an accuracy of the velocities (angles where no more is asked)", columns, lines)


def _best(rows: Rows) -> tuple[str, str, str]:
    """The fastest, its time, and the next."""
    if not rows:
        return "nobody", "–", "–"
    first = rows[0]
    if len(rows) == 1:
        return first["method"], _time(first["cpu_seconds"]), "–"
    return first["method"], _time(first["cpu_seconds"]), _next(rows[1], rows[1]["cpu_seconds"] / first["cpu_seconds"])


def _next(row: dict[str, Any], ratio: float) -> str:
    return f"{row['method']} ×{ratio:.3g}" if ratio < 999.5 else f"{row['method']} ×{round(ratio, -2):.0f}"


def _print_levels(levels: Rows) -> None:
    names = ("geometry", "positions", "velocities", "accelerations")
    lines = [
        [row["scene"], row["needs"], *(_time(row[name]) for name in names), f"×{row['spared']:.3g}"] for row in levels
    ]
    columns = [("scene", ""), ("needs", ""), *((name, "per design") for name in names), ("all of it", "would cost")]
    print_table("What each level of the model costs, by the closed form", columns, lines)


def _time(seconds: float) -> str:
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("µs", 1e6)):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"
