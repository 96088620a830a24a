"""Loops of any table: their chains, against the graph that solves the table step by step, and the exact motion."""

import numpy as np
import pytest
from few_methods import only
from loop_cases import designs_of_linkage, largest_gap

from explore import Linkage
from explore.base.errors import RequestError
from explore.comparison.limits import designs_towards, find_limit
from explore.comparison.methods.closed_form import ClosedForm, find_sides, geometric_outcome
from explore.comparison.methods.contract import Level, Outcome, Task
from explore.comparison.methods.design_equations import DesignEquations
from explore.comparison.methods.elimination import solve
from explore.comparison.methods.loop import whole_motion
from explore.comparison.methods.loops import find_loop
from explore.comparison.methods.newton import Newton
from explore.comparison.methods.newton_compiled import CompiledNewton
from explore.comparison.methods.registry import methods_for
from explore.comparison.methods.runge_kutta import RungeKutta4
from explore.comparison.reference import exact_motion
from explore.comparison.reference_statistics import exact_statistics
from explore.comparison.stability import map_stability, stability_case
from explore.comparison.verdicts import Verdict, judge, signal_errors
from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms.linkages.declaration import linkage_mechanism
from explore.studies.config.study_file import linkage_starters
from explore.studies.request.requests import make_request

#: Linkages of each kind of joint, drive and number of chains.
FEW = ("crank-shaper", "cylinder-boom", "elliptic-trammel", "jansen", "scotch-yoke", "watt-2", "whitworth")


def motion_of(name, count=13, level=Level.ACCELERATIONS):
    """A task over the whole motion of a design of a classic linkage that has one."""
    designs = designs_of_linkage(name)
    first, span = whole_motion(designs.loop)
    task = designs.task(np.tile(first + np.linspace(0.0, span, count), (len(designs), 1)), level)
    moves = np.flatnonzero(geometric_outcome(task) == Outcome.OK)
    return task.part(moves[:1])


@pytest.mark.parametrize("name", list(linkage_starters()))
def test_the_graph_closes_the_chains_and_so_do_its_derivatives(name):
    """Two roads that share the table alone: places step by step, and all chains at once."""
    task = motion_of(name)
    loop, signals = task.loop, ClosedForm().solve(task).signals
    assert loop.count == 2 * len(loop.chains)
    assert (largest_gap(task, signals) <= 2e-14 * task.size[:, None]).all(), "rounding of a dozen operations"
    again = np.empty_like(signals)
    loop.fill_signals(again, task.upright, task.crank_angle, signals[: loop.count])
    for k in (1, 2):
        rows = slice(k * loop.count, (k + 1) * loop.count)
        peak = np.abs(signals[rows]).max()
        # the rounding of the places, by the condition of the matrix, which is at most 1e4 on these designs
        assert np.abs(again[rows] - signals[rows]).max() <= 1e-11 * peak
    about = loop.about(task.upright, task.crank_angle, signals[: loop.count])
    assert (solve(about.columns, about.gap)[1] * find_sides(task) > 0.0).all(), "one assembly"


@pytest.mark.parametrize("name", FEW)
def test_the_exact_motion_agrees_with_the_graph_and_newton_with_both(name):
    task = motion_of(name)
    exact = exact_motion(task)
    assert signal_errors(task, ClosedForm().solve(task).signals, exact).max() < 1e-11
    for newton in (Newton(1e-13), CompiledNewton(1e-13)):
        motion = newton.solve(task)
        assert motion.outcome.tolist() == [Outcome.OK]
        assert signal_errors(task, motion.signals, exact).max() < 1e-9
    assert signal_errors(task, RungeKutta4(720).solve(task).signals, exact).max() < 1e-6


@pytest.mark.parametrize("name", FEW)
def test_compiled_rates_of_one_design_are_those_of_its_graph(name):
    task = motion_of(name)
    design, count = DesignEquations(task.loop, task.parameters[0]), task.loop.count
    signals = ClosedForm().solve(task).signals[:, 0]
    rates = [design.rates(*at) for at in zip(task.crank_angle[0], signals[:count].T, strict=True)]
    # the rounding of the places, by the condition of the matrix, which is at most 1e4 on these designs
    assert np.abs(np.transpose(rates) - signals[count : 2 * count]).max() <= 1e-11 * np.abs(signals[count:]).max()
    with pytest.raises(FloatingPointError, match="not finite"):
        design.rates(np.nan, np.full(count, np.nan))


def test_elimination_of_arrays_and_of_numbers_is_that_of_linear_algebra():
    rng = np.random.default_rng(5)
    columns = rng.normal(size=(6, 3, 4)) + 1j * rng.normal(size=(6, 3, 4))
    right = rng.normal(size=(3, 4)) + 1j * rng.normal(size=(3, 4))
    columns[0, 0] = 0.0  # a pivot must be found further down
    unknowns, determinant = solve([list(column) for column in columns], list(right))
    for k in range(4):
        matrix = np.stack([columns[:, :, k].real.T, columns[:, :, k].imag.T], axis=1).reshape(6, 6)
        sides = np.stack([right[:, k].real, right[:, k].imag], axis=1).ravel()
        assert [x[k] for x in unknowns] == pytest.approx(np.linalg.solve(matrix, sides), rel=1e-11)
        assert determinant[k] == pytest.approx(np.linalg.det(matrix), rel=1e-11)
        one, value = solve(columns[:, :, k].tolist(), right[:, k].tolist())
        assert one == pytest.approx([x[k] for x in unknowns], rel=1e-11)
        assert value == pytest.approx(determinant[k], rel=1e-11)


@pytest.mark.parametrize("name", ["watt-2", "crank-shaper"])
def test_a_limit_is_that_of_the_last_double_with_a_motion(name):
    task = motion_of(name, 2)
    limit = find_limit(task.loop, task.parameters[0])
    margins, parameters = designs_towards(task.loop, limit)
    assert (np.diff(margins) < 0.0).all()
    beside = np.tile(limit.design, (2, 1))
    beside[:, limit.column] = limit.value, np.nextafter(limit.value, limit.design[limit.column])
    assert (geometric_outcome(Task(task.loop, beside, np.zeros((2, 1)))) == Outcome.OK).tolist() == [False, True]
    moves = geometric_outcome(Task(task.loop, parameters, np.zeros((len(margins), 1)))) == Outcome.OK
    assert np.array_equal(moves, margins > 0.0)
    assert margins[margins > 0.0].min() < 1e-13


def test_a_design_without_a_motion_has_no_limit():
    task = motion_of("watt-2", 2)
    design = task.parameters[0].copy()
    design[task.loop.parameters.index(find_limit(task.loop, design).name)] *= 3.0
    with pytest.raises(RequestError, match="the design has no motion to begin with"):
        find_limit(task.loop, design)


@pytest.mark.parametrize(
    ("rod", "unit", "start", "limit", "shown"),
    [
        ("share * r + 3", "1", 1.0, 0.85, "0.85, over that value"),
        ("400 * sin(share) - 180", "deg", 31.0, 30.0, "30 deg, over that value"),
    ],
)
def test_a_distance_of_what_is_no_length_is_not_over_a_length(rod, unit, start, limit, shown):
    """A rod that has to be as long as the crank."""
    content = {
        "driver": "crank", "frame": {"O": [0, 0]},
        "links": {"crank": {"O": 0, "A": "r"}, "rod": {"A": 0, "B": rod}},
        "slots": {"ram": {"pin": "B", "link": "frame", "along": ["O", [1, 0]]}}, "branch": {"B": "far"},
        "parameters": {"share": {"unit": unit}},
    }  # fmt: skip
    case = stability_case(linkage_mechanism(Linkage(content).table), {"r": 20.0, "share": start})
    assert case.distance == f"distance of share from {shown}"
    shares = case.parameters[:, case.loop.parameters.index("share")]
    assert case.margin == pytest.approx(shares / limit - 1.0, abs=1e-14)  # what sin, 400 times larger, rounds to


def test_the_map_of_a_table_shows_where_newton_fails_and_that_blocked_designs_are_rejected():
    designs, task = designs_of_linkage("watt-2"), motion_of("watt-2", 2)
    with only("closed-form", "newton-compiled"):
        case = stability_case(designs.mechanism, task.loop.columns(task.parameters[0]))
        rows = map_stability(case, 1e-6)
    tolerance = 1e-12
    settings = ("closed-form", f"newton-compiled(tolerance={tolerance:g})")
    finest = [row for row in rows if row["angles"] == 72 and row["setting"] in settings]
    # At the limit, and beyond it by less, the gap of the loops is within Newton's tolerance.
    least = {"closed-form": 0.0, "newton-compiled": -tolerance}
    rejects = [row for row in finest if row["margin"] <= least[row["method"]]]
    assert {row["verdict"] for row in rejects} == {Verdict.REJECTED.label}
    near = {row["method"]: row["verdict"] for row in finest if row["margin"] == case.margin[case.margin > 0.0].min()}
    assert near["newton-compiled"] != Verdict.ACCURATE.label
    accurate = [row["margin"] for row in finest if row["method"] == "closed-form" and row["verdict"] == "accurate"]
    assert min(accurate) < 1e-11


def test_methods_of_a_triangle_are_those_of_a_four_bar_wherever_it_is():
    """pump-jack is a four-bar with its ground line at an angle; a shaper has two chains."""
    assert {"textbook", "circles"} <= methods_for(designs_of_linkage("pump-jack").loop).keys()
    assert not {"textbook", "circles"} & methods_for(designs_of_linkage("crank-shaper").loop).keys()
    assert "textbook" not in methods_for(designs_of_linkage("scotch-yoke").loop)


def test_exact_statistics_of_a_table_are_those_of_the_quadrature():
    designs = designs_of_linkage("crank-shaper").part(np.arange(1))
    statistics = exact_statistics(designs, "drive")[:, :, 0]
    names = [f"ram_velocity_{statistic}" for statistic in ("mean", "variance", "cv", "min", "max")]
    request = make_request(designs.mechanism, metrics=names, window="drive", drive="slow", tolerance=1e-11)
    columns = evaluate_columns(request, {**designs.columns, "speed": np.ones(1)}).columns
    # the tolerance, of the mean relative to the root mean square
    assert [columns[name][0] for name in names] == pytest.approx(statistics[1], rel=3e-11)


@pytest.mark.parametrize("line", [[1, 0], [3, 2]])
def test_a_link_that_does_not_turn_is_accurate(line):
    """A ram with two pins in one line, whose rates are 0."""
    content = {
        "driver": "crank", "frame": {"O": [0, 0]},
        "links": {"crank": {"O": 0, "A": "r"}, "rod": {"A": 0, "B": "l"}, "ram": {"B": 0, "C": "w"}},
        "slots": {name: {"pin": pin, "link": "frame", "along": ["O", line]} for name, pin in (("g", "B"), ("h", "C"))},
        "branch": {"B": "far", "C": "far"},
    }  # fmt: skip
    loop = find_loop(linkage_mechanism(Linkage(content).table))
    design = {"r": 30.0, "l": 100.0, "w": 40.0}
    task = Task(loop, np.array([[design[name] for name in loop.parameters]]), np.linspace(0.2, 6.0, 9)[None])
    judgement = judge(task, Newton(1e-13).solve(task), exact_motion(task), 1e-11)
    assert judgement.verdict.tolist() == [Verdict.ACCURATE]
