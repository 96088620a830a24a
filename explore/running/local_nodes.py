"""Scheduler and worker of a cluster on this machine, without dask's HTTP server."""

from distributed import Scheduler, Worker


class _WithoutHttpServer:
    """Mixin: no HTTP server. dask starts one without access control even when it has no page to serve."""

    def start_http_server(self, *_: object, **__: object) -> None:
        """Do nothing."""


class LocalScheduler(_WithoutHttpServer, Scheduler):  # type: ignore[misc]  # dask has no types
    """A scheduler that listens on its own protected address only."""


class LocalWorker(_WithoutHttpServer, Worker):  # type: ignore[misc]  # likewise
    """A worker that listens on its own protected address only."""
