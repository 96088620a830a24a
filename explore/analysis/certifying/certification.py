"""Certify designs of results: each row, and that no design of a Pareto set dominates another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from explore.analysis.certifying.designs import Design
from explore.analysis.certifying.fronts import find_dominance
from explore.analysis.certifying.registry import find_certificate
from explore.analysis.certifying.rows import Proof, certify_row
from explore.model.progress import ReportProgress
from explore.model.request import Objective, Request


def certify_designs(
    request: Request,
    rows: Mapping[int, Mapping[str, float]],
    objectives: Sequence[Objective],
    *,
    is_front: bool,
    report_progress: ReportProgress | None = None,
) -> dict[int, tuple[Proof, Design]]:
    """Certify designs, the columns of each by its number, by what the study computes.

    If they are said to be Pareto-optimal in the objectives, one that is dominated is refuted. `report_progress` is
    called after each with the designs done and all designs.
    """
    make, proofs = find_certificate(request.mechanism.name), {}
    for done, (number, row) in enumerate(rows.items(), 1):
        parameters = {
            p.name: float(row[p.name]) if p.name in row else float("nan" if p.default is None else p.default)
            for p in request.mechanism.parameters
        }
        design = Design(make, parameters, request)
        proofs[number] = certify_row(design, row), design
        if report_progress is not None:
            report_progress(done, len(rows))
    if is_front:
        _compare(proofs, objectives)
    return proofs


def _compare(proofs: Mapping[int, tuple[Proof, Design]], objectives: Sequence[Objective]) -> None:
    """Note the designs that others dominate, or perhaps dominate."""
    numbers = [number for number, (_, design) in proofs.items() if design.is_usable]
    dominated, perhaps = dict[int, int](), dict[int, int]()
    for first, second, is_certain in find_dominance([proofs[number][1] for number in numbers], objectives):
        (dominated if is_certain else perhaps).setdefault(numbers[first], numbers[second])
    for number, other in dominated.items():
        proofs[number][0].refuted.append(f"design {other} dominates it")
    for number, other in perhaps.items():
        proofs[number][0].open.append(f"whether design {other} dominates it")
