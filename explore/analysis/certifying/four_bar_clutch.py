"""The output of several four-bars through one-way clutches: the largest of the rocker velocities, or rest.

On the drive stroke the velocity rises to one peak and falls; that there is one only is proved by counting the zeros of
the acceleration. Then the velocity and the same a period later, 2 pi/z, are equal at one angle before the peak, and
from there the output follows one rocker for a period; where a stroke is shorter than a period it rests in between.
"""

from __future__ import annotations

from flint import arb, ctx

from explore.analysis.certifying.balls import UndecidedError
from explore.analysis.certifying.four_bar_extremes import positions_at, turning_points_of_velocity
from explore.analysis.certifying.four_bar_motion import ROCKER, Linkage
from explore.analysis.certifying.positions import Arc, Position, real_roots


def peak(linkage: Linkage, stroke: Arc) -> arb:
    """The angle in a stroke where the rocker is fastest, between the angles of the stroke's ends."""
    peaks = []
    for cosine in real_roots(turning_points_of_velocity(linkage, ROCKER)):
        for position, state in positions_at(linkage, cosine):
            if linkage.acceleration(ROCKER, state).contains(0) and stroke.holds(position.angle):
                turns = ((stroke.start.angle - position.angle) / (2 * arb.pi())).ceil()
                peaks.append(position.angle + 2 * arb.pi() * turns)
    if len(peaks) != 1:
        raise UndecidedError
    return peaks[0]


def driven_arc(linkage: Linkage, stroke: Arc, period: arb) -> Arc:
    """The part of the drive stroke in which one rocker drives the output: a period, or all of a shorter stroke."""
    if stroke.length < period:
        return stroke
    if not stroke.length > period:
        raise UndecidedError
    at_peak = peak(linkage, stroke)
    low, high = stroke.start.angle.max(at_peak - period), (stroke.stop.angle - period).min(at_peak)
    for _ in range(ctx.prec):
        middle = ((low + high) / 2).mid()
        gain = abs(_speed(linkage, middle + period)) - abs(_speed(linkage, middle))
        if gain > 0:
            low = middle
        elif gain < 0:
            high = middle
        else:
            break
    crossing = low.union(high)
    return Arc(Position.at_angle(crossing), Position.at_angle(crossing + period))


def _speed(linkage: Linkage, angle: arb) -> arb:
    return linkage.velocity(ROCKER, linkage.at(Position.at_angle(angle)))
