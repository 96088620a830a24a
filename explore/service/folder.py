"""The folder of a service, which `ls` explains: where the file of a study lies is the state of its job.

::

    queue/5-000012-grid.toml     waiting; the files are swept in the order of their names
    studies/running/grid.toml    under way
    studies/done/grid.toml       finished; also failed/ and cancelled/
    results/grid.h5              the results, as `explore sweep` writes them
    index/grid/                  values in the order that the results are browsed by; can be removed and made again
    log/grid.jsonl               what happened to the job, an event a line
    log/server.jsonl             what happened to the service
"""

import os
import re
import shutil
import stat
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from enum import StrEnum
from pathlib import Path

from explore.base.errors import RequestError, ResultsError
from explore.base.files import check_regular, new_file, open_regular, remove_unfinished, sync_folder
from explore.results.store.locking import LockedError, LockFile

#: Pattern of names of jobs: they are names of files too, so no path, no hidden file and no ending can be made of one.
NAME = re.compile(r"[a-z0-9](?:[a-z0-9_-]{0,62}[a-z0-9])?")
#: Name that no job may have, because its log would be the service's own.
_OWN_NAME = "server"
#: Pattern of the files of jobs that wait: priority, number, name.
_QUEUED = re.compile(rf"([1-9])-(\d{{6,}})-({NAME.pattern})\.toml")
#: Pattern of the files of other jobs: name.
_SETTLED = re.compile(rf"({NAME.pattern})\.toml")


class State(StrEnum):
    """States of a job."""

    queued = "queued"
    running = "running"
    done = "done"
    failed = "failed"
    cancelled = "cancelled"


def check_name(name: str) -> str:
    """The name itself; `RequestError` unless it can be the name of a job."""
    if name == _OWN_NAME:
        raise RequestError(f"{name} is the name of the service's own log; choose another, such as {name}-1")
    if not NAME.fullmatch(name):
        raise RequestError(
            "a job's name has 1 to 64 lower-case letters, digits, - and _, and begins and ends with a letter or digit; "
            "such as crank-rocker-2"
        )
    return name


class Folder:
    """The files of a service, whose folder is made when it is locked; only the process inside `locked` changes them."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.queue, self.results, self.log = path / "queue", path / "results", path / "log"
        self.index = path / "index"
        self._settled: dict[State, Path] = {state: path / "studies" / state for state in State if state != State.queued}

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the folder; `ResultsError` that says who does if another process holds it."""
        for folder in (self.queue, *self._settled.values(), self.results, self.index, self.log):
            folder.mkdir(parents=True, exist_ok=True)
            sync_folder(folder.parent)
        with ExitStack() as stack:
            try:
                stack.enter_context(LockFile(self.log / "server"))
            except LockedError as error:
                raise ResultsError(
                    f"{self.path} is served by {error.holder} already; submit to it, or stop it first"
                ) from None
            for file in [*self.queue.glob("*.unfinished-*")]:
                remove_unfinished(file.with_name(file.name.partition(".unfinished-")[0]))
            yield

    def results_path(self, name: str) -> Path:
        """The results file of a job; `ResultsError` if a link or a pipe has its name: it may lead anywhere."""
        path = self.results / f"{check_name(name)}.h5"
        check_regular(path)
        return path

    def index_path(self, name: str) -> Path:
        """The folder of the index of a job's results; a link or a file in its place is removed."""
        path = self.index / check_name(name)
        if path.is_symlink() or path.is_file():
            path.unlink()
        return path

    def remove_indexes_but(self, names: Iterable[str]) -> None:
        """Remove the indexes of other jobs than these, and what a kill left of unfinished ones."""
        kept = set(names)
        for entry in [*self.index.iterdir()]:
            if (
                entry.is_dir()
                and not entry.is_symlink()
                and NAME.fullmatch(entry.name.partition(".unfinished-")[0])
                and entry.name not in kept
            ):
                shutil.rmtree(entry)

    def log_path(self, name: str) -> Path:
        """The log of a job."""
        return self.log / f"{check_name(name)}.jsonl"

    def output_path(self, name: str) -> Path:
        """The file with the stderr of a sweep's process."""
        return self.log / f"{check_name(name)}.stderr.txt"

    def study_path(self, name: str, state: State) -> Path:
        """The study of a job that waits no more."""
        return self._settled[state] / f"{check_name(name)}.toml"

    def queued_path(self, name: str, priority: int, number: int) -> Path:
        """The study of a job that waits."""
        return self.queue / f"{priority}-{number:06}-{check_name(name)}.toml"

    def queued(self) -> list[tuple[str, int, int]]:
        """Name, priority and number of each job that waits, the first one first; other files are left alone."""
        found = [match for file in self.queue.iterdir() if is_regular(file) and (match := _QUEUED.fullmatch(file.name))]
        jobs = ((match[3], int(match[1]), int(match[2])) for match in found if match[3] != _OWN_NAME)
        return sorted(jobs, key=lambda entry: entry[1:])

    def settled(self, state: State) -> list[str]:
        """Names of the jobs of a state, in alphabetical order."""
        files = [file.name for file in self._settled[state].iterdir() if is_regular(file)]
        found = {match[1] for name in files if (match := _SETTLED.fullmatch(name))}
        return sorted(found - {_OWN_NAME})

    def without_path(self, text: str) -> str:
        """A text for clients: its files named from this folder on, which may lie anywhere on the server."""
        return text.replace(f"{self.path}/", "")

    def delete(self, name: str, study: Path) -> None:
        """Remove a job: its results first, its study next, so that a kill between the two leaves a job to delete."""
        results = f"{check_name(name)}.h5"
        for file in [*self.results.glob(f"{results}*")]:
            if file.name == results or file.name.startswith(f"{results}."):
                file.unlink(missing_ok=True)
        sync_folder(self.results)
        if self.index_path(name).is_dir():
            shutil.rmtree(self.index_path(name))
        study.unlink(missing_ok=True)
        sync_folder(study.parent)
        for file in (self.log_path(name), self.output_path(name)):
            file.unlink(missing_ok=True)


def is_regular(path: Path) -> bool:
    """Whether a path is a regular file, and not a link to one, which may lie anywhere."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False


def own_file(path: Path) -> Path:
    """A file that the service alone writes: a link or a pipe in its place is removed, never followed."""
    if os.path.lexists(path) and not is_regular(path):
        path.unlink()
    return path


def read_regular(path: Path) -> bytes:
    """The content of a regular file; `ResultsError` if the path is a link or a pipe."""
    with os.fdopen(open_regular(path, os.O_RDONLY), "rb") as file:
        return file.read()


def write_new(path: Path, content: bytes) -> None:
    """Write a new file durably; `ResultsError` if the name is taken."""
    with new_file(path, len(content), replace=False) as unfinished, unfinished.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def move(source: Path, target: Path) -> None:
    """Rename a file durably, in one step that a kill cannot halve; the target must be free."""
    source.rename(target)
    sync_folder(target.parent)
    sync_folder(source.parent)
