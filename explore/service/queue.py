"""The jobs of a service: what is waiting, running and settled, and what may be done to each."""

import threading
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from explore.base.errors import RequestError
from explore.service.folder import Folder, State, check_name, move, read_regular, write_new
from explore.service.job_files import JobFile, Kind, Refinement, read_job_file
from explore.service.jobs import PROGRESS, Job, append_event, now, read_events
from explore.service.plans import Limits, Plan, check_limits, make_plan

#: Function that is told the name and the job after each change; None for a job that was deleted.
Listener = Callable[[str, Job | None], None]
#: Function that makes the plan of a job from its file, which designs to keep, and the folder of results to refine.
MakePlan = Callable[[JobFile, str, Path], Plan]
#: States whose folders are read at the start, in this order; a name that stands in several counts once.
_ORDER = (State.running, State.queued, State.failed, State.cancelled, State.done)


class UnknownJobError(RequestError):
    """There is no job of that name."""


class StateError(RequestError):
    """The job is in a state, or the service is, in which this cannot be done."""


class Jobs:
    """The jobs of a locked folder; safe to use from several threads.

    Every change is durable before its method returns: first the log of the job, then the place of its study. The
    listener is told every change in order; `plan_refinement` makes the plan of a refinement as `make_plan` does, but
    ranks results.
    """

    def __init__(
        self,
        folder: Folder,
        limits: Limits,
        listener: Listener,
        plan_refinement: MakePlan = make_plan,
    ) -> None:
        self._folder, self._limits, self._listener = folder, limits, listener
        self._plan_refinement = plan_refinement
        self._jobs: dict[str, Job] = {}
        self._active = ""
        self._changed = threading.Condition(threading.RLock())
        for state in _ORDER:
            named = folder.queued() if state == State.queued else [(name, 5, 0) for name in folder.settled(state)]
            for name, priority, number in named:
                self._jobs.setdefault(name, self._read(Job(name, state, priority, number)))

    def in_order(self) -> list[Job]:
        """All jobs: the running one, those that wait in their order, then the others, the last to end first."""
        with self._changed:
            jobs = list(self._jobs.values())
        waiting = sorted((job for job in jobs if job.state == State.queued), key=_order)
        running = [job for job in jobs if job.state == State.running]
        settled = [job for job in jobs if job.state not in (State.queued, State.running)]
        # A log without numbers has times, which come first.
        settled.sort(key=lambda job: (job.ended_number, job.ended or ""), reverse=True)
        return [*running, *waiting, *settled]

    def get(self, name: str) -> Job:
        """The job of a name; `UnknownJobError` if there is none."""
        check_name(name)
        with self._changed:
            if name not in self._jobs:
                raise UnknownJobError(f"there is no job {name}")
            return self._jobs[name]

    def study(self, name: str) -> bytes:
        """The file of a job as it was submitted."""
        with self._changed:
            try:
                return read_regular(self._place(self.get(name)))
            except FileNotFoundError:
                raise StateError(f"the study of {name} was removed from the folder") from None

    def plan(self, name: str, content: bytes, *, kind: Kind = Kind.study, keep: str = "all") -> Plan:
        """What a job would make; raises as `submit` does, but a name may be taken."""
        check_name(name)
        return self._plan(read_job_file(name, content, kind), keep)

    def submit(
        self,
        name: str,
        content: bytes,
        *,
        kind: Kind = Kind.study,
        keep: str = "all",
        priority: int = 5,
        owner: str = "",
    ) -> Job:
        """Queue a study, a task or a refinement.

        Raises `ConfigError` with every problem of the file; `RequestError` if the name, `keep` or `priority` is
        invalid, the refinement is not possible, or the limits are exceeded; `StateError` if the name is taken, the
        queue is full, or the job to refine is not done.
        """
        check_name(name)
        _check_priority(priority)
        if keep not in ("all", "front"):
            raise RequestError(f"keep = {keep!r:.40}: write all or front")
        job_file = read_job_file(name, content, kind)
        plan = self._plan(job_file, keep)
        facts: dict[str, Any] = {
            "kind": kind,
            "refine": job_file.refine if isinstance(job_file, Refinement) else "",
            "keep": keep,
            "owner": owner,
            "mechanism": plan.mechanism,
            "remarks": plan.remarks,
            "designs": plan.designs or 0,
            "bytes": plan.bytes,
        }
        with self._changed:
            if name in self._jobs:
                names = (f"{name[:60]}-{number}" for number in range(2, len(self._jobs) + 3))
                free = next(other for other in names if other not in self._jobs)
                raise StateError(
                    f"there is a job {name} already ({self._jobs[name].state}); choose another name, such as "
                    f"{free}, or delete it first"
                )
            waiting = sum(job.state == State.queued for job in self._jobs.values())
            if waiting >= self._limits.queue:
                raise StateError(f"{waiting:,} jobs wait already, which is this server's limit; try again later")
            self._require_done(facts["refine"])  # again, because it may have been deleted meanwhile
            job = Job(name, State.queued, priority, self._next_number(), **facts, submitted=now())
            self._folder.log_path(name).unlink(missing_ok=True)  # of a submission that a kill cut short
            self._log(job, "queued", **facts, submitted=job.submitted)
            write_new(self._place(job), content)
            return self._set(job)

    def cancel(self, name: str) -> Job:
        """Cancel a job that waits or runs; what a sweep has computed stays, and `retry` goes on from there."""
        with self._changed:
            job = self.get(name)
            if job.state not in (State.queued, State.running):
                raise StateError(f"{name} is {job.state}; only a job that is queued or running can be cancelled")
            return self._settle(job, State.cancelled)

    def retry(self, name: str) -> Job:
        """Queue a job again that failed or was cancelled; its sweep goes on where it ended."""
        with self._changed:
            job = self.get(name)
            if job.state not in (State.failed, State.cancelled):
                raise StateError(f"{name} is {job.state}; only a job that is failed or cancelled can be retried")
            facts: dict[str, Any] = {"submitted": now(), "started": None, "ended": None, "reason": ""}
            queued = replace(job, state=State.queued, number=self._next_number(), **facts)
            self._log(job, "queued", **facts)
            return self._move(job, queued)

    def prioritise(self, name: str, priority: int) -> Job:
        """Give a job that waits another priority, 1 for the first and 9 for the last."""
        _check_priority(priority)
        with self._changed:
            job = self.get(name)
            if job.state != State.queued:
                raise StateError(f"{name} is {job.state}; only a job that is queued has a priority")
            return job if priority == job.priority else self._move(job, replace(job, priority=priority))

    def delete(self, name: str) -> None:
        """Remove a job that does not run, with its results."""
        with self._changed:
            job = self.get(name)
            if job.state == State.running or name == self._active:
                raise StateError(
                    f"{name} is {job.state if job.state == State.running else 'still ending'}; "
                    "cancel it, wait until its sweep has ended, and delete it then"
                )
            needed = (State.queued, State.running)
            if starts := [
                other.name for other in self._jobs.values() if other.refine == name and other.state in needed
            ]:
                raise StateError(f"{starts[0]} refines the results of {name}; cancel it, or wait until it is done")
            self._folder.delete(name, self._place(job))
            del self._jobs[name]
            self._listener(name, None)
            self._changed.notify_all()

    # --- for the runner -----------------------------------------------------------------------------------------------

    def take(self) -> Job | None:
        """The job to sweep now: the one that was under way when the service ended, else the first that waits."""
        with self._changed:
            running = [job for job in self._jobs.values() if job.state == State.running]
            waiting = [job for job in self._jobs.values() if job.state == State.queued]
            if not running and not waiting:
                return None
            job = running[0] if running else min(waiting, key=_order)
            facts: dict[str, Any] = {"started": now(), "ended": None, "reason": "", "computed": 0, "seconds": 0.0}
            facts |= {"steps_done": 0, "steps": 0}
            self._active = job.name
            self._log(job, "running", started=facts["started"], ended=None, reason="")
            if running:
                return self._set(replace(job, **facts))
            return self._move(job, replace(job, state=State.running, **facts))

    def report(self, name: str, **facts: Any) -> None:
        """Note progress or a reason of a running job, which is not logged."""
        with self._changed:
            job = self.get(name)
            if job.state == State.running:
                self._set(job.after(facts))

    def settle(self, name: str, state: State, reason: str = "") -> None:
        """Note how a sweep ended, unless the job was cancelled meanwhile."""
        with self._changed:
            job = self.get(name)
            if job.state == State.running:
                self._settle(job, state, reason)

    def release(self) -> None:
        """Note that no process works on a job any more."""
        with self._changed:
            self._active = ""

    def wait(self, seconds: float) -> None:
        """Wait until there is a job to sweep, at most so long."""
        with self._changed:
            if all(job.state not in (State.queued, State.running) for job in self._jobs.values()):
                self._changed.wait(seconds)

    def wake(self) -> None:
        """End all waits."""
        with self._changed:
            self._changed.notify_all()

    # --- helpers ------------------------------------------------------------------------------------------------------

    def _plan(self, job_file: JobFile, keep: str) -> Plan:
        make: MakePlan = make_plan
        if isinstance(job_file, Refinement):
            self._require_done(job_file.refine)
            make = self._plan_refinement
        plan = make(job_file, keep, self._folder.results)
        check_limits(plan, self._limits, self._folder.results)
        return plan

    def _require_done(self, refine: str) -> None:
        """Refuse to refine the results of a job that is not done; no name asks for none."""
        if refine and (job := self.get(refine)).state != State.done:
            raise StateError(f"{refine} is {job.state}; its results can be refined when it is done")

    # --- helpers; the caller holds the lock ---------------------------------------------------------------------------

    def _read(self, job: Job) -> Job:
        for event in read_events(self._folder.log_path(job.name)):
            job = job.after(event)
        return job

    def _place(self, job: Job) -> Path:
        if job.state == State.queued:
            return self._folder.queued_path(job.name, job.priority, job.number)
        return self._folder.study_path(job.name, job.state)

    def _next_number(self) -> int:
        return 1 + max((job.number for job in self._jobs.values()), default=0)

    def _log(self, job: Job, event: str, **facts: Any) -> None:
        append_event(self._folder.log_path(job.name), event, facts)

    def _settle(self, job: Job, state: State, reason: str = "") -> Job:
        number = 1 + max(other.ended_number for other in self._jobs.values())
        settled = replace(job, state=state, ended=now(), ended_number=number, reason=reason)
        progress = {name: value for name, value in asdict(job).items() if name in (*PROGRESS, "designs")}
        self._log(job, state, ended=settled.ended, ended_number=number, reason=reason, **progress)
        return self._move(job, settled)

    def _move(self, job: Job, target: Job) -> Job:
        try:
            move(self._place(job), self._place(target))
        except FileNotFoundError:
            del self._jobs[job.name]
            self._listener(job.name, None)
            raise UnknownJobError(f"the study of {job.name} was removed from the folder, and the job with it") from None
        return self._set(target)

    def _set(self, job: Job) -> Job:
        self._jobs[job.name] = job
        self._listener(job.name, job)
        self._changed.notify_all()
        return job


def _order(job: Job) -> tuple[int, int]:
    """Key by which names of queued files are sorted."""
    return job.priority, job.number


def _check_priority(priority: int) -> None:
    if priority not in range(1, 10):
        raise RequestError(f"priority = {priority}: write 1 for the first to 9 for the last")
