"""Arguments and options that several commands share."""

import re
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from explore.cli.completion import complete_mechanisms, complete_objectives

# What several commands call the same, each with a help of its own.
output_option = partial(typer.Option, "-o", "--output")
objective_option = partial(typer.Option, autocompletion=complete_objectives)
results_argument = partial(typer.Argument, metavar="RESULTS")

ResultsArgument = Annotated[Path | None, results_argument(help="A results file; by default the newest results/*.h5.")]
DesignResultsArgument = Annotated[
    Path | None,
    results_argument(help="A results file with the design; by default the newest results/*.h5."),
]
DesignOption = Annotated[
    int | None, typer.Option(min=0, help="The design of the results; by default the best of the Pareto set.")
]
MechanismOption = Annotated[
    str | None,
    typer.Option(autocompletion=complete_mechanisms, help="A mechanism, with --set in place of results."),
]
PointOption = Annotated[
    list[str] | None,
    typer.Option("--point", metavar="NAME=ALONG,ACROSS", help="A point of the floating link, mm, as knife=120,40."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]


class KeepOption(StrEnum):
    """Which designs a sweep keeps."""

    all = "all"
    front = "front"


#: Options in place of arguments of Python functions, as the library's errors quote them.
_OPTIONS = {
    "path": "-o",
    "objectives": "--metric",
    "restart=True": "--restart",
    "processes=True": "--processes",
    'keep="all"': "--keep all",
    'keep="front"': "--keep front",
    "designs": "--design",
    "tolerances": "--tolerance",
    "low": "--from",
    "high": "--to",
    "is_behind_proxy": "--behind-proxy",
    **{
        name: f"--{name.replace('_', '-')}"
        for name in ("design", "x", "y", "start", "stop", "host", "port", "public_url", "certificate", "key")
    },
}


def name_options(text: str) -> str:
    """The text of an error of the library with options in place of the arguments, which it has in backticks."""
    return re.sub(r"`([^`]+)`", lambda quoted: _OPTIONS.get(quoted[1], quoted[0]), text)


ServerOption = Annotated[str, typer.Option("--server", metavar="URL", help="Address of the service.")]
TokenFileOption = Annotated[
    Path | None,
    typer.Option("--token-file", metavar="FILE", help="File `token` of the service's folder; default: $EXPLORE_TOKEN."),
]
