"""Parameters and points on the command line: `--set NAME=VALUE` and `--point NAME=ALONG,ACROSS`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from explore.base.errors import RequestError

if TYPE_CHECKING:
    from explore.base.units.shown import Scale, ShownUnits
    from explore.model.targets import Target

#: Coordinates of points by name.
Places = dict[str, tuple[float | str, ...]]


def parse_settings(
    mechanism: str,
    settings: Sequence[str],
    points: Sequence[str] = (),
    units: ShownUnits | None = None,
    target: Target | None = None,
) -> dict[str, float]:
    """Parameters in declared units from NAME=VALUE, whose numbers without a unit are in the shown ones."""
    from explore.base.suggest import suggestion
    from explore.studies.request.names import find_mechanism
    from explore.studies.request.parameters import read_value

    declared = {p.name: p for p in find_mechanism(mechanism, points, target).parameters}
    scales = units.scales({name: p.unit for name, p in declared.items()}) if units else {}
    parameters: dict[str, float] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise RequestError(f"--set {setting}: write NAME=VALUE, such as {next(iter(declared))}=100")
        if name not in declared:
            raise RequestError(f"--set {setting}: unknown parameter; {suggestion(name, declared)}")
        if name in parameters:
            raise RequestError(f"--set {name} is given several times; give it once")
        try:
            parameters[name] = read_value(declared[name], number_or_text(text, scales.get(name)))
        except RequestError as error:
            raise RequestError(f"--set {name}: {error}") from None
    return parameters


def parse_points(points: Sequence[str], units: ShownUnits | None = None) -> Places:
    """Points from NAME=ALONG,ACROSS, whose numbers without a unit are in the shown one."""
    scale = units.scale("mm") if units else None
    places: Places = {}
    for point in points:
        name, equals, text = point.partition("=")
        try:
            place = tuple(number_or_text(part, scale) for part in text.split(","))
        except RequestError as error:
            raise RequestError(f"--point {name}: {error}") from None
        if not equals or len(place) != 2:
            raise RequestError(f"--point {point}: write NAME=ALONG,ACROSS, such as knife=120,40")
        if name in places:
            raise RequestError(f"--point {name} is given several times; give it once")
        places[name] = place
    return places


def number_or_text(text: str, scale: Scale | None = None) -> float | str:
    """A declared value from a number in the shown unit, or the text where it is none, such as one with a unit."""
    try:
        number = float(text)
    except ValueError:
        return text
    return number if scale is None or scale.is_declared else scale.read(text)


def list_settings(parameters: Mapping[str, float], scales: Mapping[str, Scale] | None = None) -> str:
    """Parameters with their values, as a message lists them."""
    from explore.base.units.shown import PLAIN, number_with_unit

    shown = scales or {}
    return ", ".join(
        f"{name} = {number_with_unit(value, shown.get(name, PLAIN), 10)}" for name, value in parameters.items()
    )
