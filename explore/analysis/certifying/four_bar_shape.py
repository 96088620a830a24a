"""Class and overall size of a four-bar in exact and in ball arithmetic."""

import math

from flint import arb, fmpq

from explore.analysis.certifying.balls import Enclosure, UnprovedError, exact
from explore.analysis.certifying.four_bar_motion import Linkage
from explore.mechanisms import four_bar


def classify(
    crank: float | fmpq, coupler: float | fmpq, rocker: float | fmpq, ground: float | fmpq
) -> tuple[int, fmpq]:
    """Class and Grashof margin by exact signs; a margin of up to 4 units in the last place is a change point."""
    lengths = tuple(map(exact, (crank, coupler, rocker, ground)))
    short, first, second, long = sorted(lengths)
    margin = first + second - short - long
    if short == long:
        return four_bar.CHANGE_POINT, margin
    if long >= short + first + second:
        return four_bar.CANNOT_ASSEMBLE, margin
    if abs(margin) <= 4 * exact(math.ulp(float(max(lengths)))):
        return four_bar.CHANGE_POINT, margin
    if margin < 0:
        return four_bar.NON_GRASHOF, margin
    by_shortest = (four_bar.CRANK_ROCKER, four_bar.DOUBLE_ROCKER, four_bar.ROCKER_CRANK, four_bar.DOUBLE_CRANK)
    return by_shortest[lengths.index(short)], margin


def overall_size(linkage: Linkage, limits: tuple[arb, arb] | None, name: str) -> Enclosure:
    """A side, or the area, of the box around the crank's circle, both ground pivots, and the arc of the rocker's joint.

    The limits are rocker angles of branch 1 in overlapped and extended position; None where the rocker turns.
    """
    if name not in ("envelope_width", "envelope_height", "footprint"):
        raise UnprovedError(f"{name} is a formula without a rigorous road")
    forward, backward, upward, downward = _reach(*limits) if limits else (arb(1),) * 4
    crank, _, rocker, ground = map(arb, linkage.lengths)
    width = crank.max(ground).max(ground + rocker * forward) + crank.max(rocker * backward - ground)
    height = crank.max(rocker * upward) + crank.max(rocker * downward)
    return Enclosure.of({"envelope_width": width, "envelope_height": height, "footprint": width * height}[name])


def _reach(overlapped: arb, extended: arb) -> tuple[arb, arb, arb, arb]:
    """How far a rocker of length 1 gets forwards, backwards, up and down; its angles are between 0 and pi."""
    sines, quarter = (extended.sin(), overlapped.sin()), arb.pi() / 2
    upward = sines[0].max(sines[1])
    if extended < quarter < overlapped:
        upward = arb(1)
    elif not (extended > quarter or overlapped < quarter):
        upward = upward.union(arb(1))
    return extended.cos(), -overlapped.cos(), upward, -sines[0].min(sines[1])
