"""Windows to panels: they cover a window once, in the direction of the motion, and change where a law does."""

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from explore.evaluation.quadrature.panels import ANCHOR, FIRST, LAST, LAW, PANEL_CAPACITY, PANELS_SIZE
from explore.evaluation.quadrature.windows import (
    ARC,
    INTERVAL,
    LARGEST_TANGENT,
    LONGER,
    SHORTER,
    TURN,
    add_interval,
    add_window,
)

TURN_LENGTH = 2.0 * math.pi
NO_BREAKS = np.empty(0)
#: Half-tangents of positions all over the turn, and close to the anchor and its opposite.
positions = st.one_of(
    st.floats(-3.1, 3.1).map(lambda angle: math.tan(0.5 * angle)),
    st.tuples(st.sampled_from([-1.0, 1.0]), st.floats(-60.0, 60.0)).map(lambda pair: pair[0] * 2.0 ** pair[1]),
).filter(lambda tangent: tangent == 0.0 or abs(tangent) > 1e-300)  # smaller ones have no reciprocal


def panels_of(kind, start, stop, breaks=NO_BREAKS):
    """Panels of a window, a row each: anchor, first, last, law."""
    buffer = np.zeros(PANELS_SIZE)
    breaks = np.asarray(breaks, dtype=np.float64)
    if kind == INTERVAL:
        half_turns = round(start / math.pi)
        count = add_interval(
            buffer, 0, half_turns % 2, start - half_turns * math.pi, stop - start, breaks, len(breaks)
        )  # fmt: skip
    else:
        count = add_window(buffer, 0, kind, start, stop, breaks, len(breaks))
    return buffer.reshape(-1, PANEL_CAPACITY)[[row // PANEL_CAPACITY for row in (ANCHOR, FIRST, LAST, LAW)], :count].T


def angle(tangent):
    """Angle of a position from the anchor, from 0 to a full turn."""
    return (2.0 * math.atan(tangent)) % TURN_LENGTH


def forwards(start, stop):
    """Angle from one position forwards to another."""
    return (angle(stop) - angle(start)) % TURN_LENGTH


def distance(a, b):
    """Distance of two angles on the circle."""
    return abs((a - b + math.pi) % TURN_LENGTH - math.pi)


def assert_covers(panels, start, length, laws=None):
    """The panels follow one another from an angle on over a length; `laws` takes the angle and the law of a panel."""
    at = start
    for anchor, first, last, law in panels:
        assert anchor in (0.0, 1.0)
        assert first < last
        # from infinity a node would have no offset from the anchor
        assert -LARGEST_TANGENT <= first < last <= LARGEST_TANGENT
        begin, end = (anchor * math.pi + 2.0 * math.atan(tangent) for tangent in (first, last))
        assert distance(begin, at) < 1e-11
        at = end
        if laws is not None:
            laws(begin, 0.5 * (begin + end), law)
    total = sum(2.0 * (math.atan(last) - math.atan(first)) for _, first, last, _ in panels)
    assert total == pytest.approx(length, abs=1e-11)
    assert distance(at, start + length) < 1e-11


@settings(derandomize=True, deadline=None, max_examples=300)
@given(positions, positions)
def test_an_arc_runs_forwards_from_one_mark_to_the_other(start, stop):
    assume(distance(angle(start), angle(stop)) > 1e-6)
    panels = panels_of(ARC, start, stop)
    assert_covers(panels, angle(start), forwards(start, stop))
    assert len(panels) <= 4
    # the ends keep all digits: the offset from the nearer anchor is that of the mark
    for tangent, (anchor, *ends, _), end in ((start, panels[0], 0), (stop, panels[-1], 1)):
        # the mark is -1 over what it is from the opposite, rounded once each way
        assert ends[end] == pytest.approx(tangent if anchor == 0.0 else -1.0 / tangent, rel=3e-16, abs=0.0)


@settings(derandomize=True, deadline=None, max_examples=200)
@given(positions, positions)
@example(-1.0, -1.5)
@example(1.5, 1.0)
def test_the_longer_and_the_shorter_arc_are_the_turn(start, stop):
    length = forwards(start, stop)
    assume(1e-6 < length < TURN_LENGTH - 1e-6)
    longer, shorter = panels_of(LONGER, start, stop), panels_of(SHORTER, start, stop)
    from_start = length >= math.pi
    if abs(length - math.pi) < 1e-12:
        from_start = bool(distance(longer[0][0] * math.pi + 2.0 * math.atan(longer[0][1]), angle(start)) < 1e-11)
    ends = (start, stop) if from_start else (stop, start)
    assert_covers(longer, angle(ends[0]), forwards(*ends))
    assert_covers(shorter, angle(ends[1]), forwards(*ends[::-1]))


def test_equal_strokes_are_told_apart_by_their_marks():
    """Up to rounding, a tie: the second arc is then the longer one, and never both or neither."""
    for start in (0.3, -0.3, 5.0):
        for stop in (-1.0 / start, np.nextafter(-1.0 / start, 1.0), np.nextafter(-1.0 / start, -1.0)):
            longer, shorter = panels_of(LONGER, start, stop), panels_of(SHORTER, start, stop)
            assert_covers(longer, angle(stop), math.pi)
            assert_covers(shorter, angle(start), math.pi)


def law_at(breaks):
    """A check that the law of a panel is the number of the break before it."""

    def check(begin, middle, law):
        after = [(middle - angle(position)) % TURN_LENGTH for position in breaks]
        assert law == int(np.argmin(after)), (begin, middle)

    return check


def in_order(tangents):
    """Positions each forwards from the one before."""
    return sorted(tangents, key=lambda tangent: (angle(tangent) - angle(tangents[0])) % TURN_LENGTH)


def are_apart(tangents):
    """Whether no two of the positions are close."""
    return all(distance(angle(a), angle(b)) > 1e-6 for a, b in combinations(tangents, 2))


@settings(derandomize=True, deadline=None, max_examples=200)
@given(st.lists(positions, min_size=1, max_size=4))
def test_a_turn_is_cut_where_a_law_changes(breaks):
    assume(are_apart(breaks))
    breaks = in_order(breaks)
    panels = panels_of(TURN, 0.0, 0.0, breaks)
    assert_covers(panels, panels[0][0] * math.pi + 2.0 * math.atan(panels[0][1]), TURN_LENGTH, law_at(breaks))
    assert {int(law) for *_, law in panels} == set(range(len(breaks)))


def test_a_turn_without_laws_is_two_half_turns_about_the_anchors():
    assert panels_of(TURN, 0.0, 0.0).tolist() == [[0.0, -1.0, 1.0, 0.0], [1.0, -1.0, 1.0, 0.0]]


@settings(derandomize=True, deadline=None, max_examples=300)
@given(positions, positions, st.lists(positions, min_size=1, max_size=4))
def test_an_arc_is_cut_where_a_law_changes(start, stop, breaks):
    assume(are_apart([*breaks, start, stop]))
    breaks = in_order(breaks)
    panels = panels_of(ARC, start, stop, breaks)
    assert_covers(panels, angle(start), forwards(start, stop), law_at(breaks))


def test_an_arc_between_two_breaks_has_one_law():
    breaks = [-2.0, 0.7]
    for number, (start, stop) in enumerate((breaks, breaks[::-1])):
        panels = panels_of(ARC, start, stop, breaks)
        assert_covers(panels, angle(start), forwards(start, stop))
        assert {law for *_, law in panels} == {number}


@settings(derandomize=True, deadline=None, max_examples=300)
@given(
    st.floats(-4.0 * math.pi, 4.0 * math.pi), st.floats(1e-3, TURN_LENGTH), st.lists(positions, max_size=3),
    st.sampled_from([0.0, 0.5 * math.pi, math.pi]),
)  # fmt: skip
def test_an_interval_of_angles(start, length, breaks, grid):
    """Also intervals that begin and end at an anchor or a quarter turn from it."""
    if grid:
        start, length = grid * round(start / grid), grid * max(1, round(length / grid))
    ends = [math.tan(0.5 * end) if abs(end % TURN_LENGTH - math.pi) > 1e-9 else 1e16 for end in (start, start + length)]
    assume(are_apart(breaks) and all(distance(angle(b), angle(end)) > 1e-6 for b in breaks for end in ends))
    breaks = in_order(breaks) if breaks else breaks
    panels = panels_of(INTERVAL, start, start + length, breaks)
    assert_covers(panels, start, length, law_at(breaks) if breaks else None)
    assert len(panels) <= 4 + 3 * len(breaks)


def test_panels_are_appended():
    buffer = np.zeros(PANELS_SIZE)
    count = add_window(buffer, 0, TURN, 0.0, 0.0, NO_BREAKS, 0)
    again = add_window(buffer, count, ARC, -0.5, 0.25, NO_BREAKS, 0)
    rows = buffer.reshape(-1, PANEL_CAPACITY)[[row // PANEL_CAPACITY for row in (ANCHOR, FIRST, LAST)]]
    assert (count, again) == (2, 3)
    assert rows[:, :4].T.tolist() == [[0.0, -1.0, 1.0], [1.0, -1.0, 1.0], [0.0, -0.5, 0.25], [0.0, 0.0, 0.0]]
