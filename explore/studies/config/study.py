"""A study: what a sweep computes and ranks, built in Python or read from a TOML file, all names resolved."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from explore.base.errors import ConfigError, DoubtfulInputWarning, KeyPath, Problems
from explore.base.units.shown import ShownUnits
from explore.model.request import Objective, Request
from explore.studies.config import toml_text
from explore.studies.config.linkage import Linkage, inlined
from explore.studies.config.resolution import ResolvedStudy, resolve_study
from explore.studies.designs.spaces import DesignSpace

if TYPE_CHECKING:
    import numpy.typing as npt

NumberOrText = float | str


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Study:
    """What a sweep computes and ranks: designs of a mechanism, metrics, constraints and objectives.

    The arguments have the names and the meaning of the keys of a study file; `objectives` is ``[rank] metrics``. A
    number is in the declared unit, or a string with a unit such as ``"40 rpm"``; arrays, tuples and ranges are lists;
    None leaves a key out. Studies are immutable, can be pickled, and are equal if they compute the same columns and
    have the same objectives.

    Parameters
    ----------
    mechanism
        Name, as listed by `explore.list_mechanisms`, or a `Linkage`.
    linkage
        With ``mechanism="linkage"``: a `Linkage`, its content, or the name of a file that has it.
    parameters
        For each parameter a value, a list of values, ``{"start": …, "stop": …, "num": …}``, a range to draw from
        ``{"min": …, "max": …, "log": False}``, or a length to solve for ``{"solve": "swing_angle", "value": 20}``.
    points
        Points of the floating link, such as ``{"knife": {"along": 120, "across": 40}}``: their coordinates take all
        that parameters take, and are the columns ``knife_along`` and ``knife_across``.
    target
        What the linkage is to do, such as ``{"kind": "path", "point": "knife", "points": [[0, 0], [10, 5], [20, 0]]}``:
        a path that the point follows. Metrics such as `path_error_rms` are how well it does; the parameters
        `crank_pivot_x`, `crank_pivot_y` and `ground_angle` place the linkage in the plane of the target.
    sampling
        ``{"method": "sobol", "count": 65536, "seed": 3}`` to draw designs; also "latin-hypercube" and "random". A table
        of designs is a CSV file, ``{"method": "table", "file": "designs.csv"}``, its name relative to the working
        directory. None is the full grid.
    window
        Part of the turn the statistics run over: a name, or ``{"from": 0, "to": 90}`` in degrees.
    drive
        The stroke that the window "drive" means.
    metrics
        Names of metrics; None for the mechanism's default list.
    constraints
        Bounds by metric, such as ``{"transmission_angle_min": {"min": "30 deg"}}``.
    formulas
        Metrics of your own, ``[metrics]`` in a file: ``{"reach": {"formula": "coupler + ground", "unit": "mm"}}``.
    objectives
        Objectives of the ranking, such as ``["cv", "swing_angle:max"]``; None for the mechanism's defaults.
    tolerance
        Bound on the relative error of every sampled statistic, as `evaluate` defines it.
    units
        Units in which commands show the results, by quantity: ``{"length": "in", "speed": "rpm"}``.
    tolerances
        Tolerances of parameters for `explore.tolerance`, such as ``{"crank": 0.1}``; a sweep does not use them.

    Attributes
    ----------
    request
        What to compute for each design: `mechanism`, `metrics`, `constraints`, `window`, `drive` and `tolerance`.
    space
        The designs: `n_designs`, `n_blocks`, `swept_parameters`, and ``designs(start, stop)``, which gives the columns
        of parameters of a range of design numbers.
    objectives
        The objectives of the ranking.
    identity
        Normalised JSON of everything that determines the columns.
    units
        Units in which commands show the results; all numbers of the study itself are in declared units.
    remarks
        What may not be meant, such as points of a path in a wrong order; a line with its key for each.
    linkage
        The linkage, if a table describes it; None for other mechanisms.

    Raises
    ------
    ConfigError
        With one line ``key: reason; suggestion`` for each of the first twenty problems, and the number of the others.

    Warns
    -----
    DoubtfulInputWarning
        With each of the remarks.

    Examples
    --------
    >>> study = Study(
    ...     mechanism="crank-rocker",
    ...     parameters={"crank": [60, 80], "coupler": 1083.4, "rocker": "54 cm", "ground": {"min": 650, "max": 750}},
    ...     sampling={"method": "sobol", "count": 1024, "seed": 1},
    ...     constraints={"transmission_angle_min": {"min": 30}},
    ...     metrics=["cv", "rocker_acceleration_max"],
    ...     objectives=["cv", "rocker_acceleration_max"],
    ... )
    """

    request: Request
    space: DesignSpace
    objectives: tuple[Objective, ...]
    identity: str
    units: ShownUnits
    remarks: tuple[str, ...]
    linkage: Linkage | None
    _text: str

    def __init__(
        self,
        *,
        mechanism: str | Linkage,
        parameters: Mapping[str, npt.ArrayLike | Sequence[object] | Mapping[str, Any]],
        points: Mapping[str, Mapping[str, Any]] | None = None,
        target: Mapping[str, Any] | None = None,
        sampling: Mapping[str, Any] | None = None,
        window: str | Mapping[str, NumberOrText] | None = None,
        drive: str | None = None,
        metrics: Sequence[str] | str | None = None,
        constraints: Mapping[str, Mapping[str, NumberOrText]] | None = None,
        formulas: Mapping[str, Mapping[str, str]] | None = None,
        objectives: Sequence[str] | str | None = None,
        tolerance: float = 1e-9,
        units: Mapping[str, str] | None = None,
        tolerances: Mapping[str, Any] | None = None,
        linkage: Linkage | Mapping[str, Any] | str | None = None,
    ) -> None:
        if isinstance(mechanism, Linkage):
            mechanism, linkage = "linkage", linkage or mechanism
        content = {
            "mechanism": mechanism,
            "linkage": linkage.content if isinstance(linkage, Linkage) else linkage,
            "parameters": parameters,
            "points": points,
            "target": target,
            "sampling": sampling,
            "evaluate": {"window": window, "drive": drive, "metrics": _as_list(metrics), "tolerance": tolerance},
            "metrics": formulas,
            "constraints": constraints,
            "rank": {"metrics": _as_list(objectives)},
            "units": units,
            "tolerances": tolerances,
        }
        sections = toml_text.toml_value(content)
        problems: Problems = []
        table_problems: list[str] = []
        resolved = resolve_study(sections, Path(), problems, table_problems)
        if resolved is None:
            lines = [f"{toml_text.dotted(_argument(key))}: {reason}" for key, reason in problems]
            raise ConfigError(toml_text.first_problems("", list(dict.fromkeys(lines))) + table_problems)
        remarks = [f"{toml_text.dotted(_argument(key))}: {text}" for key, text in resolved.remarks]
        self._set(resolved, inlined(toml_text.format_toml(sections), resolved.linkage), remarks)
        for remark in remarks:
            warnings.warn(remark, DoubtfulInputWarning, stacklevel=2)

    def _set(self, resolved: ResolvedStudy, text: str, remarks: Sequence[str]) -> None:
        for name, value in {**vars(resolved), "remarks": tuple(remarks), "_text": text}.items():
            object.__setattr__(self, name, value)

    def to_toml(self) -> str:
        """The text of a study file from which `load_study` reads an equal study.

        For a study read from a file this is the text of that file, with the linkage in place of the name of its file.
        The name of a table of designs is unchanged: save the text where that name leads to the table. Results files
        hold this text.
        """
        return self._text

    @property
    def sha256(self) -> str:
        """Hash of everything that determines the columns."""
        return hashlib.sha256(self.identity.encode()).hexdigest()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Study):
            return NotImplemented
        return (self.identity, self.objectives) == (other.identity, other.objectives)

    def __hash__(self) -> int:
        return hash((self.identity, self.objectives))

    def __repr__(self) -> str:
        fields = {
            "mechanism": self.request.mechanism.name,
            "designs": self.space.n_designs,
            "method": self.space.method,
            "swept": list(self.space.swept_parameters),
            "metrics": [metric.name for metric in self.request.metrics],
            "constraints": [constraint.metric.name for constraint in self.request.constraints],
            "objectives": [f"{objective.metric}:{objective.sense}" for objective in self.objectives],
        }
        return f"Study({', '.join(f'{name}={value!r}' for name, value in fields.items())})"

    def _repr_html_(self) -> str:
        """For notebooks: what is swept, and the text of the study file."""
        name, space = self.request.mechanism.name, self.space
        swept = ", ".join(space.swept_parameters) or "nothing"
        head = f"<b>{name}</b> study of {space.n_designs:,} designs, {space.method}; swept: {swept}"
        return f"<p>{head}</p><pre>{escape(self._text)}</pre>"


def make_study(resolved: ResolvedStudy, text: str, remarks: Sequence[str] = ()) -> Study:
    """The study of a file: its entries with all names resolved, its text, and its remarks with their lines."""
    study = object.__new__(Study)
    study._set(resolved, inlined(text, resolved.linkage), remarks)
    return study


def _as_list(names: Sequence[str] | str | None) -> Sequence[str] | None:
    """A single name as a list."""
    return [names] if isinstance(names, str) else names


def _argument(key: KeyPath) -> KeyPath:
    """The argument of `Study` for a key of a study file."""
    if key[0] == "evaluate":
        return key[1:]
    if key[0] == "metrics":
        return ("formulas", *key[1:])
    return ("objectives", *key[2:]) if key[0] == "rank" else key
