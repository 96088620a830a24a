"""Generations of designs on problems whose fronts are known exactly."""

import dataclasses
import math

import moocore
import numpy as np
import pytest

from explore.analysis.refining.coordinates import Coordinates
from explore.analysis.refining.generations import NO_PARENT, PARENT, Generations
from explore.analysis.refining.members import Members, best_of, contributions, thinned
from explore.model.request import Objective
from explore.results.ranking.pareto import find_front, is_nondominated, objectives_to_minimise
from explore.studies.designs.spaces import ContinuousAxis, ListedAxis, SpacedAxis

OBJECTIVES = tuple(Objective(name, "min") for name in "xyz")
CUBE = Coordinates(tuple(ContinuousAxis(name, 0.0, 1.0) for name in "xyz"), (), {})


def sphere(columns):
    """Minimise x, y and z outside the unit sphere: the front is its octant."""
    margins = columns["x"] ** 2 + columns["y"] ** 2 + columns["z"] ** 2 - 1.0
    return {**columns, "margin": margins, "feasible": (margins >= 0.0).astype(np.int8)}


def start_of(evaluate, coordinates, objectives, n=200):
    generator = np.random.default_rng(5)
    positions = generator.random((n, len(coordinates.ranges)))
    choices = generator.integers([len(axis) for axis in coordinates.lists], size=(n, len(coordinates.lists)))
    columns = evaluate(coordinates.columns(positions, choices))
    rows = find_front([columns | {"design": np.arange(n)}], objectives)
    return {name: values[rows] for name, values in columns.items()}


def sphere_generations(start=None, **options):
    start = start_of(sphere, CUBE, OBJECTIVES) if start is None else start
    settings = {"n_designs": 20_000, "size": 2000, "seed": 1} | options
    return Generations(CUBE, OBJECTIVES, ["margin"], start, **settings)


def run(generations, evaluate=sphere):
    """The columns of each generation."""
    history = []
    while generations.number < generations.count:
        draw = generations.draw()
        history.append(evaluate(draw.columns) | {PARENT: draw.parents})
        generations.include(history[-1])
    return history


def hypervolume(columns, objectives=OBJECTIVES, reference=(1.0, 1.0, 1.0)):
    values = objectives_to_minimise(columns, objectives)[columns["feasible"] != 0]
    return moocore.hypervolume(values, ref=np.array(reference))


def joined(history):
    return {name: np.concatenate([columns[name] for columns in history]) for name in history[0]}


def test_the_octant_of_a_sphere_is_covered():
    # The exact hypervolume is that of the cube outside the sphere. A front of n points leaves out a layer as thick as
    # their distance, of the order of 1 / sqrt(n): with some 6000 points on it 2 to 3 % of 0.476.
    history = run(sphere_generations())
    exact = 1.0 - math.pi / 6.0
    volume = hypervolume(joined(history))
    assert 0.965 * exact < volume < exact
    uniform = sphere(CUBE.columns(np.random.default_rng(1).random((20_000, 3)), np.zeros((20_000, 0), dtype=np.int64)))
    assert hypervolume(uniform) < 0.95 * exact


def test_most_designs_are_almost_on_the_constraint():
    columns = run(sphere_generations())[-1]
    # 0.41 are; of steps in all directions 0.33, and without coming back 0.08.
    assert np.mean(np.abs(columns["margin"]) < 1e-3) > 0.36
    assert np.mean(columns["feasible"]) > 0.5


def test_the_start_comes_first_as_it_is():
    start = start_of(sphere, CUBE, OBJECTIVES)
    columns = joined(run(sphere_generations(start, n_designs=1000, size=17)))  # the start fills two generations
    n = len(start["x"])
    assert n > 17
    for name in "xyz":
        assert np.array_equal(columns[name][:n], start[name])
    assert (columns[PARENT][:n] == NO_PARENT).all()
    assert (columns[PARENT][n:] >= 0).all()
    assert (columns[PARENT][n:] < np.arange(n, 1000)).all()


def test_equal_seeds_draw_equal_designs():
    first, second, other = (run(sphere_generations(seed=seed, n_designs=6000))[-1] for seed in (1, 1, 2))
    assert all(np.array_equal(first[name], second[name]) for name in first)
    assert not np.array_equal(first["x"], other["x"])


def test_steps_differ_between_generations():
    generations = sphere_generations()
    undefined = {"margin": np.full(2000, np.nan), "feasible": np.zeros(2000, dtype=np.int8)}
    draws = []
    for _ in range(2):
        draws.append(generations.draw())
        generations.include(draws[-1].columns | undefined | {PARENT: draws[-1].parents})
    first, second = (draw.columns["x"][draw.parents != NO_PARENT] for draw in draws)
    inside = second[(second > 0.0) & (second < 1.0)]
    assert len(inside) > 1000
    assert not np.isin(inside, first).any()


def test_a_design_comes_back_twice_at_most():
    generations = sphere_generations()
    n_back = []
    for _ in range(5):
        draw = generations.draw()
        n_back.append(len(generations._outside.returns))
        # All designs break the constraint by as much, wherever they are.
        outside = {"margin": np.full(2000, -0.5), "feasible": np.zeros(2000, dtype=np.int8)}
        generations.include(draw.columns | outside | {PARENT: draw.parents})
    n_start = np.count_nonzero(sphere_generations().draw().parents == NO_PARENT)
    assert n_back == [0, 2000 - n_start, 2000, n_start, 2000 - n_start]


@pytest.mark.parametrize("stop", [1, 4])
def test_generations_go_on_from_evaluated_ones_bit_by_bit(stop):
    history = run(sphere_generations())
    resumed = sphere_generations()
    for columns in history[:stop]:
        resumed.include(columns)
    for expected, columns in zip(history[stop:], run(resumed), strict=True):
        assert all(np.array_equal(columns[name], expected[name]) for name in expected)


def test_the_last_generation_may_be_short():
    history = run(sphere_generations(n_designs=4100))
    assert [len(columns["x"]) for columns in history] == [2000, 2000, 100]


def test_a_front_of_one_design_grows():
    start = {name: np.array([value]) for name, value in (("x", 0.9), ("y", 0.9), ("z", 0.9), ("margin", 1.43))}
    assert hypervolume(joined(run(sphere_generations(start)))) > 0.9 * (1.0 - math.pi / 6.0)


def test_an_infeasible_generation_leaves_the_front():
    generations = sphere_generations()
    before = generations.front
    columns = sphere(generations.draw().columns)
    undefined = {"margin": np.full(2000, np.nan), "feasible": np.zeros(2000, dtype=np.int8)}
    generations.include(columns | undefined | {PARENT: generations.draw().parents})
    assert np.array_equal(generations.front.designs, before.designs)
    assert len(generations.draw().parents) == 2000


def mixed(columns):
    """A cheaper and a better material, a thickness over four decades and a fixed load: the front joins both."""
    strength = np.where(columns["material"] == 7.0, 2.0, 1.0) * columns["thickness"]
    price = columns["material"] * columns["thickness"] + 1e-3 * columns["load"] + (columns["turns"] - 3.0) ** 2
    return {**columns, "strength": strength, "price": price, "feasible": np.ones(len(price), dtype=np.int8)}


def test_listed_values_and_ranges_are_kept():
    axes = (
        ContinuousAxis("thickness", 0.01, 100.0, log=True),
        ListedAxis("material", (7.0, 2.5)),
        SpacedAxis("turns", 1.0, 5.0, 5),
        SpacedAxis("width", 2.0, 3.0, 5),
        ListedAxis("load", (40.0,)),
    )
    coordinates = Coordinates.over(axes, ["turns"])
    assert [axis.name for axis in coordinates.ranges] == ["thickness", "width"]
    assert coordinates.fixed == {"load": 40.0}
    objectives = Objective("strength", "max"), Objective("price", "min")
    start = start_of(mixed, coordinates, objectives, n=20)
    generations = Generations(coordinates, objectives, [], start, n_designs=3000, size=500, seed=1)
    columns = joined(run(generations, mixed))
    assert set(columns["material"]) == {2.5, 7.0}
    assert set(columns["turns"]) <= {1.0, 2.0, 3.0, 4.0, 5.0}
    assert ((columns["thickness"] >= 0.01) & (columns["thickness"] <= 100.0)).all()
    assert ((columns["width"] >= 2.0) & (columns["width"] <= 3.0)).all()
    assert len(set(columns["width"])) > 1000  # between the values of the grid too
    assert (columns["load"] == 40.0).all()
    best = {name: values[-500:] for name, values in columns.items()}
    # Per unit of strength the first material costs 2.5, the second 3.5: three turns of the first are optimal, and of
    # the second where the first is at its thickest.
    assert np.mean((best["turns"] == 3.0) | (best["thickness"] < 1.0)) > 0.5
    assert columns["strength"].max() == pytest.approx(200.0)


def test_coordinates_are_read_back_exactly():
    axes = ContinuousAxis("a", 2.0, 8.0), ContinuousAxis("b", 0.01, 100.0, log=True), ListedAxis("c", (5.0, -1.0, 2.0))
    coordinates = Coordinates.over(axes, ())
    generator = np.random.default_rng(1)
    positions, choices = generator.random((50, 2)), generator.integers(3, size=(50, 1))
    columns = coordinates.columns(positions, choices)
    assert np.array_equal(coordinates.choices(columns), choices)
    # One rounding in the value and one in the position, each of half a unit of a number below 10.
    assert coordinates.positions(columns) == pytest.approx(positions, abs=4e-15)


def members_of(values):
    n = len(values)
    return Members(
        np.arange(n), np.zeros((n, 1)), np.zeros((n, 0), dtype=np.int64), values, np.zeros((n, 0)), np.zeros((n, 0, 1))
    )


@pytest.mark.parametrize("n_objectives", [2, 3, 6])
def test_thinning_keeps_the_ends_and_spreads(n_objectives):
    points = np.random.default_rng(2).random((3000, n_objectives))
    front = best_of(members_of(points / np.linalg.norm(points, axis=1, keepdims=True)))
    few = thinned(front, 300)
    assert len(few) <= 300 + n_objectives
    assert {*front.values.argmin(axis=0)} <= {*np.flatnonzero(np.isin(front.designs, few.designs))}
    assert is_nondominated(few.values).all()
    if n_objectives == 2:
        gaps = np.diff(np.sort(few.values[:, 0]))
        assert gaps.max() < 6 * np.median(gaps)


def test_the_first_of_equal_designs_is_kept():
    values = np.array([[1.0, 2.0], [0.0, 3.0], [1.0, 2.0], [2.0, 2.0]])
    assert best_of(members_of(values)).designs.tolist() == [0, 1]


def test_contributions_are_those_of_the_hypervolume():
    values = np.array([[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]])
    # Scaled 0 to 1 with the reference point (1.1, 1.1): the ends add 0.5 x 0.1, the middle 0.5 x 0.5.
    assert contributions(members_of(values)) == pytest.approx([0.05, 0.25, 0.05], rel=1e-12)
    four = np.column_stack([values, values])
    assert contributions(members_of(four)) == pytest.approx([4.0, 1.0, 4.0])  # to the farthest of two neighbours


def test_members_are_joined_field_by_field():
    one, two = members_of(np.array([[1.0, 2.0]])), members_of(np.array([[3.0, 1.0], [4.0, 0.0]]))
    assert all(len(getattr(one.join(two), field.name)) == 3 for field in dataclasses.fields(Members))
