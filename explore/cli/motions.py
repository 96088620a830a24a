"""`explore simulate`."""

from __future__ import annotations

import math
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from explore.cli.output import compiled_kernels, print_json, refuse_same, say
from explore.errors import MotionError, RequestError

if TYPE_CHECKING:
    import pandas as pd


def print_motion(
    config: Path | None,
    mechanism: str | None,
    settings: list[str],
    design: int,
    angles: int,
    method: str,
    output: Path | None,
    *,
    as_json: bool,
) -> None:
    """Write the motion of one design as CSV or JSON."""
    if (config is None) == (mechanism is None):
        raise RequestError("name either a study or --mechanism with its --set NAME=VALUE")
    if config:
        refuse_same(output, config, "the study")
    with compiled_kernels():
        from explore.api import simulate
    if config:
        name, parameters = _from_study(config, design, settings)
    else:
        name, parameters = mechanism or "", _from_settings(mechanism or "", settings)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        motion = simulate(name, angles=angles, method=method, **parameters)
    for warning in caught:
        say(f"warning: {warning.message}", "yellow")
    _write(motion, output, as_json=as_json)


def _from_study(config: Path, design: int, settings: list[str]) -> tuple[str, dict[str, float]]:
    """The mechanism and the parameters of one design of a study, settings in place of its own."""
    from explore.config.study_file import load_study
    from explore.vocabulary import Status

    study = load_study(config)
    if design >= study.space.count:
        raise RequestError(f"{config} has {study.space.count:,} designs, numbered from 0; there is no design {design}")
    name = study.request.mechanism.name
    own = {key: float(values[0]) for key, values in study.space.designs(design, design + 1).items()}
    others = _from_settings(name, settings)
    unknown = [key for key, value in own.items() if math.isnan(value) and key not in others]
    if unknown:
        raise MotionError(f"design {design} of {config} has no {unknown[0]}: {Status.UNREACHABLE.sentence}")
    but = f", but {_listed(others)}" if others else ""
    say(f"design {design} of {study.space.count:,}: {_listed(own)}{but}")
    return name, own | others


def _listed(parameters: dict[str, float]) -> str:
    return ", ".join(f"{name} = {value:.10g}" for name, value in parameters.items())


def _from_settings(mechanism: str, settings: list[str]) -> dict[str, float]:
    """Parameters given as NAME=VALUE, units allowed."""
    from explore.request.requests import find_mechanism
    from explore.request.units import quantity
    from explore.suggest import suggestion

    declared = {p.name: p for p in find_mechanism(mechanism).parameters}
    parameters: dict[str, float] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise RequestError(f"--set {setting}: write NAME=VALUE, such as crank=100")
        if name not in declared:
            raise RequestError(f"--set {setting}: unknown parameter; {suggestion(name, declared)}")
        try:
            parameters[name] = quantity(_number_or_text(text), declared[name].unit)
        except RequestError as error:
            raise RequestError(f"--set {setting}: {error}") from None
    return parameters


def _number_or_text(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _write(motion: pd.DataFrame, output: Path | None, *, as_json: bool) -> None:
    columns = {str(name): column.tolist() for name, column in motion.reset_index().items()}
    if output is None:
        if as_json:
            print_json(columns)
        else:
            motion.to_csv(sys.stdout)
        return
    if as_json or output.suffix == ".json":
        import json

        output.write_text(json.dumps(columns), encoding="utf-8")
    else:
        motion.to_csv(output)
    say(f"wrote {len(motion)} crank angles to {output}")
