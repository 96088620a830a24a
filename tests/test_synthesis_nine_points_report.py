"""All linkages through nine points, simulated: passages against a second simulation, and the sentence."""

import dataclasses
import re
from functools import cache

import numpy as np
import pytest
from stopping import interrupt
from synthesis_cases import SYMMETRIC, are_proved

from explore.base.errors import RequestError
from explore.synthesis.defects import PASSES, WRONG_ORDER
from explore.synthesis.linkages import FourBar, driven_by_rocker
from explore.synthesis.nine_points import homotopy
from explore.synthesis.nine_points.endgame import INFINITE, LOST, REGULAR
from explore.synthesis.nine_points.homotopy import Ends
from explore.synthesis.nine_points.report import find_linkages
from explore.synthesis.nine_points.solving import merge

CRANK_ROCKER = FourBar(0.2 + 0.1j, 4.1 + 0.4j, 1.0, 3.5, 2.5, 0.6 + 0.7j)
ANGLES = 0.3 + np.array([0.0, 0.5, 1.1, 1.8, 2.4, 3.1, 3.9, 4.6, 5.2])


@cache
def planted_report():
    return find_linkages(CRANK_ROCKER.points(ANGLES))


def is_same(one, other):
    return abs(one.crank_pivot - other.crank_pivot) + abs(one.rocker_pivot - other.rocker_pivot) < 1e-6


def points_of(found):
    """Where a linkage takes its coupler point at the angles of its passage, on either branch."""
    return [dataclasses.replace(found.linkage, branch=sign).points(found.passage.angles) for sign in (1, -1)]


def test_a_planted_crank_rocker_passes_in_order():
    points = CRANK_ROCKER.points(ANGLES)
    report = planted_report()
    assert report.is_complete
    assert are_proved(report.solutions.certificates)
    assert len(report.linkages) == 3 * len(report.solutions.real)
    (source,) = [each for each in report.linkages if is_same(each.linkage, CRANK_ROCKER)]
    assert source.passage.fate == PASSES
    assert source.is_proved
    assert sorted(each.cognate for each in report.linkages if each.solution == source.solution) == [0, 1, 2]
    # Those that pass come first, and simulated they do, at angles that go one way.
    n_passing = sum(each.passage.fate == PASSES for each in report.linkages)
    assert all(each.passage.fate == PASSES for each in report.linkages[:n_passing])
    for each in report.linkages[:n_passing]:
        steps = np.diff(each.passage.angles)
        assert (steps > 0).all() or (steps < 0).all()
        assert min(np.nanmax(np.abs(drawn - points)) for drawn in points_of(each)) < 1e-6
    assert f"{n_passing} of which take the points in order" in report.sentence
    assert report.sentence.startswith("Of 1,442 paths 1,442 lead to regular solutions, all proved.")


@pytest.mark.slow
def test_points_in_another_order():
    points = CRANK_ROCKER.points(ANGLES[[0, 2, 1, 3, 4, 5, 6, 7, 8]])
    report = find_linkages(points)
    (source,) = [each for each in report.linkages if is_same(each.linkage, CRANK_ROCKER)]
    assert source.passage.fate == WRONG_ORDER


def test_singular_linkages_are_reported_but_not_proved():
    report = find_linkages(SYMMETRIC)
    assert report.is_complete
    assert are_proved(report.solutions.certificates)
    unproved = [each for each in report.linkages if not each.is_proved]
    assert unproved
    # Their pivot is the point on the axis.
    for solution in {each.solution for each in unproved}:
        pivots = [each.linkage.crank_pivot for each in unproved if each.solution == solution]
        pivots += [each.linkage.rocker_pivot for each in unproved if each.solution == solution]
        assert np.abs(np.array(pivots) - 0.3).min() < 1e-4
    counts = [int(number.replace(",", "")) for number in re.findall(r"([\d,]+) (?:lead|to)", report.sentence)]
    assert sum(counts) == 1442


def test_the_sentence_says_what_is_lost_and_not_proved():
    report = planted_report()
    proofs = dataclasses.replace(report.solutions.certificates, is_proved=np.arange(1442) < 1440)
    partial = dataclasses.replace(report, solutions=dataclasses.replace(report.solutions, certificates=proofs))
    assert not partial.is_complete
    assert not are_proved(partial.solutions.certificates)
    assert partial.sentence.startswith(
        "Of 1,442 paths 1,440 lead to regular solutions, all proved; 2 are lost or lead to"
    )


def test_what_is_not_proved_is_not_counted_beside_what_is():
    """A start system that loses one path and ends another where no solution is, and one that finds all."""
    whole = planted_report().solutions
    ends = whole.solutions.copy()
    fates = np.full(1442, REGULAR)
    good = Ends(ends.copy(), fates.copy(), np.ones(1442, np.int64))
    ends[7] = [3e6, 2e6j, 5e6, 1e6, 4e6j, 3e6, 1e6j, 2e6]
    fates[9] = LOST
    bad = Ends(ends, fates, np.ones(1442, np.int64))
    both = merge([bad, good], CRANK_ROCKER.points(ANGLES), whole.size)
    assert len(both.solutions) == 1442
    assert both.is_complete
    alone = merge([bad], CRANK_ROCKER.points(ANGLES), whole.size)
    assert (alone.certificates.n_proved, alone.n_unproved, alone.n_lost) == (1440, 1, 2)
    assert not alone.is_complete
    # A path said to go to infinity leaves no room for the solution that the other system finds.
    wrong = dataclasses.replace(good, fates=np.where(np.arange(1442) == 9, INFINITE, REGULAR))
    contradicting = merge([wrong, good], CRANK_ROCKER.points(ANGLES), whole.size)
    assert contradicting.certificates.n_proved == 1442
    assert not contradicting.is_complete
    assert (
        "these are more than there are paths" in dataclasses.replace(planted_report(), solutions=contradicting).sentence
    )
    # Two paths that end at one solution hide that a path is lost.
    ends = good.solutions.copy()
    ends[3] = ends[4]
    twice = merge([Ends(ends, np.full(1442, REGULAR), good.windings)], CRANK_ROCKER.points(ANGLES), whole.size)
    assert (len(twice.solutions), twice.n_lost, twice.is_complete) == (1441, 1, False)


def test_a_linkage_driven_by_its_rocker_is_the_same():
    other = driven_by_rocker(CRANK_ROCKER)
    pins = CRANK_ROCKER.rocker_pins(ANGLES)
    angles = np.angle(pins - CRANK_ROCKER.rocker_pivot)
    drawn = [dataclasses.replace(other, branch=sign).points(angles) for sign in (1, -1)]
    errors = np.abs(np.array(drawn) - CRANK_ROCKER.points(ANGLES)).min(axis=0)
    assert errors.max() < 1e-12
    again = driven_by_rocker(other)
    assert again.lengths == CRANK_ROCKER.lengths
    assert again.point == pytest.approx(CRANK_ROCKER.point, rel=1e-15)


def test_points_that_determine_no_set():
    with pytest.raises(RequestError, match="points 2 and 9 are equal"):
        find_linkages(np.concatenate([SYMMETRIC[:8], SYMMETRIC[[1]]]))


def test_an_interrupted_search_keeps_what_was_found_and_says_how_far_it_is(monkeypatch):
    told = []
    monkeypatch.setattr(homotopy, "find_limits", interrupt)
    found = find_linkages(SYMMETRIC, lambda done, total: told.append((done, total)))
    assert found.solutions.is_interrupted
    assert not found.is_complete
    assert found.solutions.certificates.n_proved > 1300
    # Each of the proved ones was told, and none of the others, which the endgame would have found.
    assert told[-1][1] == 1442
    assert told[-1][0] == pytest.approx(found.solutions.certificates.n_proved, abs=3)
    assert found.linkages
