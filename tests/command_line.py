"""The command line in the test's own process, and on a terminal."""

import contextlib
import io
import os
import pty
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass
from unittest import mock

import pytest
import typer
from waiting import PATIENCE

from explore.cli import main
from explore.cli.application import app

#: Names of all commands.
COMMANDS = tuple(typer.main.get_command(app).commands)


@dataclass(frozen=True)
class Output:
    """What a command printed."""

    stdout: str
    stderr: str


def run(*arguments, cwd, code=0, seconds=PATIENCE):
    """Run `explore` in a folder, on a wide terminal without colours, and check its exit code."""
    with contextlib.chdir(cwd), mock.patch.dict(os.environ, {"COLUMNS": "200", "NO_COLOR": "1"}):
        exit_code, out, err = call(*arguments, seconds=seconds)
    assert "Traceback" not in err
    assert exit_code == code, err
    return Output(out, err)


def call(*arguments, seconds=PATIENCE):
    """Run `explore` with these arguments; returns the exit code, stdout and stderr."""
    out, err = io.StringIO(), io.StringIO()
    code = 0
    with (
        mock.patch.object(sys, "argv", ["explore", *map(str, arguments)]),
        mock.patch.object(sys.modules["__main__"], "__package__", None),  # typer then takes argv[0] for the name
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        patience(seconds),
    ):
        try:
            main()
        except SystemExit as ending:
            code = ending.code or 0
    return code, out.getvalue(), err.getvalue()


def succeed(*arguments, seconds=PATIENCE):
    """Run `explore` as `call` does, without an error; returns stdout and stderr."""
    code, out, err = call(*arguments, seconds=seconds)
    assert code == 0, err
    return out, err


def assert_refused(reply, codes, *words):
    """The exit code, or one of several, no output, and one line on stderr that contains all the words."""
    code, out, err = reply
    assert code in codes if isinstance(codes, tuple) else code == codes, err
    assert out == ""
    assert err.startswith("error: ")
    assert err.count("\n") == 1, err
    assert "should not have happened" not in err
    for word in words:
        assert word in err


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
    chunks: list[bytes] = []
    reader = threading.Thread(target=lambda: read_all(terminal, chunks))
    reader.start()
    output, _ = process.communicate(timeout=240)
    reader.join()
    os.close(terminal)
    text = b"".join(chunks).decode()
    assert process.returncode == 0, text
    return output.decode(), text


def read_all(terminal: int, chunks: list[bytes]) -> None:
    while True:
        try:
            chunks.append(os.read(terminal, 4096))
        except OSError:  # how Linux says that the other end is closed
            return
