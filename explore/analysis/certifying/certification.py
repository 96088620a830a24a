"""Certify designs in this process and, where many are left, on workers: Python runs ball arithmetic on one thread."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from explore.analysis.certifying.certifiers import Certifiers
from explore.analysis.certifying.designs import Design
from explore.analysis.certifying.dominance import compare, interval_of
from explore.analysis.certifying.rows import Proof, certify_row
from explore.base.errors import ClusterError
from explore.model.progress import ReportProgress
from explore.model.request import Objective, Request
from explore.running.blocks import environment_of
from explore.running.clusters import check_environment
from explore.running.tasks import run_tasks

#: Least time left for which other processes are started, s.
_WORTH = 10.0
#: Time that a task of a worker should take, s.
_TASK_TIME = 1.0
#: Largest number of designs of a task.
_TASK_SIZE = 64
#: Number of tasks if the time of a design is not known and none is full.
_TASKS = 64

Rows = Mapping[int, Mapping[str, float]]


def certify_designs(
    request: Request,
    rows: Rows,
    objectives: Sequence[Objective],
    *,
    is_front: bool,
    certifiers: Certifiers | None = None,
    report_progress: ReportProgress | None = None,
) -> dict[int, tuple[Proof, Design]]:
    """Certify designs, the columns of each by its number, by what the study computes.

    If they are said to be Pareto-optimal in the objectives, one that is dominated is refuted. `report_progress` is
    called with the designs done and all designs.
    """
    run = _Run(request, rows, tuple(objectives) if is_front else (), report_progress)
    left = run.certify_here(certifiers.patience if certifiers else math.inf)
    if certifiers and left:
        run.certify_there(certifiers, left)
    proofs = {number: (run.proofs[number], design) for number, design in run.designs.items()}
    if is_front:
        compare(proofs, objectives)
    return proofs


@dataclass(frozen=True)
class _Certified:
    """The proof of a design, the bits that it needed, and the intervals of the objectives."""

    proof: Proof
    bits: int
    intervals: dict[Objective, tuple[float, float]]


class _Run:
    """The designs and the proofs found so far."""

    def __init__(
        self, request: Request, rows: Rows, objectives: tuple[Objective, ...], report_progress: ReportProgress | None
    ) -> None:
        self._request, self._rows, self._objectives = request, rows, objectives
        self._report_progress = report_progress
        self._seconds_per_design = 0.0
        self.designs = {number: Design.of_row(row, request) for number, row in rows.items()}
        self.proofs: dict[int, Proof] = {}

    def certify_here(self, seconds: float) -> list[int]:
        """Certify designs in this process; return the numbers of those left after so much time, if they take long."""
        start = time.perf_counter()
        numbers = list(self.designs)
        for done, number in enumerate(numbers):
            passed = time.perf_counter() - start
            if passed >= seconds:
                self._seconds_per_design = passed / max(done, 1)
                if done == 0 or self._seconds_per_design * (len(numbers) - done) >= _WORTH:
                    return numbers[done:]
            self.proofs[number] = certify_row(self.designs[number], self._rows[number])
            self._report()
        return []

    def certify_there(self, certifiers: Certifiers, left: list[int]) -> None:
        """Certify the designs of these numbers on workers."""
        mean = self._seconds_per_design
        size = min(_TASK_SIZE, max(1, int(_TASK_TIME / mean) if mean else len(left) // _TASKS))
        parts = [left[first : first + size] for first in range(0, len(left), size)]
        mechanism = self._request.mechanism.name

        def accept(part: int, result: tuple[Mapping[str, str], list[_Certified]]) -> None:
            environment, found = result
            check_environment(environment, f"that certified design {parts[part][0]}", mechanism)
            for number, certified in zip(parts[part], found, strict=True):
                self.proofs[number] = certified.proof
                self.designs[number].bits = certified.bits
                self.designs[number].intervals = certified.intervals
            self._report()

        def reject(part: int, problem: str) -> None:
            raise ClusterError(f"a worker failed to certify the designs from {parts[part][0]} on: {problem}")

        with certifiers.connect(mechanism, len(parts)) as workers:
            run_tasks(
                workers,
                _certify_part,
                lambda part: (self._request, [self._rows[number] for number in parts[part]], self._objectives),
                range(len(parts)),
                accept,
                reject,
            )
        if len(self.proofs) < len(self.designs):
            raise ClusterError("some designs never came back from the workers; run the command again")

    def _report(self) -> None:
        if self._report_progress is not None:
            self._report_progress(len(self.proofs), len(self.designs))


def _certify_part(
    request: Request, rows: Sequence[Mapping[str, float]], objectives: Sequence[Objective]
) -> tuple[Mapping[str, str], list[_Certified]]:
    """The environment of this worker, and what is certified of each row."""
    found = []
    for row in rows:
        design = Design.of_row(row, request)
        proof = certify_row(design, row)
        intervals = {each: interval_of(design, each) for each in objectives} if design.is_usable else {}
        found.append(_Certified(proof, design.bits, intervals))
    return environment_of(request.mechanism.name), found
