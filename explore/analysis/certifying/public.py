"""Certify designs of results."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from explore.analysis.certifying.certifiers import Certifiers, find_certifiers
from explore.base.errors import RequestError
from explore.model.progress import ReportProgress
from explore.model.request import Objective
from explore.results.ranking.objectives import choose_objectives
from explore.results.ranking.rankings import rankable_names
from explore.results.store.open_results import results_of
from explore.results.store.results import Results
from explore.running.chosen import chosen_designs, request_of

if TYPE_CHECKING:
    import pandas as pd
    from distributed import Client


def certify(
    results: Results | Path | str,
    designs: Sequence[int] | int | None = None,
    *,
    client: Client | None = None,
    workers: int | None = None,
    report_progress: ReportProgress | None = None,
) -> pd.DataFrame:
    """Prove what results say of designs, in ball arithmetic, where all rounding is enclosed.

    Each number of a design is checked against an enclosure and the error bound of its row; class and status by exact
    signs; and that each constraint holds strictly. Of the Pareto set also that no design dominates another.

    Parameters
    ----------
    results
        Results, or the path of their file.
    designs
        Numbers of designs; None for the Pareto set in the objectives of the study.
    client
        A dask client, on whose workers the designs are certified.
    workers
        Number of processes for what would take this one more than 10 s; None for this process alone.
    report_progress
        Called with the designs done and all designs.

    Returns
    -------
    DataFrame
        One row for each design, under its number: ``verdict`` is "proved", "open" where something is not proved, or
        "refuted" where something is false; ``reason`` says what; ``bits`` is the precision that was needed. For each
        metric, ``<metric>_lower`` and ``<metric>_upper`` are the doubles next to its enclosure. ``attrs["units"]`` has
        the units.

    Raises
    ------
    RequestError
        If python-flint is not installed, the mechanism has no certificates, or no design is feasible and none is
        named, or the Pareto set is one in objectives that the study does not compute; for workers, as of `sweep`.
    ClusterError
        If the workers do not answer, differ in a version or fail.
    ResultsError
        If a design is not in the file.

    Notes
    -----
    The lengths are exact doubles, the links are rigid, and the joints have no play. A precision that does not decide a
    sign is doubled, up to 1024 bits.
    """
    return certify_on(find_certifiers(client, workers), results, designs, report_progress)


def certify_on(
    certifiers: Certifiers | None,
    results: Results | Path | str,
    designs: Sequence[int] | int | None,
    report_progress: ReportProgress | None,
) -> pd.DataFrame:
    """As `certify`, on the given workers."""
    if find_spec("flint") is None:
        raise RequestError('certificates need python-flint: pip install "linkage-explore[certify]"')
    import pandas as pd

    from explore.analysis.certifying.certificate import require_table
    from explore.analysis.certifying.certification import certify_designs

    source = results_of(results).declared
    request = request_of(source)
    require_table(request.mechanism)  # before anything is read
    frame = chosen_designs(source, designs)
    objectives: tuple[Objective, ...] = ()
    if designs is None:
        objectives, _ = choose_objectives(None, None, source.senses, rankable_names(source), source.objectives)
        _require_computed(source, objectives)
    names = [str(name) for name in frame]
    rows = {
        int(number): dict(zip(names, map(float, values), strict=True))
        for number, values in zip(frame.index, frame.itertuples(index=False), strict=True)
    }
    proofs = certify_designs(
        request,
        rows,
        objectives,
        is_front=designs is None,
        certifiers=certifiers,
        report_progress=report_progress,
    )
    metrics = [column.name for column in source.columns if column.role == "metric" and not column.labels]
    records = []
    for proof, design in proofs.values():
        record: dict[str, object] = {"verdict": proof.verdict, "reason": proof.reason, "bits": design.bits}
        for name in metrics:
            record[f"{name}_lower"], record[f"{name}_upper"] = proof.intervals.get(name, (float("nan"),) * 2)
        records.append(record)
    certified = pd.DataFrame(records, index=pd.Index(list(proofs), name="design"))
    certified.attrs["units"] = {f"{name}_{side}": source.units[name] for name in metrics for side in ("lower", "upper")}
    return certified


def _require_computed(source: Results, objectives: Sequence[Objective]) -> None:
    """Refuse a Pareto set in objectives such as the error that the solver of a task measures: no enclosure is known."""
    request = request_of(source)
    computed = {metric.name for metric in request.all_metrics} | {p.name for p in request.mechanism.parameters}
    missing = [each.metric for each in objectives if each.metric.removesuffix("_margin") not in computed]
    if missing:
        raise RequestError(
            f"the study of {source.path} does not compute {' and '.join(missing)}, so nothing proves that no design "
            "dominates another; name `designs`"
        )
