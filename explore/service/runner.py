"""Sweep the jobs of a service one after the other, each in a process of its own."""

import json
import subprocess
import sys
import threading
from dataclasses import asdict, dataclass
from typing import Any

from explore.service.folder import Folder, State, own_file
from explore.service.job_files import Kind
from explore.service.jobs import Job
from explore.service.queue import Jobs, UnknownJobError

#: Time that an interrupted sweep has to end by itself, s; then it is killed, which the results survive.
_PATIENCE = 20.0
#: Time between two looks at an empty queue, or at a folder that could not be written, s.
_WAIT = 1.0
#: Number of kills of a sweep's process in a row without progress after which its job has failed.
_MOST_KILLS = 3


@dataclass(frozen=True)
class Work:
    """Where sweeps compute: so many threads or processes of this machine, or a dask scheduler.

    None for one thread or process for each processor.
    """

    workers: int | None = None
    scheduler: str | None = None
    processes: bool = False


class Runner(threading.Thread):
    """The thread that sweeps; the process of a sweep may take so many seconds, None for any."""

    def __init__(self, jobs: Jobs, folder: Folder, work: Work, seconds: float | None = None) -> None:
        super().__init__(name="runner", daemon=True)
        self._jobs, self._folder, self._work, self._seconds = jobs, folder, work, seconds
        self._name = ""
        self._process: subprocess.Popen[bytes] | None = None
        self._guard = threading.Lock()
        self._stopping = threading.Event()

    def run(self) -> None:
        """Sweep until `stop` is called."""
        while not self._stopping.is_set():
            try:
                job = self._jobs.take()
                if job is None:
                    self._jobs.wait(_WAIT)
                else:
                    self._run(job)
            except (OSError, UnknownJobError):
                # A folder that cannot be written, or a study that a person removed from it, must not end the service.
                self._stopping.wait(_WAIT)
            finally:
                self._jobs.release()

    def _run(self, job: Job) -> None:
        """Sweep a job until it is settled or the service stops; a sweep that is killed while it gets on goes on."""
        kills = 0
        while True:
            code, reason = self._sweep(job)
            after = self._jobs.get(job.name)
            if self._stopping.is_set() or after.state != State.running:
                return
            if code >= 0:
                break
            kills = 1 if after.done > job.done else kills + 1
            if kills == _MOST_KILLS:
                reason = f"its process was killed by signal {-code}, {kills} times without progress; is memory short?"
                break
            job = after
        self._jobs.settle(job.name, State.done if code == 0 else State.failed, reason)

    def cancel(self, name: str) -> Job:
        """Cancel a job, and interrupt its sweep."""
        try:
            job = self._jobs.cancel(name)
        except UnknownJobError:  # a person removed its study from the folder while it was swept
            self._interrupt(name)
            raise
        self._interrupt(name)
        return job

    def stop(self) -> None:
        """Interrupt the sweep under way, which goes on when the service starts again, and end the thread."""
        self._stopping.set()
        self._interrupt()
        self._jobs.wake()
        self.join()

    def _interrupt(self, name: str | None = None) -> None:
        """Interrupt the sweep of a job, or any."""
        with self._guard:
            if self._process is None or name not in (None, self._name):
                return
            self._process.terminate()
            killer = threading.Timer(_PATIENCE, self._process.kill)
            killer.daemon = True
            killer.start()

    def _sweep(self, job: Job) -> tuple[int, str]:
        """The exit code of the sweep's process, negative if a signal killed it, and what it says went wrong."""
        try:
            process = self._start(job)
        except OSError as error:
            return 1, self._folder.without_path(f"its process cannot be started: {error.strerror or error}")
        with self._guard:
            self._name, self._process = job.name, process
        if self._stopping.is_set() or self._jobs.get(job.name).state != State.running:  # since `take`
            self._interrupt()
        is_late = threading.Event()

        def give_up() -> None:
            is_late.set()
            self._interrupt(job.name)

        timer = threading.Timer(self._seconds or 0, give_up)
        if self._seconds is not None:
            timer.start()
        try:
            reason = self._follow(job.name, process)
        finally:
            timer.cancel()
            with self._guard:
                self._process = None
            process.stdin.close()  # type: ignore[union-attr]  # a pipe
            process.stdout.close()  # type: ignore[union-attr]  # likewise
            code = process.wait()
        if is_late.is_set() and code:
            goes_on = "begins again" if job.kind == Kind.task else "goes on from there"
            return 1, f"it took longer than {self._seconds:,.0f} s, this server's limit; retry {goes_on}"
        unexplained = f"its process ended with exit code {code}; {self._folder.output_path(job.name)} may say why"
        return code, self._folder.without_path(reason or (unexplained if code else ""))

    def _start(self, job: Job) -> subprocess.Popen[bytes]:
        options = json.dumps({"keep": job.keep, "work": asdict(self._work)})
        study, results = self._folder.study_path(job.name, State.running), self._folder.results_path(job.name)
        command = [sys.executable, "-m", "explore.service.sweep_process", str(study), str(results), options]
        with own_file(self._folder.output_path(job.name)).open("wb") as output:
            return subprocess.Popen(  # noqa: S603 -- our own module; names of jobs are slugs
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=output,
                start_new_session=True,  # Ctrl-C on the service's terminal is for the service alone
            )

    def _follow(self, name: str, process: subprocess.Popen[bytes]) -> str:
        """Report what the process prints until it ends; returns the last error."""
        reason = ""
        for line in process.stdout:  # type: ignore[union-attr]  # a pipe
            try:
                facts: Any = json.loads(line)
            except ValueError:  # a kill cut the line short
                continue
            if not isinstance(facts, dict):  # a library printed it
                continue
            if facts.pop("event", "") == "error":
                reason = facts["reason"]
            else:
                self._jobs.report(name, **({"reason": ""} | facts))
        return reason
