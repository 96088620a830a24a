"""Processes that write a results file, made by fork from one that has imported everything already.

A fresh Python takes about a second, a fork a few milliseconds, and the process killed is as real. This module runs as a
process of its own, under the recorder, and takes orders as JSON lines (see `server.py`).
"""

from __future__ import annotations

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

import distributed  # noqa: F401
import pandas as pd  # noqa: F401

import explore.cli
import explore.cli.sweeps
import explore.sampling
import explore.sweeping
from faults import content

_LIBRARY = ctypes.CDLL(None)


def say(word: str) -> None:
    """Acknowledge something: for the test on stdout, for the replay in the trace."""
    os.write(1, f"{word}\n".encode())
    _LIBRARY.recorder_mark(word.encode())


def write(order: dict[str, Any]) -> None:
    """Write the blocks that are pending, in the order of their numbers."""
    options = {"keep": order.get("keep", "all"), "restart": order.get("restart", False), **order.get("attributes", {})}
    with content.writer(Path(order["path"]), **options) as w:
        pending = w.pending
        for number in sorted(set(range(content.N_BLOCKS)) - set(pending)):
            say(f"done {number}")  # what the writer counts as durable must be so, too
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
    """Start processes that live on, in both ways that workers are started, and with every door open to inherit."""
    import multiprocessing

    process = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(600,))
    process.start()
    other = subprocess.Popen(["sleep", "600"], close_fds=False)
    say(f"children {process.pid} {other.pid}")


def run(order: dict[str, Any]) -> int:
    """Carry out an order in a fork; returns the exit code that the command line would give."""
    for number, name in enumerate(("input", "said", "complained")):
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
    else:  # the command line's own way with errors, around the writer alone
        explore.cli.app = lambda: write(order)
    try:
        explore.cli.main()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(bool(end.code))
    return 0


def end_of(process: int, timeout: float) -> int:
    """Wait for a fork: its exit code, or minus the signal. A process that does not end in time is killed."""
    give_up = time.monotonic() + timeout
    while True:
        found, status = os.waitpid(process, os.WNOHANG)
        if found:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > give_up:
            os.kill(process, 9)
        time.sleep(0.0005)


def serve() -> None:
    """Obey: start a process (answer: its number) or wait for one (answer: its exit code)."""
    answer = os.fdopen(os.dup(1), "w", buffering=1)
    del os.environ["LD_PRELOAD"]  # the children of the forks are none of our business
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
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
            except BaseException as error:  # whatever it is must not reach the loop of the parent
                os.write(2, f"Traceback: {error!r}\n".encode())
                code = 99
            os._exit(code)
        answer.write(f"{process}\n")


if __name__ == "__main__":
    serve()
