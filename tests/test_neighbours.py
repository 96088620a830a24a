"""No result depends on the neighbours of a design, its place in a block, or the metrics beside it: bit for bit."""

import numpy as np
import pandas as pd
import pytest

import explore
from explore.evaluation.quadrature.bounds import CHUNK
from explore.evaluation.quadrature.panels import PANEL_CAPACITY

COUNT = 2 * CHUNK + 137
MOMENTS = ["rocker_velocity_cv", "coupler_acceleration_std", "rocker_angle_mean"]
EXTREMES = ["rocker_acceleration_max", "coupler_velocity_min", "rocker_angle_peak_to_peak"]
FORCES = ["pin_force_peak", "pin_force_c_mean", "drive_torque_rms", "coupler_force_min", "velocity_thd"]


def crank_rockers():
    """Crank-rockers of both branches, and some that cannot turn or are no numbers."""
    rng = np.random.default_rng(7)
    designs = dict(zip(("crank", "coupler", "rocker", "ground"),
                       rng.uniform((40, 800, 300, 500), (220, 1200, 700, 900), (COUNT, 4)).T, strict=True))  # fmt: skip
    designs["coupler"][::97] = np.nan
    near = slice(5, None, 41)  # close to the change point: more nodes, and a second round
    designs["ground"][near] = (designs["crank"] + designs["coupler"] - designs["rocker"])[near] * (1.0 + 1e-9)
    return designs | {"branch": rng.choice([-1.0, 1.0], COUNT), "phases": rng.choice([1.0, 2.0, 3.0, 5.0], COUNT)}


def rigs():
    """Test rigs with all kinds of loads side by side, with and without masses."""
    rng = np.random.default_rng(8)
    designs = {"crank": rng.uniform(20, 60, COUNT), "coupler": rng.uniform(1000, 1400, COUNT),
               "rocker": rng.uniform(500, 700, COUNT), "ground": rng.uniform(700, 900, COUNT)}  # fmt: skip
    loads = {"opposing_torque": 5e3, "stiffness": 1e5, "damping": 100.0, "inertia": 8.0, "coupler_mass": 25.0}
    return designs | {name: size * rng.integers(0, 2, COUNT) for name, size in loads.items()} | {"constant_torque": 1e3}


CASES = [
    *[("crank-rocker", crank_rockers, [*MOMENTS, *EXTREMES], {"window": window}) for window in ("drive", "return")],
    ("crank-rocker", crank_rockers,
     ["rocker_acceleration_max", "coupler_acceleration_std", "rocker_angle_cv", "coupler_angle_variance"],
     {"window": "cycle"}),
    ("crank-rocker", crank_rockers, MOMENTS, {"window": {"from": -50.0, "to": 170.0}}),
    *[
        ("crank-rocker", crank_rockers, ["output_velocity_cv", "output_velocity_min"],
         {"window": "clutch", "drive": drive})
        for drive in ("slow", "extended_to_overlapped")
    ],
    ("test-rig", rigs, FORCES, {}),
]  # fmt: skip
CASES = [pytest.param(*case, id="-".join((case[0], *map(str, case[3].values())))) for case in CASES]


def evaluate(mechanism, designs, rows, metrics, options):
    """The table of some of the designs, numbered as in all of them."""
    table = explore.evaluate(mechanism, {n: np.asarray(v)[rows] if np.ndim(v) else v for n, v in designs.items()},
                             metrics=metrics, **options)  # fmt: skip
    return table.set_index(np.asarray(rows))


@pytest.mark.parametrize(("mechanism", "make", "metrics", "options"), CASES)
def test_neither_order_nor_neighbours_change_a_bit(mechanism, make, metrics, options):
    designs, every, rng = make(), np.arange(COUNT), np.random.default_rng(9)
    whole = evaluate(mechanism, designs, every, metrics, options)
    assert (whole["status"] == 1).sum() > COUNT // 3
    for rows in (rng.permutation(COUNT), every[::-1], rng.choice(COUNT, 19, replace=False), every[CHUNK - 1 :]):
        part = evaluate(mechanism, designs, rows, metrics, options)
        pd.testing.assert_frame_equal(part, whole.loc[rows], check_exact=True, check_names=False)


@pytest.mark.parametrize(("mechanism", "make", "metrics", "options"), CASES)
def test_a_design_alone_has_the_same_bits(mechanism, make, metrics, options):
    designs = make()
    rows = np.arange(40)
    together = evaluate(mechanism, designs, rows, metrics, options)
    alone = pd.concat([evaluate(mechanism, designs, rows[[k]], metrics, options) for k in rows])
    pd.testing.assert_frame_equal(alone, together, check_exact=True)


def test_blocks_of_three_have_the_same_bits():
    """Also in a window below 1 rad: loops over designs have code of their own for the last few."""
    designs, rows = crank_rockers(), np.arange(900)
    arguments = ["rocker_angle_cv", "coupler_angle_cv", "rocker_velocity_cv"], {"window": {"from": 31.0, "to": 47.0}}
    together = evaluate("crank-rocker", designs, rows, *arguments)
    parts = [evaluate("crank-rocker", designs, rows[k : k + 3], *arguments) for k in range(0, len(rows), 3)]
    pd.testing.assert_frame_equal(pd.concat(parts), together, check_exact=True)


def test_the_designs_fill_more_than_one_buffer_of_panels():
    """A turn of the test rig is cut at both limit positions, into at least two panels."""
    assert 2 * COUNT > PANEL_CAPACITY
    assert COUNT > CHUNK
