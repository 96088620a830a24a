"""`explore synthesize`: find linkages for a task, simulate each, and write them as results."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.cli.options import JsonOption, output_option
from explore.cli.output import announce_compiling, count_of, number, print_json, say
from explore.cli.paths import check_new_file, check_results_file, refuse_overwriting
from explore.cli.progress import block_bar
from explore.cli.table_files import with_labels, with_units
from explore.cli.tables import print_table
from explore.cli.termination import terminable
from explore.cli.units import open_shown

if TYPE_CHECKING:
    import pandas as pd

    from explore.results.store.results import Results
    from explore.synthesis.candidates import Candidates
    from explore.synthesis.tasks.task_files import TaskFile

#: Number of lines of the table of candidates.
_N_LINES = 10
#: Status of a design that misses a constraint.
_SCREENED = "screened"


def synthesize(
    task: Annotated[Path, typer.Argument(metavar="TASK", help="A task file; `explore init --task` writes one.")],
    output: Annotated[Path | None, output_option(help="Results file; by default results/TASK.h5.")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Check the task and say what would be searched.")] = False,
    restart: Annotated[bool, typer.Option("--restart", help="Move an existing results file aside.")] = False,
    as_json: JsonOption = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="Print errors only.")] = False,
) -> None:
    """Find linkages for a task, and write them as results that all other commands read."""
    from explore.synthesis.tasks.task_files import load_task

    loaded = load_task(task)
    path = output or Path("results") / f"{task.stem}.h5"
    refuse_overwriting(task, output, "the task")
    check_results_file(path)
    if dry_run:
        _print_plan(task, path, loaded, as_json=as_json)
        return
    if output is None:
        path.parent.mkdir(exist_ok=True)
    check_new_file(path)
    if not quiet:
        announce_compiling()
    try:
        with terminable(), block_bar("searching") as progress:
            candidates, results = _run(loaded, path, progress, restart=restart)
    except KeyboardInterrupt:
        say("interrupted; nothing was written")
        raise typer.Exit(130) from None
    if as_json:
        table = with_units(with_labels(_best_first(results), results.columns), results.scales)
        print_json({"tried": candidates.tried, "candidates": table.reset_index().to_dict(orient="records")})
    elif not quiet:
        _print_candidates(results, candidates)
    if not quiet:
        say(f"wrote {path}; now run: {shlex.join(['explore', 'rank', str(path)])}")
    if candidates.is_interrupted:
        say("interrupted: these were found so far; --restart searches anew", "yellow")
        raise typer.Exit(130)


def _run(loaded: TaskFile, path: Path, progress: Any, *, restart: bool) -> tuple[Candidates, Results]:
    """Find the candidates and write them."""
    from explore.synthesis.public import refuse_other_task, rows_of

    refuse_other_task(loaded, path, restart=restart)
    candidates = loaded.find(progress)
    rows_of(loaded, candidates).write(path, restart=restart)
    return candidates, open_shown(path, None)


def _print_plan(task: Path, path: Path, loaded: TaskFile, *, as_json: bool) -> None:
    """Print what would be searched and computed."""
    from explore.synthesis.tasks.placed_four_bars import PASSAGE

    objectives = loaded.asked.sections["rank"]["metrics"]
    constraints = {
        each.metric.name: {k: bound for k, bound in (("min", each.minimum), ("max", each.maximum)) if bound is not None}
        for each in loaded.asked.question.request.constraints
    }
    if as_json:
        print_json({
            "task": loaded.kind, "mechanism": loaded.task.mechanism, "results": str(path), "constraints": constraints,
            "objectives": objectives,
        })  # fmt: skip
        return
    say(f"{task}: {loaded.kind}, candidates of a {loaded.task.mechanism} -> {path}", data=True)
    if constraints.get(PASSAGE.name) == {"max": 0.0}:
        del constraints[PASSAGE.name]
        say("  every place passed in one motion and in order", data=True)
    for name, bounds in constraints.items():
        words = {"min": "at least", "max": "at most"}
        say(f"  {name} {' and '.join(f'{words[side]} {number(bound)}' for side, bound in bounds.items())}", data=True)
    say(f"ranked by {', '.join(objectives)}; nothing was searched or written", data=True)


def _best_first(results: Results) -> pd.DataFrame:
    """All candidates: feasible ones first, then those that pass all places, whose codes are from the best on, and by
    the first objective.
    """
    from explore.synthesis.tasks.placed_four_bars import PASSAGE

    frame = results.to_pandas()
    name, _, sense = results.objectives[0].partition(":")
    keys = {
        "rejected": ~frame["feasible"],
        "passing": frame.get(PASSAGE.name, 0),
        "objective": -frame[name] if sense == "max" else frame[name],
    }
    return frame.loc[frame.assign(**keys).sort_values(list(keys), kind="stable").index]


def _order(shown: pd.DataFrame, objective: str) -> str:
    """The order of candidates in words."""
    from explore.synthesis.tasks.placed_four_bars import PASSAGE

    if PASSAGE.name in shown and len(set(shown[PASSAGE.name])) > 1:
        return f"those that pass first, then by {objective}"
    return f"best {objective} first"


def _print_candidates(results: Results, candidates: Candidates) -> None:
    """Print what was tried, and the best candidates."""
    frame = _best_first(results)
    for column in results.columns:
        if column.labels and column.name != "feasible":
            frame[column.name] = frame[column.name].map(column.labels)
    for sentence in candidates.tried:
        say(sentence)
    n_feasible = int(frame["feasible"].sum())
    if not n_feasible:
        say("none of the candidates is within the bounds; these come nearest", "yellow")
    objectives = [text.partition(":")[0] for text in results.objectives]
    added = [column.name for column in candidates.added]
    parameters = [column.name for column in results.columns if column.role == "parameter"]
    shown = frame.head(_N_LINES)
    remarks = ["misses"] if not shown["feasible"].all() else []
    names = list(dict.fromkeys([*objectives, *added, *remarks, *parameters]))
    rows = [
        [str(index), *(_misses(results, row) if name == "misses" else _cell(row[name]) for name in names)]
        for index, row in shown.iterrows()
    ]
    hidden = len(frame) - len(shown)
    print_table(
        f"{count_of(len(frame), 'candidate')}, {n_feasible:,} within the bounds, {_order(shown, objectives[0])}",
        [("design", ""), *((name, results.units.get(name, "")) for name in names)],
        rows,
        f"{hidden:,} more: explore rank {results.path} --top 0 lists the best of them" if hidden > 0 else "",
        # what a linkage is built from stays longest
        droppable=[
            added[0],
            *(name for name in parameters if name == results.speed),
            *reversed(objectives[2:]),
            *(name for name in added[1:] if name not in objectives),
            *objectives[1:2],
            *(name for name in reversed(parameters) if name != results.speed),
        ],
        hint="--json prints all",
    )
    sentences = candidates.sentences | {word: text for word, text in results.status_sentences.items() if word != "ok"}
    occurring = {value for name in ("status", *added) for value in shown[name]} - {_SCREENED}
    for word in (word for word in sentences if word in occurring):
        say(f"{word}: {sentences[word]}", "dim", data=True)


def _misses(results: Results, row: pd.Series[Any]) -> str:
    """The status of a design that cannot be computed, or the constraints that it misses."""
    if row["status"] not in ("ok", _SCREENED):
        return str(row["status"])
    return ", ".join(name for name in results.constraints if not row[f"{name}_margin"] >= 0.0)


def _cell(value: Any) -> str:
    return number(value.item() if hasattr(value, "item") else value)
