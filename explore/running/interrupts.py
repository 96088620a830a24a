"""Ctrl-C while processes start: it waits until all run, and does not reach them."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def interrupts_held() -> Iterator[Callable[[], None]]:
    """Hold back the signals that Python functions handle.

    Yields a function to call afterwards, which lets the first of them through; it is called if the body fails. Threads
    that start in the body, and their processes, never get Ctrl-C, which a terminal sends to every process, except on
    Windows. Off the main thread, which handles signals, none is held.
    """
    held: list[int] = []

    def release() -> None:
        for number in held[:1]:
            handlers[number](number, None)

    is_main = threading.current_thread() is threading.main_thread()
    found = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM) if is_main}
    handlers = {int(number): handler for number, handler in found.items() if callable(handler)}
    for each in handlers:
        signal.signal(each, lambda number, _: held.append(number))
    try:
        try:
            with _ctrl_c_blocked():
                yield release
        finally:
            for number, handler in handlers.items():
                signal.signal(number, handler)
    except Exception:
        release()
        raise


@contextmanager
def _ctrl_c_blocked() -> Iterator[None]:
    """Block Ctrl-C for this thread; threads and processes that it starts inherit that."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # it would unblock Ctrl-C in the thread that starts it
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
