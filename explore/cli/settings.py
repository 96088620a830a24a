"""Parameters and points on the command line: `--set NAME=VALUE` and `--point NAME=ALONG,ACROSS`."""

from __future__ import annotations

from collections.abc import Sequence

from explore.errors import RequestError

#: Coordinates of points by name.
Places = dict[str, tuple[float | str, ...]]


def parse_settings(mechanism: str, settings: Sequence[str], points: Sequence[str] = ()) -> dict[str, float]:
    """Parameters from NAME=VALUE, in the units of the mechanism with these points."""
    from explore.request.names import find_mechanism
    from explore.request.parameters import read_value
    from explore.suggest import suggestion

    declared = {p.name: p for p in find_mechanism(mechanism, points).parameters}
    parameters: dict[str, float] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise RequestError(f"--set {setting}: write NAME=VALUE, such as {next(iter(declared))}=100")
        if name not in declared:
            raise RequestError(f"--set {setting}: unknown parameter; {suggestion(name, declared)}")
        try:
            parameters[name] = read_value(declared[name], number_or_text(text))
        except RequestError as error:
            raise RequestError(f"--set {name}: {error}") from None
    return parameters


def parse_points(points: Sequence[str]) -> Places:
    """Points from NAME=ALONG,ACROSS."""
    places: Places = {}
    for point in points:
        name, equals, text = point.partition("=")
        place = tuple(number_or_text(part) for part in text.split(","))
        if not equals or len(place) != 2:
            raise RequestError(f"--point {point}: write NAME=ALONG,ACROSS, such as knife=120,40")
        places[name] = place
    return places


def number_or_text(text: str) -> float | str:
    """A number, or the text where it is none, such as one with a unit."""
    try:
        return float(text)
    except ValueError:
        return text


def list_settings(parameters: dict[str, float]) -> str:
    """Parameters with their values, as a message lists them."""
    return ", ".join(f"{name} = {value:.10g}" for name, value in parameters.items())
