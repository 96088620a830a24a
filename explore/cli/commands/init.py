"""`explore init`: write a study or a task to start from."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from explore.base.errors import RequestError
from explore.cli.completion import complete_linkages, complete_mechanisms, complete_tasks
from explore.cli.output import say
from explore.cli.tables import print_table
from explore.mechanisms.entry_points import DEFAULT_MECHANISM


def init(
    config: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="The file to write; by default study.toml, or task.toml.")
    ] = None,
    mechanism: Annotated[
        str | None,
        typer.Option(autocompletion=complete_mechanisms, help=f"The mechanism; default: {DEFAULT_MECHANISM}."),
    ] = None,
    task: Annotated[
        str | None,
        typer.Option(
            autocompletion=complete_tasks,
            metavar="TYPE",
            help="Write a task instead: path, slider-path, motion (also poses), function, dead-positions (also swing) "
            "or dwell.",
        ),
    ] = None,
    linkage: Annotated[
        str | None,
        typer.Option(
            autocompletion=complete_linkages,
            metavar="NAME",
            help="Write a study of a classic linkage that a table describes, such as watt-2, whitworth or jansen.",
        ),
    ] = None,
    source: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="FILE",
            help="Write a study of a linkage of another program: a file of pylinkage (mechanism_to_json), or an "
            "expression of Pyslvs, M[...], or an address of PMKS+, each in a file or as it is.",
        ),
    ] = None,
    list_linkages: Annotated[bool, typer.Option("--list", help="List the linkages, and write nothing.")] = False,
) -> None:
    """Write a commented study or task that runs, to start from."""
    if list_linkages:
        _print_linkages()
        return
    options = {"mechanism": mechanism, "task": task, "linkage": linkage, "from": source}
    given = [f"--{name}" for name, value in options.items() if value is not None]
    if len(given) > 1:
        raise RequestError(f"{' and '.join(given)} are given; name one of them")
    text, remarks = _starter_text(mechanism, task, linkage, source)
    path = config or Path("study.toml" if task is None else "task.toml")
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise RequestError(f"{path} exists; name another file") from None
    except FileNotFoundError:
        raise RequestError(f"{path}: there is no folder {path.parent}; name another file") from None
    for remark in remarks:
        say(remark)
    command = "sweep" if task is None else "synthesize"
    say(f"wrote {path}; now run: {shlex.join(['explore', command, str(path)])}")


def _starter_text(
    mechanism: str | None, task: str | None, linkage: str | None, source: str | None
) -> tuple[str, list[str]]:
    """The text of the study or task, and remarks on it."""
    from explore.studies.config import study_file

    if source is not None:
        from explore.studies.imports.sources import imported_study

        return imported_study(source)
    if linkage is not None:
        return study_file.linkage_starter(linkage), []
    if task is not None:
        from explore.synthesis.tasks.task_files import task_starter

        return task_starter(task), []
    from explore.studies.request.names import find_mechanism

    return study_file.starter(find_mechanism(mechanism or DEFAULT_MECHANISM)), []


def _print_linkages() -> None:
    from explore.studies.config.study_file import linkage_starters

    rows = [[name, summary] for name, summary in linkage_starters().items()]
    print_table("linkages that tables describe", [("linkage", ""), ("meaning", "")], rows)
    say("explore init --linkage NAME writes its study", "dim")
