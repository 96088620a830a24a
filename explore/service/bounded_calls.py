"""Calls that may take long, each in a process that is killed when its time is over.

The pools of the standard library cannot kill one call; workers of anyio and Pebble would end
theirs although the service was killed.
"""

import os
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import connection, get_context, parent_process
from typing import Any

from explore.base.errors import ExploreError, RequestError


class BoundedCalls:
    """Calls functions in processes that are kept for the next call; safe to use from several threads.

    A thread cannot be ended, so a request that takes for ever would keep its thread and a processor for ever.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._idle: list[_Caller] = []
        self._guard = threading.Lock()

    def call(self, what: str, function: Callable[..., Any], *arguments: Any) -> Any:
        """The value of a function of a module, or its error.

        Raises `RequestError` if the call takes too long, or its process was killed; `what` says in words what was
        called.
        """
        with self._guard:
            caller = self._idle.pop() if self._idle else None
        caller = caller or _Caller()
        try:
            outcome = caller.call(function, arguments, self._seconds)
        except TimeoutError:
            caller.end()
            raise RequestError(
                f"{what} took longer than {self._seconds:,.0f} s, this server's limit; ask for less, "
                "or fetch the file and use the command line"
            ) from None
        except (EOFError, OSError):
            caller.end()
            raise RequestError(f"the process of {what} was killed; is memory short?") from None
        except BaseException:
            caller.end()
            raise
        with self._guard:
            self._idle.append(caller)
        if isinstance(outcome, BaseException):
            raise outcome
        return outcome

    def close(self) -> None:
        """End the processes that are idle."""
        with self._guard:
            while self._idle:
                self._idle.pop().end()


class _Caller:
    """A process that calls functions."""

    def __init__(self) -> None:
        context = get_context("spawn")  # a fork would take over the locks of the other threads
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_answer, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()

    def call(self, function: Callable[..., Any], arguments: tuple[Any, ...], seconds: float) -> Any:
        """The value of a function, or the error that it raised as a value."""
        self._pipe.send((function, arguments))
        if not self._pipe.poll(seconds):
            raise TimeoutError
        return self._pipe.recv()

    def end(self) -> None:
        """Kill the process."""
        self._pipe.close()
        self._process.kill()
        self._process.join()
        self._process.close()


def _answer(pipe: connection.Connection) -> None:
    """Make the calls that arrive until the other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C on the terminal is for the service, which ends this process
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            function, arguments = pipe.recv()
            try:
                outcome = function(*arguments)
            except (ExploreError, OSError) as error:
                outcome = error
            except MemoryError:
                outcome = RequestError("not enough memory; ask for less")
            pipe.send(outcome)


def _end_with_parent() -> None:
    """End this process with the service, in the midst of a call too."""
    parent = parent_process()
    assert parent is not None  # noqa: S101 -- this function runs in processes that `_Caller` started
    connection.wait([parent.sentinel])
    os._exit(1)
