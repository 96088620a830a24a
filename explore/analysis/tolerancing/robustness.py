"""What tolerances do to designs: the tables of an analysis, and the results file of the designs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from explore.analysis.tolerancing.analysis import Analysis
from explore.analysis.tolerancing.derivatives import contributions
from explore.analysis.tolerancing.outcomes import TolerancedRequest
from explore.analysis.tolerancing.runs import ToleranceRun, write_toleranced
from explore.analysis.tolerancing.spreads import CHUNK, chunk_deviations
from explore.base.errors import RequestError
from explore.base.units.shown import PLAIN, Scale, ShownUnits, in_units
from explore.mechanisms.linkages.declared import table_of
from explore.mechanisms.linkages.table import PREFIX
from explore.model.columns import Column
from explore.model.request import Objective
from explore.results.store.results import Results
from explore.studies.request.tolerances import Tolerance

if TYPE_CHECKING:
    import pandas as pd


#: Columns of `Robustness.metrics` in the unit of the metric.
_AMOUNTS = ["nominal", "mean", "std", "std_first_order", "low", "high"]
#: Columns of `Robustness.derivatives` in the unit of the metric over that of the parameter.
_SLOPES = ["derivative", "error"]
#: Number of designs beyond which derivatives of integrals are differences, as ball arithmetic takes seconds for each.
MOST_INTEGRATED = 16


@dataclass(frozen=True, repr=False)
class Robustness:
    """What tolerances do to designs.

    Attributes
    ----------
    designs
        One row for each design, under its number, with the columns of the results and: ``yield``, the probability that
        a part moves and meets all constraints, with its 95 % interval ``yield_low`` to ``yield_high``;
        ``failure_probability``, 1 less the yield with all its digits; ``assembled``, the share of the parts that move;
        and for each metric with a better side ``NAME_robust``, the mean of the parts that have it and three standard
        deviations to the worse side, and ``NAME_worst``, the worst value over the box of the tolerances, undefined
        where some part of the box does not move. ``attrs`` as of `Results.to_pandas`, with the yield and the robust
        metrics for objectives, so that `explore.rank` gives the yield front.
    metrics
        Index (design, metric): ``nominal``; ``mean`` and ``std`` of the parts that have it, and the number of those
        that move without it, ``undefined``; ``std_first_order``; ``low`` and ``high``, the extremes over the box, and
        whether each is at a corner, ``low_is_corner`` and ``high_is_corner``: elsewhere it was found by a search.
    derivatives
        Index (design, metric, parameter): ``derivative`` in units of the metric over that of the parameter, an estimate
        of its absolute ``error``, and ``share`` of the variance to first order.
    failures
        Index design: ``probability``, ``low``, ``high`` (95 %), ``method``, "draws" or "weighted", number of ``parts``
        that were drawn, those ``not_assembled``, those that move and miss each constraint, ``missed_NAME``, and those
        of each status but ok, ``statuses``, a mapping from its label; ``box_assembled``, ``box_tolerance_met`` and
        ``box_feasible``: whether all points of the box that were looked at move, meet the error bound where they do,
        and are feasible.
    tolerances
        Those of the parameters.
    draws, seed
        Number of parts of each design, and the seed.
    """

    designs: pd.DataFrame
    metrics: pd.DataFrame
    derivatives: pd.DataFrame
    failures: pd.DataFrame
    tolerances: tuple[Tolerance, ...]
    draws: int
    seed: int
    _run: ToleranceRun = field(repr=False)
    _scales: Mapping[str, Scale] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        first = self.failures["probability"]
        return f"<Robustness of {len(self.designs)} designs: yield {1 - first.max():.6g} to {1 - first.min():.6g}>"

    @property
    def units(self) -> dict[str, str]:
        """Unit of each metric and parameter."""
        return {name: self._scales[name].shown if self._scales else unit for name, unit in self.declared_units.items()}

    @property
    def declared_units(self) -> dict[str, str]:
        """Unit of each metric and parameter in results files."""
        request = self._run.request.request
        return {quantity.name: quantity.unit for quantity in (*request.metrics, *request.mechanism.parameters)}

    def scales(self, units: ShownUnits) -> dict[str, Scale]:
        """The declared and the shown unit of each column of `designs`, and of each metric and parameter."""
        return units.scales(self.designs.attrs["units"] | self.declared_units)

    def in_units(self, scales: Mapping[str, Scale]) -> Robustness:
        """The same with all values in shown units."""
        factors = {name: scale.factor for name, scale in scales.items()}
        of_metrics = [float(factors[metric]) for _, metric in self.metrics.index]
        of_slopes = [float(factors[metric] / factors[name]) for _, metric, name in self.derivatives.index]
        return replace(
            self,
            designs=in_units(self.designs, scales),
            metrics=self.metrics.assign(**self.metrics[_AMOUNTS].mul(of_metrics, axis=0)),
            derivatives=self.derivatives.assign(**self.derivatives[_SLOPES].mul(of_slopes, axis=0)),
            tolerances=tuple(replace(t, plus_minus=scales[t.parameter].show(t.plus_minus)) for t in self.tolerances),
            _scales=scales,
        )

    def metrics_of(self, design: int) -> dict[str, dict[str, Any]]:
        """Rows of `metrics` of one design, by metric; each with the ``unit``."""
        rows = self.metrics[self.metrics.index.get_level_values("design") == design].to_dict(orient="records")
        names = self._run.request.metrics
        return {
            name: {str(k): v for k, v in row.items()} | {"unit": self.units[name]}
            for name, row in zip(names, rows, strict=True)
        }

    def by_dimension(self, design: int, column: str) -> dict[str, dict[str, float]]:
        """A column of `derivatives` of one design, by metric and parameter."""
        table = self.derivatives[self.derivatives.index.get_level_values("design") == design]
        names, parameters = self._run.request.metrics, [t.parameter for t in self.tolerances]
        values = table[column].to_numpy().reshape(len(names), len(parameters)).tolist()
        return {name: dict(zip(parameters, row, strict=True)) for name, row in zip(names, values, strict=True)}

    def sample(self, design: int) -> pd.DataFrame:
        """The first parts that were drawn of a design: deviations, metrics, and ``feasible``, up to 65,536 rows."""
        import pandas as pd

        if design not in self.designs.index:
            known = ", ".join(map(str, self.designs.index))
            raise RequestError(f"design {design} was not analysed; available: {known}")
        request, place = self._run.request, list(self.designs.index).index(design)
        deviations = chunk_deviations(request, self.seed, 0, min(CHUNK, self.draws))
        found = request.outcomes(self._run.designs[place], deviations)
        names = [f"{tolerance.parameter}_deviation" for tolerance in self.tolerances]
        columns = dict(zip(names, deviations, strict=True)) | found.metrics
        for name, values in columns.items():
            columns[name] = self._scales.get(name.removesuffix("_deviation"), PLAIN).show_all(values)
        return pd.DataFrame(columns | {"feasible": found.is_feasible})


@dataclass(frozen=True)
class TolerancePlan:
    """Designs with tolerances, before they are analysed."""

    source: Results
    frame: pd.DataFrame
    objectives: tuple[Objective, ...]
    run: ToleranceRun

    @property
    def added(self) -> tuple[Column, ...]:
        """The columns that an analysis adds."""
        units = {metric.name: metric.unit for metric in self.run.request.request.metrics}
        columns = [
            Column("yield", "1", "probability that a part moves and meets all constraints", "metric"),
            Column("yield_low", "1", "lower end of the 95 % interval of the yield", "metric"),
            Column("yield_high", "1", "upper end of the 95 % interval of the yield", "metric"),
            Column("failure_probability", "1", "probability that a part fails", "metric"),
            Column("assembled", "1", "share of the parts that move", "metric"),
        ]
        for name, sense in self.run.request.senses.items():
            sign = "plus" if sense == "min" else "minus"
            text = f"mean of {name} over the parts that have it {sign} three standard deviations"
            columns.append(Column(f"{name}_robust", units[name], text, "metric"))
            columns.append(
                Column(f"{name}_worst", units[name], f"worst {name} over the box of the tolerances", "metric")
            )
        return tuple(columns)

    @property
    def attributes(self) -> dict[str, Any]:
        """Senses of the columns that are added, new objectives, and what determines the analysis."""
        senses = {"yield": "max", "yield_low": "max", "yield_high": "max", "failure_probability": "min"}
        senses["assembled"] = "max"
        for name, sense in self.run.request.senses.items():
            senses |= {f"{name}_robust": sense, f"{name}_worst": sense}
        endings = dict.fromkeys(self.frame.columns, "") | dict.fromkeys(self.run.request.senses, "_robust")
        robust = [f"{o.metric}{endings[o.metric]}:{o.sense}" for o in self.objectives if o.metric in endings]
        tolerances = {t.parameter: [t.plus_minus, t.distribution] for t in self.run.request.tolerances}
        determined = {"tolerances": tolerances, "draws": self.run.draws, "seed": self.run.seed}
        return {"senses": senses, "objectives": ["yield:max", *robust], "tolerances": determined}

    def robustness(self, analyses: Sequence[Analysis]) -> Robustness:
        """The tables of the analyses, one for each design."""
        import pandas as pd

        if find_spec("flint") is not None:
            analyses = self._sharpened(analyses)
        request = self.run.request
        numbers, names = self.frame.index, request.metrics
        rows = [_added_row(request, analysis) for analysis in analyses]
        added = pd.DataFrame(rows, index=numbers)
        frame = self.frame.drop(columns=[name for name in added if name in self.frame]).join(added)
        attributes = self.attributes
        frame.attrs = dict(self.frame.attrs) | {
            "units": self.frame.attrs["units"] | {column.name: column.unit for column in self.added},
            "senses": self.source.senses | attributes["senses"],
            "objectives": attributes["objectives"],
        }
        pairs = pd.MultiIndex.from_product([numbers, names], names=["design", "metric"])
        metrics = [_metric_row(request, a, name) for a in analyses for name in names]
        triples = pd.MultiIndex.from_product(
            [numbers, names, [t.parameter for t in request.tolerances]], names=["design", "metric", "parameter"]
        )
        slopes = [row for a in analyses for name in names for row in _derivative_rows(request, a, name)]
        failures = pd.DataFrame([_failure_row(analysis) for analysis in analyses], index=numbers)
        table = pd.DataFrame(metrics, index=pairs)
        table.insert(
            0, "nominal", [float(row[name]) if name in row else np.nan for row in self._rows for name in names]
        )
        return Robustness(
            frame, table, pd.DataFrame(slopes, index=triples), failures, request.tolerances, self.run.draws,
            self.run.seed, self.run,
        )  # fmt: skip

    @property
    def _rows(self) -> list[dict[Any, Any]]:
        """Values of each design by column, also of metrics that only constraints use."""
        request, count = self.run.request, len(self.run.request.tolerances)
        nominal = [request.outcomes(design, np.zeros((count, 1))).metrics for design in self.run.designs]
        return [{name: values[0] for name, values in design.items()} for design in nominal]

    def _sharpened(self, analyses: Sequence[Analysis]) -> list[Analysis]:
        """The analyses with exact derivatives, where there is a rigorous road to them."""
        from explore.analysis.certifying.means import integration_left_out
        from explore.analysis.tolerancing.slopes import sharpen

        request = self.run.request
        mechanism = request.request.mechanism
        if table_of(mechanism) is None or mechanism.name.startswith(PREFIX):  # enclosures of tables take up to seconds
            return list(analyses)
        with nullcontext() if len(analyses) <= MOST_INTEGRATED else integration_left_out():
            return [
                replace(analysis, derivatives=sharpen(analysis.derivatives, request, design))
                for analysis, design in zip(analyses, self.run.designs, strict=True)
            ]

    def write(self, robustness: Robustness, path: Path, *, restart: bool) -> bool:
        """Write the designs as a results file; return whether it was not complete already."""
        return write_toleranced(path, self.source, robustness.designs, self.added, self.attributes, restart=restart)


def _added_row(request: TolerancedRequest, analysis: Analysis) -> dict[str, float]:
    """The columns that are added to a design."""
    failure, parts = analysis.failure, analysis.parts
    row = {
        "yield": 1.0 - failure.probability,
        "yield_low": 1.0 - failure.high,
        "yield_high": 1.0 - failure.low,
        "failure_probability": failure.probability,
        "assembled": parts.assembled / parts.count,
    }
    for name, sense in request.senses.items():
        row[f"{name}_robust"] = parts.spreads[name].robust(sense)
        row[f"{name}_worst"] = analysis.worst(name, sense)
    return row


def _metric_row(request: TolerancedRequest, analysis: Analysis, name: str) -> dict[str, float | bool]:
    spread, worst = analysis.parts.spreads[name], analysis.worst_case
    slopes = analysis.derivatives.slopes[name] * [t.std for t in request.tolerances]
    return {
        "mean": spread.mean if spread.count else np.nan,
        "std": spread.std,
        "undefined": analysis.parts.assembled - spread.count,
        "std_first_order": float(np.sqrt((slopes**2).sum())),
        "low": worst.low[name].value,
        "high": worst.high[name].value,
        "low_is_corner": worst.low[name].is_corner,
        "high_is_corner": worst.high[name].is_corner,
    }


def _derivative_rows(request: TolerancedRequest, analysis: Analysis, name: str) -> list[dict[str, float]]:
    slopes, errors = analysis.derivatives.slopes[name], analysis.derivatives.errors[name]
    shares = contributions(slopes, [t.std for t in request.tolerances])
    return [
        {"derivative": slope, "error": error, "share": share}
        for slope, error, share in zip(slopes.tolist(), errors.tolist(), shares.tolist(), strict=True)
    ]


def _failure_row(analysis: Analysis) -> dict[str, object]:
    failure, parts, worst = analysis.failure, analysis.parts, analysis.worst_case
    row: dict[str, object] = {
        "probability": failure.probability, "low": failure.low, "high": failure.high, "method": failure.method,
        "parts": parts.count, "not_assembled": parts.count - parts.assembled,
    }  # fmt: skip
    row |= {f"missed_{name}": count for name, count in parts.missed.items()}
    return row | {
        "statuses": dict(parts.statuses),
        "box_assembled": not worst.has_unassembled,
        "box_tolerance_met": not worst.has_inexact,
        "box_feasible": not worst.has_infeasible,
    }
