"""Every command, run on a study of the mechanism in this process."""

from collections.abc import Iterator
from pathlib import Path

from typer.testing import CliRunner

from explore.base.errors import RequestError
from explore.cli.application import app
from explore.cli.commands.plot import KINDS


def failing_commands(name: str, study: Path) -> Iterator[str]:
    """A sentence for each command that fails on a study of this mechanism; files go to the folder of the study.

    A kind of plot may refuse results that it cannot show.
    """
    folder, results = study.parent, study.with_suffix(".h5")
    if problem := _run("sweep", study, "-o", results, "--quiet"):
        yield problem
        return
    commands: list[tuple[object, ...]] = [
        ("sweep", study, "--dry-run"),
        ("mechanisms", name),
        ("mechanisms", name, "--json"),
        ("simulate", study, "--design", 0, "-o", folder / "motion.csv"),
        ("rank", results),
        ("show", results),
        ("show", results, "--design", 0),
        *(("plot", kind, results, "-o", folder / f"{kind}.png") for kind in KINDS),
        ("report", results, "-o", folder / "report.html"),
        ("verify", results),
        ("pack", results, "-o", folder / "packed.h5"),
    ]
    for command in commands:
        if problem := _run(*command):
            yield problem


def _run(*arguments: object) -> str:
    """Run a command; the sentence of its failure, or nothing."""
    words = [str(argument) for argument in arguments]
    result = CliRunner().invoke(app, words)
    if result.exit_code == 0 or (words[0] == "plot" and isinstance(result.exception, RequestError)):
        return ""
    reason = f"{type(result.exception).__name__}: {result.exception}" if result.exception else result.stderr.strip()
    return f"`explore {' '.join(Path(word).name for word in words)}` fails: {reason}"
