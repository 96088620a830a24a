"""What the file of a job asks for, and the limits of the service."""

import shutil
from dataclasses import dataclass
from pathlib import Path

from explore.base.errors import RequestError
from explore.running.collectors import results_columns, row_bytes
from explore.service.job_files import JobFile, Kind, Refinement
from explore.studies.config.study import Study
from explore.synthesis.tasks.task_files import TaskFile


@dataclass(frozen=True)
class Limits:
    """What the service accepts: designs and bytes of a job, jobs that wait, and seconds that a job may take.

    None for the seconds sets no limit.
    """

    designs: int = 1_000_000_000
    bytes: int = 100_000_000_000
    queue: int = 100
    seconds: float | None = None


@dataclass(frozen=True)
class Plan:
    """What a job makes, and remarks on what may not be meant in its file.

    Designs, blocks, columns and bytes are None for a task, whose designs are not known before they are found, at most
    10,000; bytes also where only the front is kept. The method is the sampling of a study, the type of a task, or
    "refinement".
    """

    kind: Kind
    mechanism: str
    designs: int | None
    blocks: int | None
    columns: int | None
    bytes: int | None
    method: str
    remarks: tuple[str, ...] = ()


def make_plan(job_file: JobFile, keep: str = "all", results: Path = Path()) -> Plan:
    """Count what a job would make; `results` is the folder of the results that a refinement starts from.

    Raises `RequestError` if the front alone is to be kept where there is none, or the refinement is not possible, and
    `ResultsError` if the results to refine cannot be read.
    """
    if isinstance(job_file, TaskFile):
        return Plan(Kind.task, job_file.task.mechanism, None, None, None, None, job_file.kind, job_file.remarks)
    if isinstance(job_file, Refinement):
        return _refinement_plan(job_file, results)
    return _study_plan(job_file, keep)


def _study_plan(study: Study, keep: str) -> Plan:
    if keep == "front" and not study.objectives:
        raise RequestError("to keep only the front, give objectives ([rank] metrics of the study)")
    n_designs = study.space.n_designs
    size = n_designs * row_bytes(study) if keep == "all" else None
    columns = len(results_columns(study))
    mechanism = study.request.mechanism.name
    return Plan(
        Kind.study, mechanism, n_designs, study.space.n_blocks, columns, size, study.space.method, study.remarks
    )


def _refinement_plan(refinement: Refinement, results: Path) -> Plan:
    plan = refinement.plan(results)
    mechanism, n_columns = plan.study.request.mechanism.name, len(plan.columns)
    size = plan.n_designs * (row_bytes(plan.study) + 8)  # and the number of the parent
    n_blocks = -(-plan.n_designs // plan.size)
    return Plan(Kind.refinement, mechanism, plan.n_designs, n_blocks, n_columns, size, "refinement")


def check_limits(plan: Plan, limits: Limits, folder: Path) -> None:
    """Raise `RequestError` that says what to change if a plan is beyond the limits or the free space."""
    advice = "evaluate fewer designs" if plan.kind == Kind.refinement else "sweep fewer values"
    if plan.designs is not None and plan.designs > limits.designs:
        raise RequestError(
            f"the {plan.kind} has {plan.designs:,} designs, but this server takes {limits.designs:,} at most; {advice}"
        )
    if plan.bytes is None:
        return
    if plan.kind == Kind.study:
        advice += " or metrics, or keep the front only"
    if plan.bytes > limits.bytes:
        raise RequestError(
            f"the results need {plan.bytes:,} bytes, but this server takes {limits.bytes:,} at most; {advice}"
        )
    free = shutil.disk_usage(folder).free
    if plan.bytes > free:
        raise RequestError(f"the results need {plan.bytes:,} bytes, but only {free:,} are free on the server; {advice}")
