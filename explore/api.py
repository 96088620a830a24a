"""The public functions: names become objects here and in the config, nowhere below."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np
import numpy.typing as npt

from explore.derived_metrics import missing
from explore.errors import MotionError, RequestError
from explore.evaluation import evaluate_columns
from explore.motions import motion_signals
from explore.ranking.joint import rank_sources
from explore.ranking.limits import Limits
from explore.ranking.rankings import RankRequest, rank_frame, rank_source
from explore.request.parameters import parameter_columns
from explore.request.requests import find_mechanism, make_request
from explore.store.opening import open_results, open_several
from explore.store.results import Results
from explore.sweeping.clusters import given_client, local_cluster
from explore.sweeping.runs import Keep, Progress, run_study
from explore.vocabulary import Status

if TYPE_CHECKING:
    import pandas as pd
    from distributed import Client

    from explore.study import Study


def read_results(path: Path | str, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Committed designs of a results file as a table.

    Parameters
    ----------
    path
        The HDF5 file of a sweep, finished or not.
    columns
        Names of the columns wanted; all when None.

    Returns
    -------
    DataFrame
        Index ``design``, one row for each committed design.
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
    progress: Callable[[Progress], None] | None = None,
) -> Results:
    """Compute every pending block of a study into a results file.

    Parameters
    ----------
    study
        From `load_study`.
    path
        The results file; an unfinished one of the same study is continued.
    client
        Any synchronous dask.distributed Client; a cluster of threads in this process unless given.
    workers
        Threads of that cluster; all processors unless given.
    processes
        Work in processes of this machine in place of threads.
    keep
        "all" designs, or only the "front": the Pareto set of the study's objectives.
    max_failures
        Stop when more blocks than this have failed; no limit when None.
    restart
        Move an existing file aside and start over.
    progress
        Called after every commit.

    Returns
    -------
    Results
        Those in the file. Blocks that failed are not committed; the warning says which.

    Raises
    ------
    ResultsError
        If the file cannot be created, belongs to another study, or is being written by another process; or if blocks
        failed and only the front was to be kept, which is written when all is done.
    ClusterError
        If the cluster is lost, its versions are others, or too many blocks failed.
    """
    if keep not in get_args(Keep):
        raise RequestError(f"keep = {keep!r}: keep is {' or '.join(get_args(Keep))}")
    if max_failures is not None and max_failures < 0:
        raise RequestError(f"max_failures = {max_failures}: at least 0, or None for no limit")
    if workers is not None and workers < 1:
        raise RequestError(f"workers = {workers}: ask for at least one")
    if client is not None and (workers is not None or processes):
        raise RequestError("a client brings its own workers; leave out workers and processes")
    cluster = given_client(client) if client is not None else local_cluster(workers, processes=processes)
    summary = run_study(study, path, cluster, keep=keep, max_failures=max_failures, restart=restart, progress=progress)
    for block, problem in summary.failed.items():
        warnings.warn(f"block {block} failed and was left out: {problem}", RuntimeWarning, stacklevel=2)
    return open_results(path)


def evaluate(
    mechanism: str,
    designs: Mapping[str, npt.ArrayLike] | pd.DataFrame,
    metrics: Sequence[str] | None = None,
    window: str | Mapping[str, float] | None = None,
    drive: str | None = None,
    constraints: Mapping[str, Mapping[str, float]] | None = None,
    tolerance: float = 1e-9,
) -> pd.DataFrame:
    """Evaluate designs, each exactly to the tolerance and sampling no more than that takes.

    Parameters
    ----------
    mechanism
        Name, as listed by `explore mechanisms`.
    designs
        Parameters by name in declared units: columns of a table, or numbers and arrays that broadcast.
    metrics
        Names of metrics; the mechanism's default list unless given.
    window
        Part of the turn the statistics run over: a name, or ``{"from": 0, "to": 90}`` in degrees.
    drive
        The stroke that the window "drive" means: "slow", "fast", or a stroke by name.
    constraints
        Bounds by metric, such as ``{"transmission_angle_min": {"min": 30}}``.
    tolerance
        On every sampled statistic, relative: of a mean to the rms, of a variance to its square, of extremes to the
        largest value, of a cv to itself. Column ``error`` is the bound that was reached.

    Returns
    -------
    DataFrame
        One row for each design: parameters, metrics, margins, nodes, error, feasible (bool), status (int8).
        ``attrs["kinematic_evaluations"]`` is the number of geometries sampled.

    Raises
    ------
    RequestError
        If a name, a window, a bound or the shape of the designs is wrong. A bad design is a row with a status.
    """
    import pandas as pd

    declared = find_mechanism(mechanism)
    request = make_request(declared, metrics, window, drive, constraints, tolerance)
    columns = parameter_columns(declared, designs)
    defaults = {parameter.name: parameter.default for parameter in declared.parameters}
    lacking = missing(request, lambda name: name in columns or bool(defaults[name]))
    if lacking:
        raise RequestError("\n".join(reason for _, reason in lacking))
    evaluation = evaluate_columns(request, columns)
    index = designs.index if isinstance(designs, pd.DataFrame) else None
    frame = pd.DataFrame(evaluation.columns, index=index)
    frame["feasible"] = frame["feasible"].astype(bool)
    frame.attrs["kinematic_evaluations"] = evaluation.kinematic_evaluations
    frame.attrs["senses"] = {metric.name: metric.sense for metric in request.metrics}
    frame.attrs["constraints"] = {c.metric.name: {"min": c.minimum, "max": c.maximum} for c in request.constraints}
    return frame


def simulate(
    mechanism: str,
    *,
    angles: int | Sequence[float] | npt.NDArray[np.float64] = 360,
    method: str = "auto",
    tolerance: float = 1e-9,
    **parameters: float,
) -> pd.DataFrame:
    """The motion of one design: every signal by name at crank angles.

    Parameters
    ----------
    mechanism
        Name.
    angles
        Crank angles in degrees, or how many equispaced ones from 0.
    method
        Way to solve the motion, such as "newton", "rk45" or, at another setting, "rk45(rtol=0.001)";
        ``explore precision`` compares them. "auto" takes the cheapest that meets the tolerance on this design.
    tolerance
        On angles (rad), and on velocities and accelerations relative to their largest. A method that misses it on
        this design warns, with its errors measured.
    parameters
        Of the design, in declared units. Forces are those of the load among them, 0 without one.

    Returns
    -------
    DataFrame
        Index ``crank_angle`` (deg), one column for each signal in its declared unit; NaN where the method found
        nothing. ``attrs["method"]`` is the method that was used, ``attrs["why"]`` the reason of "auto".

    Raises
    ------
    MotionError
        If the design cannot make the full turn.
    RequestError
        If a name, a number of parameters or the angles are wrong.
    """
    import pandas as pd

    declared = find_mechanism(mechanism)
    columns = parameter_columns(declared, parameters)
    request = make_request(declared, [declared.metrics[0].name], "cycle")
    if len(columns[next(iter(columns))]) != 1:
        raise RequestError("simulate takes one design; evaluate takes many")
    status = Status(int(evaluate_columns(request, columns).columns["status"][0]))
    if status is not Status.OK:
        raise MotionError(f"no full turn to simulate: {status.sentence}")
    count = int(angles) if isinstance(angles, (int, np.integer)) and not isinstance(angles, bool) else None
    crank_angle: npt.NDArray[np.float64] = np.asarray(
        angles if count is None else np.arange(count) * (360.0 / max(count, 1)), dtype=np.float64
    )
    if crank_angle.ndim != 1 or len(crank_angle) == 0 or not np.isfinite(crank_angle).all():
        raise RequestError("angles must be a positive number of angles or a list of finite angles in degrees")
    signals, used, why = motion_signals(declared, columns, crank_angle, method, tolerance)
    frame = pd.DataFrame(signals, index=pd.Index(crank_angle, name="crank_angle"))
    frame.attrs |= {"method": used, "why": why}
    return frame


def rank(
    results: Results | pd.DataFrame | Path | str | Sequence[Results | Path | str],
    metrics: Sequence[str] | str | None = None,
    order_by: str | None = None,
    fronts: int = 1,
    *,
    where: str | None = None,
    limits: Limits | None = None,
    quality: bool = False,
) -> pd.DataFrame:
    """The Pareto-optimal designs, best first.

    Parameters
    ----------
    results
        Results, the path of a results file, or any table. Several results or paths are ranked together; the column
        ``results`` says where each design is from.
    metrics
        Objectives, such as ``["cv", "swing_angle:max"]``; those of the study, or of the first, unless given.
    order_by
        The metric that orders the designs; the first objective unless given.
    fronts
        How many fronts to return; column ``front`` counts them from 1.
    where
        Only designs that meet a condition on any columns, such as ``"swing_angle > 20 and not cv >= 0.5"``; see
        `explore.ranking.conditions`. Comparisons with an undefined value are false.
    limits
        Constraints narrower than those of the sweep, by metric in its unit: a number moves the side that the sweep
        bounded, ``{"min": 1, "max": 2}`` names the sides.
    quality
        Add what tells the designs of a front apart: ``knee``, ``crowding`` and ``hypervolume_share``; see
        `explore.ranking.quality`.

    Returns
    -------
    DataFrame
        One row for each design of the fronts, under its number, with the columns of the results and those named above.

    Raises
    ------
    RequestError
        If a name is unknown, a condition cannot be read, or a limit is wider than the constraint that the designs were
        swept with.
    """
    import pandas as pd

    request = RankRequest(metrics, order_by, fronts, where, limits, quality)
    if isinstance(results, pd.DataFrame):
        return rank_frame(results, request)
    several = not isinstance(results, (Results, Path, str))
    sources = open_several(results if several else [results])  # type: ignore[arg-type, list-item]  # as just asked
    if several:
        joint = rank_sources(sources, request)
        ranking, parts, doubts = joint.whole, joint.parts, joint.doubts
    else:
        ranking = rank_source(next(iter(sources.values())), request)
        parts, doubts = dict.fromkeys(sources, ranking), ()
    lost = "keeps only the Pareto set of its study: the best in this request may be missing"
    for text in (*(f"{name} {lost}" for name, part in parts.items() if part.incomplete), *doubts):
        warnings.warn(text, RuntimeWarning, stacklevel=2)
    return ranking.frame
