"""`explore init`: write a study or a task to start from."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from explore.base.errors import RequestError
from explore.cli.completion import complete_mechanisms, complete_tasks
from explore.cli.output import say


def init(
    config: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="The file to write; by default study.toml, or task.toml.")
    ] = None,
    mechanism: Annotated[
        str | None, typer.Option(autocompletion=complete_mechanisms, help="The mechanism; default: crank-rocker.")
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
) -> None:
    """Write a commented study or task that runs, to start from."""
    if task is not None and mechanism is not None:
        raise RequestError("--task has a mechanism of its own; leave out --mechanism")
    text = _study(mechanism or "crank-rocker") if task is None else _task(task)
    path = config or Path("study.toml" if task is None else "task.toml")
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise RequestError(f"{path} exists; name another file") from None
    command = "sweep" if task is None else "synthesize"
    say(f"wrote {path}; now run: {shlex.join(['explore', command, str(path)])}")


def _study(mechanism: str) -> str:
    from explore.studies.config.study_file import starter
    from explore.studies.request.names import find_mechanism

    return starter(find_mechanism(mechanism))


def _task(kind: str) -> str:
    from explore.synthesis.tasks.task_files import task_starter

    return task_starter(kind)
