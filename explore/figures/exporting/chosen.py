"""The design to export: one of results, or one given by its parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from explore.base.errors import MotionError, RequestError
from explore.base.units.shown import Scale, read_shown_units
from explore.figures.charts.turn import Span
from explore.figures.simulation import SimulatedDesign, simulate_design
from explore.model.points import COORDINATES, coordinates
from explore.model.status import Status
from explore.results.queries import choose_design
from explore.results.store.results import Results
from explore.results.store.study_units import given_units, units_of_study
from explore.running.motions import mark_angles, motion_span
from explore.running.public import simulate
from explore.studies.config.linkage import Linkage, mechanism_entries, mechanism_source
from explore.studies.config.study import Study
from explore.studies.config.study_file import parse_study
from explore.studies.config.toml_text import format_toml
from explore.studies.request.names import find_mechanism
from explore.studies.request.parameters import parameter_columns, point_parameters

#: Sections of a study of many designs that the study of one design does not take over.
_OF_MANY = ("mechanism", "linkage", "parameters", "points", "target", "sampling", "rank", "scene")


@dataclass(frozen=True)
class DesignOfResults:
    """One design of results."""

    results: Results
    number: int

    @classmethod
    def choose(cls, results: Results, number: int | None) -> DesignOfResults:
        """The design of a number, or the best one; errors as of `choose_design`, and if it lacks a solved length."""
        chosen = choose_design(results, number)
        row = results.design(chosen)
        for column in results.columns:
            if column.role == "parameter" and math.isnan(row[column.name]):
                raise MotionError(f"design {chosen} has no {column.name}: {Status.UNREACHABLE.sentence}")
        return cls(results, chosen)

    @cached_property
    def simulated(self) -> SimulatedDesign:
        """Its motion, with the drive stroke of its study, and speeds that the study gives in rpm shown so."""
        results = self.results
        return simulate_design(results.in_units(results.shown_units.with_given(given_units(results))), self.number)

    @property
    def study(self) -> str:
        """The text of the study of this design alone, which computes the same row."""
        results = self.results.declared
        row, sections = results.design(self.number), results.sections
        units = read_shown_units(units_of_study(results))
        values = {
            column.name: _as_declared(row[column.name], units.scale(column.unit))
            for column in results.columns
            if column.role == "parameter"
        }
        objectives = list(results.named_objectives)
        parts: dict[str, object] = {
            **mechanism_entries(mechanism_source(results)),
            **_value_entries(results.points, values),
            **({"target": results.target.to_content()} if results.target else {}),
            **{name: section for name, section in sections.items() if name not in _OF_MANY},
            "rank": {"metrics": objectives} if objectives else {},
        }
        text = f"# Design {self.number} of {results.path.name}\n\n{format_toml(parts)}"
        parse_study(text, f"the study of design {self.number}", results.path.parent)
        return text


def _as_declared(value: float, scale: Scale) -> float | str:
    """A number of a study, with its unit where the study shows another one."""
    return value if scale.is_declared else f"{value!r} {scale.declared}"


def _value_entries(points: tuple[str, ...], values: Mapping[str, float | str]) -> dict[str, Any]:
    """The sections of a study with these parameters, those of points apart."""
    places = coordinates(points, values)
    of_points = {f"{point}_{axis}" for point in places for axis in COORDINATES}
    return {
        "parameters": {name: value for name, value in values.items() if name not in of_points},
        "points": {point: dict(zip(COORDINATES, place, strict=True)) for point, place in places.items()},
    }


@dataclass(frozen=True)
class DesignOfParameters:
    """A design of a mechanism by its parameters in declared units, those of its points included."""

    mechanism: str | Linkage
    parameters: Mapping[str, float]
    points: tuple[str, ...]

    @classmethod
    def read(
        cls,
        mechanism: str | Linkage,
        parameters: Mapping[str, float | str],
        points: Mapping[str, Sequence[float | str]],
    ) -> DesignOfParameters:
        """A design whose values may have units; `RequestError` for an unknown name or a bad value."""
        places = point_parameters(points)
        declared = find_mechanism(mechanism, tuple(points))
        columns = parameter_columns(declared, {**parameters, **places})
        if len(next(iter(columns.values()))) != 1:
            raise RequestError("export takes one design; give a number for each parameter")
        return cls(mechanism, {name: float(column.item()) for name, column in columns.items()}, tuple(points))

    @cached_property
    def simulated(self) -> SimulatedDesign:
        """Its motion."""
        declared = find_mechanism(self.mechanism, self.points)
        values = {p.name: self.parameters.get(p.name, p.default) for p in declared.parameters}
        parameters = {name: value for name, value in values.items() if value is not None}
        columns = {name: np.array([value]) for name, value in parameters.items()}
        span = Span(*motion_span(declared, columns, None))
        angles = span.densely(float(np.rad2deg(declared.anchor_angle)))
        motion = simulate(declared.name, parameters, points=coordinates(self.points, parameters), angles=angles)
        units = {p.name: "" if p.unit == "1" else p.unit for p in declared.parameters}
        given = ", ".join(f"{name} {value:.6g} {units[name]}".rstrip() for name, value in self.parameters.items())
        return SimulatedDesign(
            declared, parameters, motion, f"{declared.name}: {given}", marks=mark_angles(declared, columns), span=span
        )

    @property
    def study(self) -> str:
        """The text of a study of this design alone."""
        return Study(mechanism=self.mechanism, **_value_entries(self.points, self.parameters)).to_toml()
