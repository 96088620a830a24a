"""Compute designs: all of a study, several, or the motion of one."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack, get_args, overload

import numpy as np
import numpy.typing as npt

from explore.base.counts import check_count
from explore.base.errors import FailedBlocksWarning, NothingFeasibleWarning, RequestError
from explore.base.suggest import format_value
from explore.evaluation.derived import unavailable_metrics
from explore.evaluation.evaluate import (
    evaluate_columns,
    output_columns,
)
from explore.evaluation.remembering import remembered
from explore.mechanisms.registry import MECHANISMS
from explore.model.columns import Arrays
from explore.model.progress import ReportProgress
from explore.model.request import Request
from explore.results.ranking.rankings import RankRequest, rank_source, rankable_names
from explore.results.ranking.reasons import warning_of_nothing
from explore.results.store.open_results import open_results
from explore.results.store.results import Results
from explore.running.motions import motion_interval, motion_signals, whole_motion_angles
from explore.running.runs import Keep, run_study
from explore.running.workers import find_workers, report_counts
from explore.studies.config.study import Study
from explore.studies.request.names import find_mechanism
from explore.studies.request.parameters import parameter_columns, point_parameters
from explore.studies.request.requests import make_objective, make_request
from explore.studies.request.targets import TargetOrSection

if TYPE_CHECKING:
    import pandas as pd
    from distributed import Client

    from explore.studies.config.linkage import Linkage


def list_mechanisms() -> dict[str, str]:
    """Give the summary of each mechanism by its name; `explore mechanisms NAME` describes one in full."""
    mechanisms, problems = MECHANISMS.load_all()
    for problem in problems:
        warnings.warn(problem, RuntimeWarning, stacklevel=2)
    return {name: mechanism.summary for name, mechanism in mechanisms.items()}


def sweep(
    study: Study,
    path: Path | str,
    *,
    client: Client | None = None,
    workers: int | None = None,
    processes: bool = False,
    keep: Keep = "all",
    max_failures: int | None = None,
    restart: bool = False,
    report_progress: ReportProgress | None = None,
) -> Results:
    """Compute every pending block of a study into a results file.

    Parameters
    ----------
    study
        Built in Python or read with `load_study`.
    path
        The results file; an unfinished one of the same study is continued.
    client
        Any synchronous dask.distributed Client; None starts threads in this process.
    workers
        Number of threads or processes; None for one per processor.
    processes
        Start processes on this machine instead of threads.
    keep
        "all" designs, or only the "front": the Pareto set of the study's objectives.
    max_failures
        Stop after more failed blocks than this; None for no limit.
    restart
        Rename an existing file and start over.
    report_progress
        Called after each commit with the number of committed designs and of all designs.

    Returns
    -------
    Results
        The results in the file. Failed blocks are left out, with a `FailedBlocksWarning` that has the reason of each;
        a `NothingFeasibleWarning` says why where no design is feasible.

    Raises
    ------
    ResultsError
        If the file cannot be created, belongs to another study, or is being written by another process; or if blocks
        failed with ``keep="front"``, because the front is written only when all blocks are computed.
    ClusterError
        If the cluster is lost, runs other versions of the packages, or too many blocks failed.
    """
    if keep not in get_args(Keep):
        raise RequestError(f"keep = {keep!r}: must be {' or '.join(get_args(Keep))}")
    if max_failures is not None:
        check_count("max_failures", max_failures, 0, ", or None for no limit")
    if not isinstance(study, Study):
        raise RequestError(f"study: must be a Study, such as load_study reads, got {format_value(study)}")
    cluster = find_workers(study.request, client, workers, processes=processes)
    report = report_counts(report_progress)
    summary = run_study(study, path, cluster, keep=keep, max_failures=max_failures, restart=restart, progress=report)
    if summary.failures:
        warnings.warn(FailedBlocksWarning(summary.failures), stacklevel=2)
    results = open_results(path)
    if summary.n_computed and not summary.n_feasible and not summary.n_resumed:
        any_order = None if results.objectives else f"{rankable_names(results)[0]}:min"
        ranking = rank_source(results, RankRequest(any_order))
        if reason := warning_of_nothing(ranking, path, results.status_sentences):
            warnings.warn(reason, NothingFeasibleWarning, stacklevel=2)
    return results


class _Question(TypedDict, total=False):
    """What `evaluate` computes."""

    metrics: Sequence[str] | str | None
    window: str | Mapping[str, float | str] | None
    drive: str | None
    constraints: Mapping[str, Mapping[str, float | str]] | None
    tolerance: float
    formulas: Mapping[str, Mapping[str, str]] | None
    points: Sequence[str] | str
    target: TargetOrSection | None


@overload
def evaluate(
    mechanism: str | Linkage,
    designs: Mapping[str, npt.ArrayLike] | pd.DataFrame,
    *,
    table: Literal[True] = True,
    **question: Unpack[_Question],
) -> pd.DataFrame: ...


@overload
def evaluate(
    mechanism: str | Linkage,
    designs: Mapping[str, npt.ArrayLike] | pd.DataFrame,
    *,
    table: Literal[False],
    **question: Unpack[_Question],
) -> Arrays: ...


def evaluate(
    mechanism: str | Linkage,
    designs: Mapping[str, npt.ArrayLike] | pd.DataFrame,
    *,
    metrics: Sequence[str] | str | None = None,
    window: str | Mapping[str, float | str] | None = None,
    drive: str | None = None,
    constraints: Mapping[str, Mapping[str, float | str]] | None = None,
    tolerance: float = 1e-9,
    formulas: Mapping[str, Mapping[str, str]] | None = None,
    points: Sequence[str] | str = (),
    target: TargetOrSection | None = None,
    table: bool = True,
) -> pd.DataFrame | Arrays:
    """Evaluate designs, each with as few samples of its motion as the tolerance allows.

    Parameters
    ----------
    mechanism
        Name, as listed by `list_mechanisms`, or a `Linkage`.
    designs
        Parameters by name: columns of a table, or numbers and arrays that broadcast, in declared units. A string has a
        unit, such as ``"40 rpm"``.
    metrics
        Names of metrics; None for the mechanism's default list.
    window
        Part of the turn the statistics run over: a name, or ``{"from": 0, "to": 90}`` in degrees or with units.
    drive
        The stroke that the window "drive" means: "slow", "fast", or a stroke by name.
    constraints
        Bounds by metric, such as ``{"transmission_angle_min": {"min": 30}}``, or ``"30 deg"``.
    tolerance
        Bound on the error of every sampled statistic, relative: of a mean to the rms, of a variance to the square of
        the rms, of an extreme to the largest magnitude, of a cv to itself. Column ``error`` is the bound reached.
    formulas
        Metrics of your own by name, such as ``{"reach": {"formula": "coupler + ground", "unit": "mm"}}``: arithmetic
        with parameters, metrics and each other. Each is a column.
    points
        Names of points of the floating link. The parameters ``knife_along`` and ``knife_across`` (mm) of a point
        "knife" are where it is: along the link from the crank's pin, and across it counter-clockwise.
    target
        What the linkage is to do, as for `Study`, such as ``{"kind": "path", "points": [[0, 0], [10, 5], [20, 0]]}``.
    table
        Whether to return a table; False for arrays, which take less time where a solver asks for one design at a time.

    Returns
    -------
    DataFrame, or dict of arrays
        One row for each design: parameters, metrics, margins, nodes, error, feasible (bool), status (int8).
        ``attrs["units"]`` has the unit of each column, ``attrs["labels"]`` the words for the codes of ``status`` and
        other columns, ``attrs["kinematic_evaluations"]`` the number of geometries sampled; ``attrs`` also "senses",
        "objectives" and "constraints" for `rank`.

    Raises
    ------
    RequestError
        If a name, a window, a bound or the shape of the designs is invalid. A design that cannot be computed raises no
        error: its ``status`` is the code of the reason.
    """
    declared = find_mechanism(mechanism, [points] if isinstance(points, str) else points, target)
    request = make_request(
        declared, metrics=metrics, window=window, drive=drive, constraints=constraints, tolerance=tolerance,
        formulas=formulas,
    )  # fmt: skip
    columns = parameter_columns(declared, designs)
    defaults = {parameter.name: parameter.default for parameter in declared.parameters}
    unavailable = unavailable_metrics(request, lambda name: name in columns or bool(defaults[name]))
    if unavailable:
        raise RequestError("\n".join(reason for _, reason in unavailable))
    evaluation = evaluate_columns(request, columns)
    computed = {**evaluation.columns, "feasible": evaluation.columns["feasible"].astype(bool)}
    if not table:
        return computed
    import pandas as pd

    frame = pd.DataFrame(computed, index=designs.index if isinstance(designs, pd.DataFrame) else None)
    frame.attrs.update(deepcopy(_attributes(request, tuple(computed))))
    frame.attrs["kinematic_evaluations"] = evaluation.kinematic_evaluations
    return frame


@remembered
def _attributes(request: Request, names: tuple[str, ...]) -> dict[str, object]:
    """Attributes of the table of a request with columns of these names."""
    shown = [column for column in output_columns(request, names) if column.name in names]
    # As in a study without objectives: those of the mechanism that are computed.
    texts = [text for text in request.mechanism.objectives if text.partition(":")[0] in names]
    objectives = [make_objective(request, text) for text in texts]
    return {
        "units": {column.name: column.unit for column in shown},
        "labels": {column.name: dict(column.labels) for column in shown if column.labels},
        "senses": {metric.name: metric.sense for metric in request.metrics},
        "objectives": [f"{objective.metric}:{objective.sense}" for objective in objectives],
        "constraints": {c.metric.name: {"min": c.minimum, "max": c.maximum} for c in request.constraints},
    }


def simulate(
    mechanism: str | Linkage,
    parameters: Mapping[str, float | str],
    *,
    points: Mapping[str, Sequence[float | str]] | None = None,
    target: TargetOrSection | None = None,
    angles: int | Sequence[float] | npt.NDArray[np.float64] = 360,
    method: str = "closed-form",
    tolerance: float = 1e-9,
) -> pd.DataFrame:
    """Simulate one design: all signals of its motion at angles of its input link, the crank.

    Parameters
    ----------
    mechanism
        Name, as listed by `list_mechanisms`, or a `Linkage`.
    parameters
        Parameters of the design by name, in declared units or as strings with a unit. Forces follow from the load
        parameters and are 0 without.
    points
        Points of the floating link by name: each the places along it from the crank's pin and across it
        counter-clockwise, such as ``{"knife": (120, 40)}``, mm or strings with a unit.
    target
        The target of the design's study: it adds the parameters of the pose, which do not change the signals.
    angles
        Input angles in degrees, or the number of evenly spaced ones from 0, or over the range of a crank that has one.
        A `Linkage` whose crank does not turn fully has a motion at angles from the least to the greatest of which it
        assembles.
    method
        The exact closed form, or a method to see its errors, such as "newton", "rk45" or "rk45(rtol=0.001)", for
        mechanisms and linkages whose loops are known; ``explore precision`` compares them.
    tolerance
        Bound on the errors of angles (rad), of lengths over the longest link, and of velocities and accelerations
        relative to their largest. A method that misses it for this design warns with its measured errors.

    Returns
    -------
    DataFrame
        Index ``crank_angle``, or the name of another input angle (deg); one column for each signal in its declared
        unit, NaN where the method has no solution. Forces are left out where there are none: without a load, without
        strokes, or where friction can lock the slider; by another method also all that does not follow from the
        mechanism's loops, which ``attrs["left_out"]`` names. ``attrs["units"]`` has the unit of each column,
        ``attrs["method"]`` the method with its setting.

    Raises
    ------
    MotionError
        If the design cannot make a full turn, nor move from the least to the greatest of given angles.
    RequestError
        If a name, a parameter or the angles are invalid.
    """
    import pandas as pd

    places = point_parameters(points or {})
    declared = find_mechanism(mechanism, tuple(points or {}), target)
    columns = parameter_columns(declared, {**parameters, **places})
    if len(columns[next(iter(columns))]) != 1:
        raise RequestError("simulate takes one design; evaluate takes many")
    count = int(angles) if isinstance(angles, (int, np.integer)) and not isinstance(angles, bool) else None
    try:
        input_angle = np.asarray(angles, dtype=np.float64) if count is None else whole_motion_angles(declared, count)
    except (TypeError, ValueError):
        input_angle = np.empty(0)
    if input_angle.ndim != 1 or len(input_angle) == 0 or not np.isfinite(input_angle).all():
        raise RequestError("angles must be a positive number of angles or a list of finite angles in degrees")
    interval = motion_interval(declared, columns, None if count is not None else input_angle)
    signals, label, left_out = motion_signals(declared, columns, input_angle, method, tolerance, interval)
    frame = pd.DataFrame(signals, index=pd.Index(input_angle, name=declared.input_angle.replace(" ", "_")))
    frame.attrs["units"] = {signal.name: signal.unit for signal in declared.signals if signal.name in frame}
    frame.attrs["method"], frame.attrs["left_out"] = label, left_out
    return frame
