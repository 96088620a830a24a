"""Sweeps and clusters as separate processes that tests can kill."""

import contextlib
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from command_line import call
from faults.checker import done_blocks
from waiting import wait_until

import explore
from explore.results.store.block_bytes import damaged_blocks
from explore.results.store.layout_reader import read_layout
from explore.studies.designs.spaces import BLOCK_SIZE

#: Folder of the package that is tested, which has its compiled kernels.
PACKAGES = Path(explore.__file__).parents[1]
#: Closed form only: a block takes 15 ms and 62 bytes a design.
_STUDY = """\
mechanism = "crank-rocker"
[parameters]
crank = {{ start = 60, stop = 180, num = 256 }}
coupler = {{ start = 900, stop = 1300, num = 256 }}
rocker = {{ start = 450, stop = 660, num = {blocks} }}
ground = 700
[evaluate]
"""
_METRICS = {
    "all": 'metrics = ["grashof_margin"]',
    "front": 'metrics = ["grashof_margin", "swing_angle"]\n[rank]\nmetrics = ["grashof_margin:max", "swing_angle:max"]',
}


def study_file(folder: Path, blocks: int, keep: str = "all") -> Path:
    """A study of so many full blocks; with objectives if only the front is kept."""
    path = folder / f"study{blocks}-{keep}.toml"
    path.write_text(_STUDY.format(blocks=blocks) + _METRICS[keep] + "\n")
    return path


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def committed_blocks(path: Path) -> list[int]:
    """Numbers of the committed blocks of a results file, none of them damaged, or of a front's journal."""
    if path.exists():
        layout = read_layout(path)
        with path.open("rb", buffering=0) as file:
            assert damaged_blocks(file, layout) == []
    return sorted(done_blocks(path))


def is_running(pid: int) -> bool:
    """Whether a process runs; a zombie does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def session_members(session: int) -> list[int]:
    """The running processes of a session."""
    pids = []
    for entry in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            if int(fields[3]) == session and fields[0] != "Z":
                pids.append(int(entry.name))
    return pids


class _Process:
    """A process in its own session; the context manager ends all processes of the session."""

    def __init__(self, command: Sequence[str], folder: Path, name: str, path: Path = PACKAGES) -> None:
        surrounding = os.environ | {"PYTHONPATH": os.pathsep.join([str(path)]), "NO_COLOR": "1"}
        self._stdout, self._stderr = folder / f"{name}.out", folder / f"{name}.err"
        with self._stdout.open("w") as stdout, self._stderr.open("w") as stderr:
            self.process = subprocess.Popen(
                [sys.executable, *command],
                cwd=folder,
                env=surrounding,
                stdout=stdout,
                stderr=stderr,
                start_new_session=True,
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for pid in session_members(self.process.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self.process.wait()

    @property
    def members(self) -> list[int]:
        """All running processes of the session."""
        return session_members(self.process.pid)

    @property
    def stderr(self) -> str:
        """Its output so far."""
        return self._stderr.read_text()

    def signal_all(self, number: signal.Signals) -> None:
        """Send a signal to the whole group, as a terminal does."""
        os.killpg(self.process.pid, number)


class Sweep(_Process):
    """A running `explore sweep` and a record of its blocks.

    Parameters
    ----------
    config, results
        The study and where its results go; the process works in the folder of the results.
    options
        More of the command line.
    plan
        See `sabotage`; without it the command is the real one, untouched.
    """

    _count = 0

    def __init__(self, config: Path, results: Path, *options: str, **plan: Any) -> None:
        Sweep._count += 1
        self.results = results
        self._record = results.with_name(f"sweep{Sweep._count}.executions")
        self._record.touch()
        program = ["-m", "explore"]
        if plan:
            plan["record"] = str(self._record)
            program = [str(Path(__file__).with_name("sabotage.py")), json.dumps(plan)]
        self.words = ["sweep", str(config), "-o", str(results), *options]
        super().__init__([*program, *self.words], results.parent, f"sweep{Sweep._count}")

    def end(self, seconds: float = 240.0) -> tuple[int, list[str]]:
        """Wait for its end; return the exit code and the lines on stderr. A hanging process prints its stack."""
        try:
            return self.process.wait(seconds), self.stderr.splitlines()
        except subprocess.TimeoutExpired:
            self.process.send_signal(signal.SIGUSR1)
            time.sleep(1)
            raise AssertionError(f"hangs after {self.executions[-4:]}, alive: {self.members}\n{self.stderr}") from None

    @property
    def executions(self) -> list[tuple[int, int]]:
        """Block and process of every execution that started."""
        lines = self._record.read_text().splitlines()
        return [(int(number), int(pid)) for number, pid, _ in map(str.split, lines)]

    @property
    def n_repetitions(self) -> int:
        """Number of executions that repeat a block."""
        return sum(Counter(number for number, _ in self.executions).values()) - len(set(self.executed_blocks))

    @property
    def executed_blocks(self) -> list[int]:
        """Blocks that were executed, with repetitions."""
        return [number for number, _ in self.executions]

    def at_work(self, n_ignored: int = 0) -> int:
        """Wait for a running process that works on a block, ignoring the first `n_ignored` executions.

        Not if others died with that block before: a block of which four workers died is taken for deadly.
        """

        def busy_process() -> int | None:
            counts = Counter(self.executed_blocks)
            latest = {pid: number for number, pid in self.executions[n_ignored:]}
            return next((pid for pid, number in latest.items() if counts[number] < 3 and is_running(pid)), None)

        return wait_until(busy_process)

    def wait_for_blocks(self, number: int) -> None:
        """Wait until so many blocks are committed."""
        wait_until(lambda: len(committed_blocks(self.results)) >= number)

    def log(self) -> list[Mapping[str, Any]]:
        """The events of the log; every line is a JSON object."""
        return read_log(self.results)

    @property
    def command_to_continue(self) -> str:
        """The command that continues it."""
        return " ".join(["explore", *self.words])


def read_log(results: Path) -> list[Mapping[str, Any]]:
    """The events of the log of a results file; every line is a JSON object."""
    lines = results.with_name(results.name + ".log.jsonl").read_text().splitlines()
    events = [json.loads(line) for line in lines]
    assert all({"time", "event"} <= event.keys() for event in events)
    return events


def finish(config: Path, results: Path, *options: str) -> int:
    """Finish a sweep in this process, without a word; returns the number of blocks that it computed."""
    assert call("sweep", config, "-o", results, *options, "--quiet") == (0, "", "")
    blocks, rest = divmod(read_log(results)[-1]["computed"], BLOCK_SIZE)
    assert rest == 0
    return blocks


class Cluster:
    """`dask scheduler` and `dask worker` as processes that communicate over tcp or tls."""

    def __init__(self, folder: Path, protocol: str = "tcp") -> None:
        self._folder, self._protocol = folder, protocol
        self._closing = contextlib.ExitStack()
        self._count = 0

    def __enter__(self) -> Self:
        where = self._folder / "scheduler.json"
        where.unlink(missing_ok=True)
        options = ["--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0"]
        options += ["--protocol", self._protocol]
        command = ["-m", "distributed.cli.dask_scheduler", *options, "--scheduler-file", str(where)]
        self.scheduler = self._closing.enter_context(_Process(command, self._folder, "scheduler"))

        def read_address() -> str | None:
            with contextlib.suppress(OSError, ValueError):
                return json.loads(where.read_text())["address"]
            return None

        self.address: str = wait_until(read_address)
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.close()

    def add_worker(self, path: Path = PACKAGES) -> _Process:
        """Start a worker of one thread that imports modules from a path first."""
        self._count += 1
        options = ["--nthreads", "1", "--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0", "--no-nanny"]
        command = ["-m", "distributed.cli.dask_worker", self.address, *options]
        worker = _Process(command, self._folder, f"worker{self._count}", path)
        return self._closing.enter_context(worker)

    def wait_for_workers(self, number: int) -> None:
        """Wait until so many workers have joined."""
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(number, timeout=240)
