"""`explore submit`: give a study, a task or a refinement to a service."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.base.errors import RequestError
from explore.cli.options import JsonOption, KeepOption, ServerOption, TokenFileOption, output_option
from explore.cli.output import count_of, print_json, say

if TYPE_CHECKING:
    from explore.service.client import JobHandle, Service

#: Pattern of a line that may name a file of points or of a linkage, also in a table in braces.
_NAMES_A_FILE = re.compile(r"^(?:[^#\n]*\bfile[\"']?\s*=|\s*linkage\s*=\s*[\"'])", re.MULTILINE)


def submit(
    file: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="The study or the task, a TOML file; none with --refine.")
    ] = None,
    *,
    server: ServerOption,
    token_file: TokenFileOption = None,
    name: Annotated[
        str | None,
        typer.Option(help="Name of the job and of its results; default: that of the file, or JOB-refined."),
    ] = None,
    keep: Annotated[KeepOption, typer.Option(help="Keep every design, or only the Pareto set.")] = KeepOption.all,
    refine: Annotated[
        str | None, typer.Option("--refine", metavar="JOB", help="Refine the results of this job, which is done.")
    ] = None,
    metric: Annotated[
        list[str] | None,
        typer.Option(
            help="With --refine: NAME, NAME:min or NAME:max, two or more: objectives in place of the study's."
        ),
    ] = None,
    evaluations: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="With --refine: number of designs to evaluate; default: 262,144."),
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="With --refine: seed of the random steps.")] = None,
    priority: Annotated[int, typer.Option(min=1, max=9, help="1 runs first, 9 last.")] = 5,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show what would be computed, and queue nothing.")] = False,
    wait: Annotated[bool, typer.Option("--wait", help="Wait until the job ends.")] = False,
    output: Annotated[Path | None, output_option(help="Wait, and fetch the results into this file.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Queue a study, a task or a refinement at a service, which runs it."""
    from explore.service.client import Service

    if (file is None) == (refine is None):
        raise RequestError("name a file to submit, or a job by --refine, and not both")
    if output is not None and output.is_dir():  # said before the sweep, not after it
        raise RequestError(f"-o {output} is a folder; name a file, such as {output / 'results.h5'}")
    service = Service(server, token_file)
    if file is not None:
        if metric or evaluations is not None or seed is not None:
            raise RequestError("--metric, --evaluations and --seed are for --refine; those of a file are in the file")
        plan, queue = _calls_for_file(service, file, name, keep, priority)
    elif keep != KeepOption.all:
        raise RequestError("a refinement keeps all its designs; leave out --keep")
    else:
        options: dict[str, Any] = {"name": name, "objectives": metric, "evaluations": evaluations, "seed": seed or 0}
        plan = partial(service.plan_refinement, str(refine), **options)
        queue = partial(service.refine, str(refine), priority=priority, **options)
    if dry_run:
        print_json(plan()) if as_json else _print_plan(plan())
        return
    job = queue()
    if wait or output is not None:
        _wait(job)
    if output is not None:
        job.results(output)
        say(f"fetched {output}")
    progress = job.progress()
    if as_json:
        print_json({"name": job.name, **asdict(progress)})
    elif not wait and output is None:
        designs = f"{count_of(progress.designs, 'design')}, " if progress.designs else ""
        say(f"{job.name}: {designs}{progress.state} at {server}")


def _calls_for_file(
    service: Service, file: Path, name: str | None, keep: KeepOption, priority: int
) -> tuple[Callable[[], dict[str, Any]], Callable[[], JobHandle]]:
    """What plans and what queues a study or a task; its default name is that of the file."""
    from explore.studies.config import toml_text

    text = toml_text.read_text(str(file))
    if _NAMES_A_FILE.search(text):  # what reads files takes a second to import
        from explore.service.inlined_points import with_points

        text = with_points(text, file)
    own = name or re.sub(r"[^a-z0-9_-]+", "-", file.stem.lower()).strip("-_")
    plan = partial(service.plan, text, name=own, keep=keep.value)
    return plan, partial(service.submit, text, name=own, keep=keep.value, priority=priority)


def _print_plan(plan: dict[str, Any]) -> None:
    """Print what a job would make and take."""
    for remark in plan.get("remarks", []):  # which older services do not have
        say(f"warning: {remark}", "yellow")
    if plan["designs"] is None:
        found = f"linkages of a {plan['mechanism']} for a task ({plan['method']})"
        say(f"{found}; how many, and how long the search takes, is known when it is done")
        return
    size = "the front only" if plan["bytes"] is None else f"{plan['bytes'] / 1e6:,.1f} MB"
    seconds = "" if plan["seconds"] is None else f", about {plan['seconds']:.2g} s of computing"
    say(f"{count_of(plan['designs'], 'design')} ({plan['method']}), {plan['columns']} columns, {size}{seconds}")
    if plan.get("note"):
        say(plan["note"], "dim")


def _wait(job: JobHandle) -> None:
    """Wait, and raise unless the job is done."""
    from explore.cli.progress import job_progress
    from explore.service.requester import ServiceError

    with job_progress(job.name) as report:
        progress = job.wait(report=report)
    if progress.state != "done":
        raise ServiceError(f"{job.name} is {progress.state}{': ' * bool(progress.reason)}{progress.reason}")
    say(f"{job.name} is done: {count_of(progress.designs, 'design')}")
