"""Fixtures: the recorder of system calls, the server of writers, the figures printed at the end."""

import itertools
import os
import shutil
import subprocess
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from run_figures import user_property_values

from faults.checker import Verdict, sha256
from faults.content import fill
from faults.disks import mounted
from faults.server import Server
from faults.sweeps import Command

_FIGURES = "faults injected into the store"
_HEADINGS = ("trials", "unreadable", "lost", "phantom", "detected", "redone")


class Figures(Counter):
    """Counts of the trials of one test."""

    def count(self, verdict: Verdict) -> Verdict:
        """Count a trial."""
        self["trials"] += 1
        self["unreadable"] += bool(verdict.unreadable)
        for name in ("lost", "phantom"):
            self[name] += len(getattr(verdict, name))
        self["detected"] += len(verdict.detected & verdict.committed)  # half a word or a garbled one commits nothing
        return verdict

    @property
    def harmless(self) -> bool:
        """Whether no trial did any harm."""
        return not any(self[name] for name in ("unreadable", "lost", "phantom", "detected"))


@pytest.fixture
def figures(request) -> Iterator[Figures]:
    """Counts of this test, printed at the end of the run."""
    counts = Figures()
    yield counts
    request.node.user_properties.append((_FIGURES, [request.node.originalname, dict(counts)]))


def pytest_terminal_summary(terminalreporter) -> None:
    table: dict[str, Counter] = {}
    for name, counts in user_property_values(terminalreporter, _FIGURES):
        table.setdefault(name, Counter()).update(counts)
    if not table:
        return
    width = max(map(len, table))
    terminalreporter.section(_FIGURES)
    terminalreporter.line(" " * width + "".join(f"{name:>12}" for name in _HEADINGS))
    for name, counts in table.items():
        terminalreporter.line(f"{name:{width}}" + "".join(f"{counts[heading]:>12,}" for heading in _HEADINGS))


@pytest.fixture(scope="session")
def recorder(tmp_path_factory) -> Path:
    """The library for LD_PRELOAD, compiled here."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        reason = "no C compiler (cc or gcc), which the recorder of system calls needs"
        (pytest.fail if os.environ.get("CI") else pytest.skip)(reason)
    library = tmp_path_factory.mktemp("recorder") / "recorder.so"
    source = Path(__file__).with_name("recorder.c")
    command = [compiler, "-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-o", str(library), str(source)]
    subprocess.run(command, check=True, timeout=240)
    return library


@pytest.fixture(scope="session")
def server(recorder, tmp_path_factory) -> Iterator[Server]:
    """Starts writers under the recorder."""
    server = Server(recorder, tmp_path_factory.mktemp("server"))
    yield server
    server.close()


@pytest.fixture
def command() -> Iterator:
    """Starts real commands, and kills those that outlive the test."""
    started: list[Command] = []

    def start(*arguments: Any, **options: Any) -> Command:
        started.append(Command(*arguments, **options))
        return started[-1]

    yield start
    for process in started:
        process.kill()


@pytest.fixture(scope="session")
def memory() -> Iterator[Path]:
    """A folder in memory if available: thousands of states are written and need not be durable."""
    parent = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="explore-faults-", dir=parent) as name:
        yield Path(name)


@pytest.fixture
def fresh(memory) -> Iterator:
    """Makes empty folders, one for each trial, and removes them after the test."""
    folders: list[Path] = []
    numbers = itertools.count()

    def make_folder() -> Path:
        if folders:  # keep the last one only
            shutil.rmtree(folders.pop())
        folders.append(memory / f"trial{next(numbers)}")
        folders[0].mkdir()
        return folders[0]

    yield make_folder
    for folder in folders:
        shutil.rmtree(folder)


@pytest.fixture
def keep() -> str:
    """The default of `keep` for tests without that parameter."""
    return "all"


@pytest.fixture
def undisturbed(memory, keep) -> Path:
    """The results file of an undisturbed run."""
    path = memory / f"undisturbed-{keep}" / "grid.h5"
    if not path.exists():
        path.parent.mkdir()
        fill(path, keep=keep)
    return path


@pytest.fixture
def whole(undisturbed) -> str:
    """Digest of the results file of an undisturbed run."""
    return sha256(undisturbed)


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 1 MiB, three times the size of the results file."""
    place = tmp_path / "disk"
    place.mkdir()
    with mounted(place, "1m"):
        yield place
