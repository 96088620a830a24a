"""SIGTERM during a sweep."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def terminable() -> Iterator[None]:
    """Treat SIGTERM, which batch systems send before SIGKILL, like Ctrl-C; a second signal is ignored."""
    interrupted = False

    def interrupt(*_: object) -> None:
        nonlocal interrupted
        interrupted = True
        for which in handlers:  # a second signal would interrupt the orderly end
            signal.signal(which, signal.SIG_IGN)
        raise KeyboardInterrupt

    handlers = {which: signal.getsignal(which) for which in (signal.SIGINT, signal.SIGTERM)}
    # A shell starts background jobs with SIGINT ignored, and it has to stay ignored.
    handlers = {which: handler for which, handler in handlers.items() if handler is not signal.SIG_IGN}
    for which in handlers:
        signal.signal(which, interrupt)
    try:
        yield
    finally:
        if not interrupted:  # otherwise the process is about to end, and no signal may disturb that
            for which, handler in handlers.items():
                signal.signal(which, handler)
