"""`explore submit`: give a study to a service."""

from __future__ import annotations

import re
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.cli.options import JsonOption, KeepOption
from explore.cli.output import count_of, print_json, say

if TYPE_CHECKING:
    from explore.serving.client import JobHandle


def submit(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="The study, a TOML file.")],
    server: Annotated[str, typer.Option("--server", metavar="URL", help="Address of the service.")],
    token_file: Annotated[
        Path | None,
        typer.Option(
            "--token-file", metavar="FILE", help="File `token` of the service's folder; default: $EXPLORE_TOKEN."
        ),
    ] = None,
    name: Annotated[
        str | None, typer.Option(help="Name of the job and of its results; by default that of the file.")
    ] = None,
    keep: Annotated[KeepOption, typer.Option(help="Keep every design, or only the Pareto set.")] = KeepOption.all,
    priority: Annotated[int, typer.Option(min=1, max=9, help="1 is swept first, 9 last.")] = 5,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show what would be computed, and queue nothing.")] = False,
    wait: Annotated[bool, typer.Option("--wait", help="Wait until the sweep ends.")] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Wait, and fetch the results into this file.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Queue a study at a service, which sweeps it."""
    from explore.config import toml_text
    from explore.serving.client import Service

    text = toml_text.read_text(str(study))
    name = name or re.sub(r"[^a-z0-9_-]+", "-", study.stem.lower()).strip("-_")
    service = Service(server, token_file)
    if dry_run:
        plan = service.plan(text, name=name, keep=keep.value)
        print_json(plan) if as_json else _print_plan(plan)
        return
    job = service.submit(text, name=name, keep=keep.value, priority=priority)
    if wait or output is not None:
        _wait(job)
    if output is not None:
        job.results(output)
        say(f"fetched {output}")
    progress = job.progress()
    if as_json:
        print_json({"name": name, **asdict(progress)})
    elif not wait and output is None:
        say(f"{name}: {count_of(progress.designs, 'design')}, {progress.state} at {server}")


def _print_plan(plan: dict[str, Any]) -> None:
    size = "the front only" if plan["bytes"] is None else f"{plan['bytes'] / 1e6:,.1f} MB"
    seconds = "" if plan["seconds"] is None else f", about {plan['seconds']:.2g} s of computing"
    say(f"{count_of(plan['designs'], 'design')} ({plan['method']}), {plan['columns']} columns, {size}{seconds}")


def _wait(job: JobHandle) -> None:
    """Wait, and raise unless the job is done."""
    from explore.serving.client import ServiceError

    progress = job.wait()
    if progress.state != "done":
        raise ServiceError(f"{job.name} is {progress.state}{': ' * bool(progress.reason)}{progress.reason}")
    say(f"{job.name} is done: {count_of(progress.designs, 'design')}")
