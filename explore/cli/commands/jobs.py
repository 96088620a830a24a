"""`explore jobs`: list the jobs of a service, or change one."""

from typing import Annotated, Any

import typer

from explore.base.errors import RequestError
from explore.cli.options import JsonOption, ServerOption, TokenFileOption
from explore.cli.output import print_json, say
from explore.cli.tables import print_table


def jobs(
    name: Annotated[str | None, typer.Argument(metavar="JOB", help="A job to show or change; all by default.")] = None,
    *,
    server: ServerOption,
    token_file: TokenFileOption = None,
    cancel: Annotated[bool, typer.Option("--cancel", help="Cancel it; what is computed stays.")] = False,
    retry: Annotated[bool, typer.Option("--retry", help="Queue it again after it failed or was cancelled.")] = False,
    delete: Annotated[bool, typer.Option("--delete", help="Delete it with its results.")] = False,
    priority: Annotated[
        int | None, typer.Option(min=1, max=9, help="Its new priority while it waits: 1 runs first, 9 last.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List the jobs of a service, or cancel, retry, prioritise or delete one."""
    from explore.service.client import Service

    if cancel + retry + delete + (priority is not None) > 1:
        raise RequestError("--cancel, --retry, --delete and --priority change a job in one way at a time; name one")
    service = Service(server, token_file)
    if name is None:
        if cancel or retry or delete or priority is not None:
            raise RequestError("name the job to change; `explore jobs` without options lists them")
        listed = service.jobs()
    else:
        job = service.job(name)
        if delete:
            job.delete()
            say(f"deleted {name} and its results")
            return
        if cancel:
            job.cancel()
        elif retry:
            job.retry()
        elif priority is not None:
            job.prioritise(priority)
        listed = [job.facts()]
    print_json(listed) if as_json else _print_jobs(listed, server)


def _print_jobs(jobs: list[dict[str, Any]], server: str) -> None:
    """Print a table of jobs, and the reasons and remarks of those that have some."""
    if not jobs:
        say(f"no jobs at {server}", data=True)
        return
    columns = ("job", "kind", "state", "priority", "done", "designs", "left")
    rows = [[str(job["name"]), str(job["kind"]), str(job["state"]), *_numbers(job)] for job in jobs]
    print_table(f"jobs at {server}", [(column, "s" if column == "left" else "") for column in columns], rows)
    for job in jobs:
        if job["reason"]:
            say(f"{job['name']}: {job['reason']}", data=True)
        for remark in job.get("remarks", []):  # which older services do not have
            say(f"{job['name']}: perhaps not meant: {remark}", data=True)


def _numbers(job: dict[str, Any]) -> list[str]:
    is_search = job["kind"] == "task" and not job["designs"]  # which tells how far it is only where it has steps
    left = "not known" if is_search and job["state"] == "running" else ""
    if job["seconds_left"] is not None:
        left = f"{job['seconds_left']:,.0f}"
    priority = str(job["priority"]) if job["state"] == "queued" else ""
    designs = f"{job['designs']:,}" if job["designs"] else "when found" if is_search else ""
    return [priority, f"{job['done']:,}", designs, left]
