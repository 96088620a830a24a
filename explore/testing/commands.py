"""Every command, run on a study of the mechanism in this process."""

import io
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from explore.base.errors import RequestError
from explore.cli import command
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
    for words in commands:
        if problem := _run(*words):
            yield problem


def _run(*arguments: object) -> str:
    """Run a command; the sentence of its failure, or nothing."""
    words, errors = [str(argument) for argument in arguments], io.StringIO()
    reason = ""
    try:
        with redirect_stdout(io.StringIO()), redirect_stderr(errors):
            command()(words)
    except SystemExit as ending:
        reason = (errors.getvalue().strip() or f"exit code {ending.code}") if ending.code else ""
    except Exception as error:
        refuses = words[0] == "plot" and isinstance(error, RequestError)
        reason = "" if refuses else f"{type(error).__name__}: {error}"
    return f"`explore {' '.join(Path(word).name for word in words)}` fails: {reason}" if reason else ""
