"""`explore serve`: take studies over HTTP, sweep them one after the other, keep and show the results."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from explore.base.errors import RequestError
from explore.cli.output import say


def serve(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of the studies and results.")] = Path(
        "served"
    ),
    host: Annotated[str, typer.Option(help="Address to listen at.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65_535, help="Port to listen at; 0 for a free one.")] = 8765,
    public_url: Annotated[
        str | None, typer.Option("--public-url", metavar="URL", help="Address that browsers use, if it is another.")
    ] = None,
    certificate: Annotated[
        Path | None, typer.Option("--certificate", metavar="FILE", help="Certificate for TLS, PEM.")
    ] = None,
    key: Annotated[Path | None, typer.Option("--key", metavar="FILE", help="Private key for TLS, PEM.")] = None,
    behind_proxy: Annotated[
        bool, typer.Option("--behind-proxy", help="A reverse proxy with TLS stands before this address.")
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, help="Number of threads of a sweep (processes with --processes); default: one per processor."
        ),
    ] = None,
    processes: Annotated[bool, typer.Option("--processes", help="Sweep in processes, not in threads.")] = False,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Sweep on a dask cluster, such as tcp://host:8786.")
    ] = None,
    max_designs: Annotated[int, typer.Option(min=1, help="Most designs of a study.")] = 1_000_000_000,
    max_bytes: Annotated[int, typer.Option(min=1, help="Most bytes of a results file.")] = 100_000_000_000,
    max_queue: Annotated[int, typer.Option(min=1, help="Most jobs that wait.")] = 100,
    max_hours: Annotated[float | None, typer.Option(min=0.0, help="Most hours of a sweep.")] = None,
) -> None:
    """Take studies over HTTP, sweep them one after the other, and show the results; Ctrl-C stops."""
    if missing := [name for name in ("fastapi", "prometheus_client", "uvicorn") if find_spec(name) is None]:
        raise RequestError(f'explore serve needs {", ".join(missing)}: pip install "linkage-explore[serve]"')
    if scheduler is not None and (workers is not None or processes):
        raise RequestError("--scheduler brings its own workers; leave out --workers and --processes")
    _check_folder(folder)
    if scheduler is not None:
        from explore.running.clusters import check_address

        check_address(scheduler)
    from explore.service.plans import Limits
    from explore.service.runner import Work
    from explore.service.server import Place
    from explore.service.server import serve as serve_folder

    def announce(link: str, link_to_look: str) -> None:
        say(f"serving {folder}; open {link}", data=True)
        say(f"to look only: {link_to_look} (each link opens one browser, once); scripts: {folder / 'token'}", "dim")

    place = Place(host, port, public_url, certificate, key, behind_proxy)
    limits = Limits(max_designs, max_bytes, max_queue, None if max_hours is None else 3600 * max_hours)
    serve_folder(folder, place, limits, Work(workers, scheduler, processes), announce)
    say("stopped; what waits or was under way goes on at the next start", "dim")


def _check_folder(folder: Path) -> None:
    """Refuse what is no folder, and a folder of other files: what is in its results would become the service's."""
    if folder.exists() and not folder.is_dir():
        raise RequestError(f"{folder} is no folder; name one, such as served")
    if not folder.is_dir() or (folder / "queue").is_dir():
        return
    others = sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))
    if others:
        raise RequestError(
            f"{folder} holds other files, such as {others[0]}; name a new folder, such as {folder / 'served'}"
        )
