"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

ResultsArgument = Annotated[
    Path | None, typer.Argument(metavar="RESULTS", help="A results file; by default the newest results/*.h5.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]
