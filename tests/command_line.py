"""The command line inside the test's own process, for the many runs that need no process of their own."""

import contextlib
import io
import signal
import sys
from unittest import mock

import pytest

from explore.cli import main

#: Seconds that a run of a few designs may take before it counts as hung; a usual one takes some milliseconds.
PATIENCE = 20


def call(*arguments, seconds=PATIENCE):
    """Run `explore` with these arguments; returns the exit code, stdout and stderr."""
    out, err = io.StringIO(), io.StringIO()
    code = 0
    with (
        mock.patch.object(sys, "argv", ["explore", *map(str, arguments)]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        patience(seconds),
    ):
        try:
            main()
        except SystemExit as ending:
            code = ending.code or 0
    return code, out.getvalue(), err.getvalue()


@contextlib.contextmanager
def patience(seconds):
    """Fail instead of waiting forever."""

    def give_up(*_):
        pytest.fail(f"still not done after {seconds} s")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
