"""Processes that write a results file, forked from one that has imported everything and loaded the kernels already.

A fresh Python takes about a second, a fork a few milliseconds, and the process killed is as real. This module runs as a
process of its own, under the recorder, and takes orders as JSON lines (see `server.py`).
"""

import ctypes
import gc
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import distributed  # noqa: F401 -- imported before the fork
import pandas as pd  # noqa: F401 -- likewise

import explore.cli
import explore.cli.commands.sweep
import explore.running.runs
import explore.running.workers
from explore.evaluation.evaluate import compile_kernels
from explore.mechanisms.registry import MECHANISMS
from explore.studies.request.requests import make_request
from faults import content

_LIBRARY = ctypes.CDLL(None)


def say(word: str) -> None:
    """Acknowledge a block: on stdout for the test, in the trace for the replay."""
    os.write(1, f"{word}\n".encode())
    _LIBRARY.recorder_mark(word.encode())


def write(order: dict[str, Any]) -> None:
    """Write the pending blocks in the order of their numbers."""
    options = {"keep": order.get("keep", "all"), "restart": order.get("restart", False), **order.get("attributes", {})}
    with content.writer(Path(order["path"]), **options) as w:
        pending = w.pending
        for number in sorted(set(range(content.N_BLOCKS)) - set(pending)):
            say(f"done {number}")  # blocks that the writer finds committed must be durable too
        say("open")
        for position, number in enumerate(pending):
            if position == order.get("limit_after"):
                resource.setrlimit(resource.RLIMIT_FSIZE, (order["limit"], order["limit"]))
            say(f"run {number}")
            w.commit(number, content.values(number))
            say(f"done {number}")
        if isinstance(w, content.Keeper):
            w.complete()
        say("complete")
        if order.get("children"):
            have_children()
        while order.get("hold") and not Path(order["hold"]).exists():
            time.sleep(0.001)


def have_children() -> None:
    """Start child processes that outlive this one, in both ways workers are started, inheriting all they can."""
    import multiprocessing

    process = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(600,))
    process.start()
    other = subprocess.Popen(["sleep", "600"], close_fds=False)
    say(f"children {process.pid} {other.pid}")


def run(order: dict[str, Any]) -> int:
    """Carry out an order in a fork; return the exit code of the command line."""
    for number, name in enumerate(("input", "output", "errors")):
        flags = os.O_RDONLY if number == 0 else os.O_WRONLY | os.O_CREAT | os.O_APPEND
        os.dup2(os.open(order.get(name, os.devnull), flags, 0o666), number)
    os.environ.update(order.get("environment", {}))
    _LIBRARY.recorder_arm()
    if "limit" in order and "limit_after" not in order:
        resource.setrlimit(resource.RLIMIT_FSIZE, (order["limit"], order["limit"]))
    while time.monotonic() < order.get("start", 0):
        pass
    if "arguments" in order:
        sys.argv = ["explore", *order["arguments"]]
    else:  # run only the writer, with the error handling of the command line
        explore.cli.command = lambda: lambda: write(order)
    try:
        explore.cli.main()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(bool(end.code))
    return 0


def end_of(process: int, timeout: float) -> int:
    """Wait for a fork: its exit code, or minus the signal. A process that does not end in time is killed."""
    give_up = time.monotonic() + timeout
    while True:
        ended, status = os.waitpid(process, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > give_up:
            os.kill(process, 9)
        time.sleep(0.0005)


def serve() -> None:
    """Carry out orders: start a process (answer: its number) or wait for one (answer: its exit code)."""
    answer = os.fdopen(os.dup(1), "w", buffering=1)
    del os.environ["LD_PRELOAD"]  # do not record the children of the forks
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    compile_kernels(make_request(MECHANISMS["crank-rocker"]))
    gc.freeze()
    for line in sys.stdin:
        order = json.loads(line)
        if "wait" in order:
            answer.write(f"{end_of(order['wait'], order['timeout'])}\n")
            continue
        process = os.fork()
        if not process:
            try:
                code = run(order)
            except BaseException as error:  # no error may reach the loop of the parent
                os.write(2, f"Traceback: {error!r}\n".encode())
                code = 99
            os._exit(code)
        answer.write(f"{process}\n")


if __name__ == "__main__":
    serve()
