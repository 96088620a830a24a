"""`explore init`: write a study to start from."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from explore.cli.completion import complete_mechanisms
from explore.cli.output import say
from explore.errors import RequestError


def init(
    config: Annotated[Path, typer.Argument(metavar="STUDY", help="The file to write.")] = Path("study.toml"),
    mechanism: Annotated[str, typer.Option(autocompletion=complete_mechanisms, help="The mechanism.")] = "crank-rocker",
) -> None:
    """Write a commented study that runs, to start from."""
    from explore.config.study_file import starter
    from explore.request.names import find_mechanism

    text = starter(find_mechanism(mechanism))
    try:
        with config.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise RequestError(f"{config} exists; name another file") from None
    say(f"wrote {config}; now run: {shlex.join(['explore', 'sweep', str(config)])}")
