"""Linkages whose factors are first harmonics of the crank angle: decided by four values each, as by all nodes."""

import numpy as np
import pytest
from linkage_cases import CASES, FOUR_BAR, columns, linkage_of, scattered, trace

from explore import Linkage
from explore.mechanisms.linkages import declaration, kernel
from explore.mechanisms.linkages.programs import DISTANCE_ROW


def test_functions_of_a_dyad_on_the_driver_are_first_harmonics():
    for linkage in (Linkage(FOUR_BAR), linkage_of(CASES["slider-crank"])):
        assert {function.terms[0].order for function in kernel._functions(trace(linkage))} == {1.0}
    orders = [function.terms[0].order for function in kernel._functions(trace(linkage_of(CASES["watt-2"])))]
    assert set(orders) == {1.0, np.inf}  # those of the second dyad have roots in them
    x = trace(Linkage(FOUR_BAR)).points["A"][0].terms[0]
    assert [(x * x).order, (1.0 - x * x + x).order, (1.0 / x).order] == [2.0, 2.0, np.inf]


@pytest.fixture
def designs():
    """Four-bars beside their limits, some of which turn."""
    rng = np.random.default_rng(5)
    crank, coupler, ground = rng.uniform([[10.0], [20.0], [20.0]], [[30.0], [60.0], [60.0]], (3, 3000))
    limits = crank + coupler - ground, ground + coupler - crank, crank + ground - coupler
    limit = np.choose(rng.integers(3, size=3000), limits)
    rocker = np.abs(limit) * (1.0 + rng.choice([-1.0, 1.0], 3000) * 10.0 ** rng.uniform(-14.0, 0.0, 3000))
    return columns(Linkage(FOUR_BAR).mechanism, {"r1": crank, "r2": coupler, "r3": rocker, "r4": ground})


def _closed(designs, content=FOUR_BAR):
    mechanism = Linkage(content).mechanism.for_signals(("time_ratio",))
    closed = mechanism.evaluate_closed_form(designs)
    return closed.status, mechanism.constants(designs)[DISTANCE_ROW], closed.metrics


def _closed_as_any_functions(designs, monkeypatch, content=FOUR_BAR):
    """The same where nothing is told of first harmonics."""
    cached = declaration.linkage_mechanism, declaration._specialise
    for each in cached:
        each.cache_clear()
    with monkeypatch.context() as patch:
        patch.setattr(kernel, "_harmonics", lambda _functions: 0)
        result = _closed(designs, content)
    for each in cached:
        each.cache_clear()
    return result


def test_those_of_one_dyad_of_several_are_taken_as_they_are(monkeypatch):
    case = CASES["watt-2"]
    content = linkage_of(case).content
    designs = columns(Linkage(content).mechanism, scattered(case, 500, np.random.default_rng(2), 0.2))
    status, distance, _ = _closed(designs, content)
    other_status, other_distance, _ = _closed_as_any_functions(designs, monkeypatch, content)
    assert (status == other_status).all()
    turn = status == 1
    assert 100 < np.count_nonzero(turn) < 500
    # near is the second dyad, whose functions are none; the zeros of first harmonics have the digits of their slopes
    assert distance[turn] == pytest.approx(other_distance[turn], rel=1e-9)


def test_four_values_decide_as_all_nodes_do(designs, monkeypatch):
    status, distance, metrics = _closed(designs)
    other_status, other_distance, other_metrics = _closed_as_any_functions(designs, monkeypatch)
    assert 0.2 < np.mean(status == 1) < 0.8
    assert (status == other_status).all()
    assert (metrics[~np.isnan(metrics)] == other_metrics[~np.isnan(metrics)]).all()
    turn = status == 1
    assert distance[turn] == pytest.approx(other_distance[turn], rel=1e-12)


def test_no_design_depends_on_its_neighbours(designs):
    """Tiles in which all turn take the four values, others all nodes: each design has the same constants in both."""
    status, distance, _ = _closed(designs)
    turn = status == 1
    alone = _closed(np.ascontiguousarray(designs[:, turn]))
    assert (alone[0] == 1).all()
    assert (alone[1] == distance[turn]).all()
