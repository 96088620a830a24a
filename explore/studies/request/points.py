"""Points of a floating link by name: those of a study, of a request and of results."""

from collections.abc import Iterable, Mapping, Sequence

from explore.base.errors import RequestError
from explore.base.suggest import format_value
from explore.mechanisms.linkages.table import LinkageTable
from explore.model.mechanism import Mechanism
from explore.model.points import MOST_POINTS, point_parameters, point_signals
from explore.studies.request.user_names import reason_against_name


def add_points(mechanism: Mechanism, points: Sequence[str]) -> Mechanism:
    """The mechanism with points of its floating link; a `RequestError` says why it cannot have them."""
    if isinstance(points, str | Mapping) or not isinstance(points, Iterable):
        wanted = 'a list of names, such as ["P"], whose places are the parameters P_along and P_across'
        raise RequestError(f"points: must be {wanted}, got {format_value(points)}")
    points = tuple(points)
    reason = reason_against_points(mechanism, len(points))
    if reason:
        raise RequestError(reason)
    for number, point in enumerate(points):
        reason = reason_against_point(mechanism, point, points[:number])
        if reason:
            raise RequestError(f"the point {format_value(point)}: {reason}")
    return mechanism.with_points(points)


def reason_against_points(mechanism: Mechanism, count: int) -> str:
    """Why a mechanism cannot have so many points; empty if it can."""
    if count and mechanism.floating_link is None:
        if isinstance(mechanism.table, LinkageTable):
            return "the points of this linkage are those of its table; leave others out"
        return f"{mechanism.in_words} has no floating link, so it has no points to name; leave them out"
    return f"{count} points are named; at most {MOST_POINTS} are possible" if count > MOST_POINTS else ""


def reason_against_point(mechanism: Mechanism, point: str, others: Sequence[str]) -> str:
    """Why a point cannot have this name beside those of other points; empty if it can."""
    if point in others:
        return "two points have this name; choose another"
    declared = mechanism.with_points(tuple(others))
    reason, link = reason_against_name(declared, point), mechanism.floating_link
    if reason or link is None:
        return reason
    taken = declared.taken_names.union(parameter.name for parameter in declared.parameters)
    own = [parameter.name for parameter in point_parameters(link, (point,))]
    own += [signal.name for signal in point_signals(link, (point,))]
    clash = next((name for name in own if name in taken), "")
    return f"its '{clash}' would have the name of another column or signal; choose another name" if clash else ""
