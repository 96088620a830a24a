"""The command line inside the test's own process, for the many runs that need no other, and on a terminal."""

import contextlib
import io
import os
import pty
import signal
import subprocess
import sys
import threading
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


def on_terminal(*arguments, cwd):
    """Run `explore` as a process whose stderr is a terminal; returns stdout and what the terminal got."""
    terminal, other_end = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", "from explore.cli import main; main()", *arguments],
        cwd=cwd,
        stdout=subprocess.PIPE,
        stderr=other_end,
        env={**os.environ, "COLUMNS": "100", "TERM": "xterm"},
    )
    os.close(other_end)
    said: list[bytes] = []
    reader = threading.Thread(target=lambda: read_all(terminal, said))
    reader.start()
    output, _ = process.communicate(timeout=60)
    reader.join()
    os.close(terminal)
    text = b"".join(said).decode()
    assert process.returncode == 0, text
    return output.decode(), text


def read_all(terminal: int, said: list[bytes]) -> None:
    while True:
        try:
            said.append(os.read(terminal, 4096))
        except OSError:  # how Linux says that the other end is closed
            return
