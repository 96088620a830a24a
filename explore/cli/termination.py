"""SIGTERM during a sweep, and interrupts that C code drops."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

#: Time after which a dropped interrupt is raised again, s: out of the callback that dropped it.
_SOON = 0.01


def keep_interrupts() -> None:
    """Raise KeyboardInterrupt again where C code drops it, as a compiler's does in callbacks."""
    report = sys.unraisablehook

    def take(dropped: "sys.UnraisableHookArgs") -> None:
        if not issubclass(dropped.exc_type, KeyboardInterrupt):
            report(dropped)
            return
        timer = threading.Timer(_SOON, _interrupt)
        timer.daemon = True
        timer.start()

    sys.unraisablehook = take


def _interrupt() -> None:
    """Raise KeyboardInterrupt in the main thread, also where the signal is ignored by now."""
    import ctypes

    number = ctypes.c_ulong(threading.main_thread().ident or 0)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(number, ctypes.py_object(KeyboardInterrupt))


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
