"""The public functions: they resolve names, call the packages below and return tables."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np
import numpy.typing as npt

from explore.errors import FailedBlocksWarning, MotionError, RequestError
from explore.evaluation.derived import unavailable_metrics
from explore.evaluation.evaluate import (
    LARGEST_PARAMETER,
    SMALLEST_PARAMETER,
    compile_kernels,
    evaluate_columns,
    output_columns,
)
from explore.mechanisms.registry import MECHANISMS
from explore.model.columns import Arrays
from explore.model.mechanism import Mechanism
from explore.model.progress import ReportProgress
from explore.model.status import Status
from explore.motions import motion_signals
from explore.ranking.joint import RESULTS_COLUMN, rank_sources
from explore.ranking.limits import Limits
from explore.ranking.nearest import VIOLATION, find_nearest, find_nearest_rows
from explore.ranking.rankings import RankRequest, rank_frame, rank_source
from explore.request.names import find_mechanism
from explore.request.parameters import parameter_columns, read_value
from explore.request.requests import make_objective, make_request
from explore.store.open_results import open_results, open_several
from explore.store.results import Results
from explore.sweeping.clusters import existing_client, local_cluster
from explore.sweeping.runs import Keep, Progress, run_study

if TYPE_CHECKING:
    import pandas as pd
    from distributed import Client

    from explore.config.study import Study


def list_mechanisms() -> dict[str, str]:
    """Give the summary of each mechanism by its name; `explore mechanisms NAME` describes one in full."""
    mechanisms, problems = MECHANISMS.load_all()
    for problem in problems:
        warnings.warn(problem, RuntimeWarning, stacklevel=2)
    return {name: mechanism.summary for name, mechanism in mechanisms.items()}


def read_results(path: Path | str, *, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Read the committed designs of a results file as a table.

    Parameters
    ----------
    path
        The HDF5 file of a sweep, finished or not.
    columns
        Names of the columns to read; None for all.

    Returns
    -------
    DataFrame
        One row for each committed design, index ``design``; ``attrs`` as of `Results.to_pandas`.
    """
    return open_results(path).to_pandas(columns)


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
        The results in the file. Failed blocks are left out, with a `FailedBlocksWarning` that has the reason of each.

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
    if max_failures is not None and max_failures < 0:
        raise RequestError(f"max_failures = {max_failures}: must be at least 0, or None for no limit")
    if workers is not None and workers < 1:
        raise RequestError(f"workers = {workers}: must be at least 1")
    if client is not None and (workers is not None or processes):
        raise RequestError("workers and processes cannot be combined with client, which has its own workers")
    if client is None:
        compile_kernels(study.request)
    mechanism = study.request.mechanism.name
    cluster = existing_client(client, mechanism) if client is not None else local_cluster(workers, processes=processes)

    def report(progress: Progress) -> None:
        if report_progress is not None:
            report_progress(progress.n_done, progress.n_designs)

    summary = run_study(study, path, cluster, keep=keep, max_failures=max_failures, restart=restart, progress=report)
    if summary.failures:
        warnings.warn(FailedBlocksWarning(summary.failures), stacklevel=2)
    return open_results(path)


def evaluate(
    mechanism: str,
    designs: Mapping[str, npt.ArrayLike] | pd.DataFrame,
    *,
    metrics: Sequence[str] | str | None = None,
    window: str | Mapping[str, float | str] | None = None,
    drive: str | None = None,
    constraints: Mapping[str, Mapping[str, float | str]] | None = None,
    tolerance: float = 1e-9,
    formulas: Mapping[str, Mapping[str, str]] | None = None,
) -> pd.DataFrame:
    """Evaluate designs, each with as few samples of its motion as the tolerance allows.

    Parameters
    ----------
    mechanism
        Name, as listed by `list_mechanisms`.
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

    Returns
    -------
    DataFrame
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
    import pandas as pd

    declared = find_mechanism(mechanism)
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
    index = designs.index if isinstance(designs, pd.DataFrame) else None
    frame = pd.DataFrame(evaluation.columns, index=index)
    frame["feasible"] = frame["feasible"].astype(bool)
    shown = [column for column in output_columns(request, list(columns)) if column.name in frame]
    frame.attrs["units"] = {column.name: column.unit for column in shown}
    frame.attrs["labels"] = {column.name: dict(column.labels) for column in shown if column.labels}
    frame.attrs["kinematic_evaluations"] = evaluation.kinematic_evaluations
    frame.attrs["senses"] = {metric.name: metric.sense for metric in request.metrics}
    # As in a study without objectives: those of the mechanism that are computed.
    objectives = [make_objective(request, text) for text in declared.objectives if text.partition(":")[0] in frame]
    frame.attrs["objectives"] = [f"{objective.metric}:{objective.sense}" for objective in objectives]
    frame.attrs["constraints"] = {c.metric.name: {"min": c.minimum, "max": c.maximum} for c in request.constraints}
    return frame


def simulate(
    mechanism: str,
    parameters: Mapping[str, float | str],
    *,
    angles: int | Sequence[float] | npt.NDArray[np.float64] = 360,
    method: str = "closed-form",
    tolerance: float = 1e-9,
) -> pd.DataFrame:
    """Simulate one design: all signals of its motion at angles of its input link, the crank.

    Parameters
    ----------
    mechanism
        Name, as listed by `list_mechanisms`.
    parameters
        Parameters of the design by name, in declared units or as strings with a unit. Forces follow from the load
        parameters and are 0 without.
    angles
        Input angles in degrees, or the number of evenly spaced ones from 0.
    method
        The exact closed form, or a method to see its errors, such as "newton", "rk45" or "rk45(rtol=0.001)";
        ``explore precision`` compares them.
    tolerance
        Bound on the errors of angles (rad), and of velocities and accelerations relative to their largest. A method
        that misses it for this design warns with its measured errors.

    Returns
    -------
    DataFrame
        Index ``crank_angle``, or the name of another input angle (deg); one column for each signal in its declared
        unit, NaN where the method has no solution. ``attrs["units"]`` has the unit of each column, ``attrs["method"]``
        the method with its setting.

    Raises
    ------
    MotionError
        If the design cannot make a full turn.
    RequestError
        If a name, a parameter or the angles are invalid.
    """
    import pandas as pd

    declared = find_mechanism(mechanism)
    columns = parameter_columns(declared, parameters)
    request = make_request(declared, metrics=[declared.metrics[0].name], window=declared.full_turn.name)
    if len(columns[next(iter(columns))]) != 1:
        raise RequestError("simulate takes one design; evaluate takes many")
    status = int(evaluate_columns(request, columns).columns["status"][0])
    if status == Status.NOT_FINITE:
        _refuse_unusable(declared, columns)
    if status != Status.OK:
        sentence = declared.status_sentences[declared.status_labels[status]]
        raise MotionError(f"no full turn to simulate: {sentence}")
    count = int(angles) if isinstance(angles, (int, np.integer)) and not isinstance(angles, bool) else None
    input_angle: npt.NDArray[np.float64] = np.asarray(
        angles if count is None else np.arange(count) * (360.0 / max(count, 1)), dtype=np.float64
    )
    if input_angle.ndim != 1 or len(input_angle) == 0 or not np.isfinite(input_angle).all():
        raise RequestError("angles must be a positive number of angles or a list of finite angles in degrees")
    signals, label = motion_signals(declared, columns, input_angle, method, tolerance)
    frame = pd.DataFrame(signals, index=pd.Index(input_angle, name=declared.input_angle.replace(" ", "_")))
    frame.attrs["units"] = {signal.name: signal.unit for signal in declared.signals if signal.name in frame}
    frame.attrs["method"] = label
    return frame


def _refuse_unusable(mechanism: Mechanism, columns: Arrays) -> None:
    """Raise `RequestError` that names the first parameter of a design whose value is out of its range, if one is."""
    for name, column in columns.items():
        parameter, value = mechanism.parameter(name), float(column[0])
        try:
            read_value(parameter, value)
        except RequestError as error:
            raise RequestError(f"{name}: {error}") from None
        if value != 0.0 and not SMALLEST_PARAMETER < abs(value) <= LARGEST_PARAMETER:
            limits = f"{SMALLEST_PARAMETER:g} to {LARGEST_PARAMETER:g}"
            raise RequestError(f"{name}: {value:g} is outside {limits}, the magnitudes that are computed with")


def rank(
    results: Results | pd.DataFrame | Path | str | Sequence[Results | Path | str],
    *,
    objectives: Sequence[str] | str | None = None,
    order_by: str | None = None,
    fronts: int = 1,
    where: str | None = None,
    limits: Limits | None = None,
    quality: bool = False,
) -> pd.DataFrame:
    """Find the Pareto-optimal designs, best first.

    Parameters
    ----------
    results
        Results, the path of a results file, or any table. Several results or paths are ranked together; the column
        ``results`` has the results of each design.
    objectives
        Metrics or parameters, such as ``["cv", "swing_angle:max"]``; None for those of the (first) study.
    order_by
        The metric that orders the designs; None for the first objective.
    fronts
        Number of fronts to return; column ``front`` numbers them from 1.
    where
        Only designs that meet a condition on any columns, such as ``"swing_angle > 20 and not cv >= 0.5"``; see
        `explore.ranking.conditions`. Comparisons with an undefined value are false.
    limits
        Constraints narrower than those of the sweep, by metric in its unit: a number moves the bound of the
        sweep, ``{"min": 1, "max": 2}`` names the sides.
    quality
        Add columns that compare the designs of a front: ``knee``, ``crowding`` and ``hypervolume_share``; see
        `explore.ranking.quality`.

    Returns
    -------
    DataFrame
        One row for each design of the fronts, under its number, with the columns of the results and those named above.
        ``attrs["units"]`` has the unit of each column that has one in the results, ``attrs["labels"]`` the words for
        the codes of columns such as ``status``.

    Raises
    ------
    RequestError
        If a name is unknown, a condition is invalid, or a limit is wider than the constraint of the sweep.
    """
    import pandas as pd

    request = RankRequest(objectives, order_by, fronts, where, limits, quality)
    if isinstance(results, pd.DataFrame):
        ranked = rank_frame(results, request)
        units = dict.fromkeys(results, None) | results.attrs.get("units", {})
        return _with_attrs(ranked, units, results.attrs.get("labels", {}))
    is_joint = not isinstance(results, (Results, Path, str))
    sources = open_several(results if is_joint else [results])  # type: ignore[arg-type, list-item]  # checked above
    if is_joint:
        joint = rank_sources(sources, request)
        ranking, parts, caveats = joint.whole, joint.parts, joint.caveats
    else:
        ranking = rank_source(next(iter(sources.values())), request)
        parts, caveats = dict.fromkeys(sources, ranking), ()
    incomplete = "keeps only the Pareto set of its study: the best in this request may be missing"
    for text in (*(f"{name} {incomplete}" for name, part in parts.items() if part.is_incomplete), *caveats):
        warnings.warn(text, RuntimeWarning, stacklevel=2)
    columns = {column.name: column for source in reversed(sources.values()) for column in source.columns}
    units = {name: column.unit for name, column in columns.items()} | {RESULTS_COLUMN: ""}
    return _with_attrs(ranking.frame, units, {name: dict(c.labels) for name, c in columns.items() if c.labels})


def nearest(
    results: Results | pd.DataFrame | Path | str,
    count: int = 10,
    *,
    where: str | None = None,
    limits: Limits | None = None,
) -> pd.DataFrame:
    """Find the infeasible designs that are nearest to feasible, the nearest first.

    Parameters
    ----------
    results
        Results, the path of a results file, or a table of `evaluate` with constraints.
    count
        Number of designs.
    where
        Only designs that meet a condition, as of `rank`.
    limits
        Constraints narrower than those of the sweep, as of `rank`.

    Returns
    -------
    DataFrame
        The designs with all columns and ``violation``, the sum over the constraints of the distance to the allowed
        range, each divided by the distance between the quartiles of its margin among all designs. A margin is NaN where
        a design was screened before the metric was sampled; its violation is then at least the one given. Designs
        without a motion are left out. ``attrs["scales"]`` has the divisors, ``attrs["combinations"]`` the number of
        designs by the constraints that they miss, ``attrs["units"]`` and ``attrs["labels"]`` as of `rank`.

    Raises
    ------
    RequestError
        If there is no constraint, or only the Pareto set was kept.
    """
    import pandas as pd

    if isinstance(results, pd.DataFrame):
        nearness = find_nearest_rows(results, count, where=where, limits=limits)
        units, labels = dict.fromkeys(results, None) | results.attrs.get("units", {}), results.attrs.get("labels", {})
    else:
        source = results if isinstance(results, Results) else open_results(results)
        nearness = find_nearest(source, count, where=where, limits=limits)
        units, labels = source.units, {c.name: dict(c.labels) for c in source.columns if c.labels}
    frame = _with_attrs(nearness.frame, {**units, VIOLATION: "1"}, labels)
    frame.attrs["scales"] = dict(nearness.scales)
    frame.attrs["combinations"] = dict(nearness.exclusions.combinations)
    return frame


def _with_attrs(
    ranked: pd.DataFrame, units: Mapping[str, str | None], labels: Mapping[str, Mapping[int, str]]
) -> pd.DataFrame:
    """The table with the units and labels of its columns; columns that the ranking added are numbers without a unit."""
    by_name = {str(name): units.get(str(name), "1") for name in ranked.columns}
    ranked.attrs["units"] = {name: unit for name, unit in by_name.items() if unit is not None}
    ranked.attrs["labels"] = {name: words for name, words in labels.items() if name in ranked}
    return ranked
