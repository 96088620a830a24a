"""Means and variances over the turn of four-bars in tables, in closed form: equal to those of the crank-rocker."""

import numpy as np
import pytest
from linkage_cases import CASES, FOUR_BAR, linkage_of, scattered

import explore

METRICS = [f"{link}_velocity_{part}" for link in ("coupler", "rocker") for part in ("mean", "variance", "rms", "std")]
#: Ordinary ones, beside change points, beside a kite, with a tiny crank, and a double crank.
LENGTHS = np.array([
    (30.0, 90.0, 70.0, 100.0), (66.0, 1083.4, 540.0, 680.0), (100.0, 300.0, 250.0, 450.0 - 1e-6),
    (100.0, 300.0, 250.0, 350.0 - 1e-3), (1e-3, 90.0, 70.0, 100.0), (100.0, 200.0, 200.0 + 1e-6, 150.0),
    (100.0, 120.0, 110.0, 60.0),
])  # fmt: skip
#: Places of the frame's pin and of the crank's.
LAYOUTS = [
    (["r4", 0], ["r1", 0]), (["-r4", 0], ["r1", 0]), ([0, "r4"], [0, "-r1"]), ([0, "-r4"], ["r1", 0]),
]  # fmt: skip


def four_bar(ground, crank, *, side="left"):
    table = FOUR_BAR | {"frame": {"O": [0, 0], "C": ground}}
    links = FOUR_BAR["links"] | {"crank": {"O": 0, "A": crank}}
    if side == "right":  # joints are solved from the frame on, with the rocker first
        links = {name: links[name] for name in ("rocker", "coupler", "crank")}
    return explore.Linkage(table | {"links": links, "branch": {"B": f"{side} of A C"}})


def designs_of(lengths):
    return {f"r{k + 1}": lengths[:, k] for k in range(4)}


def crank_rocker(lengths):
    names = ("crank", "coupler", "rocker", "ground")
    return explore.evaluate("crank-rocker", dict(zip(names, lengths.T, strict=True)), metrics=METRICS, window="cycle")


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(("ground", "crank"), LAYOUTS)
def test_they_are_those_of_the_crank_rocker(ground, crank, side):
    own = explore.evaluate(four_bar(ground, crank, side=side), designs_of(LENGTHS), metrics=METRICS, window="cycle")
    other = crank_rocker(LENGTHS)
    assert (own["status"] == 1).all()
    # of a tiny crank and of a kite the terms cancel, a double crank has others: they are sampled, here as there
    is_known = np.array([True, True, True, True, False, False, False])
    assert (own["nodes"] == 0).tolist() == (other["nodes"] == 0).tolist() == is_known.tolist()
    for name in METRICS:
        scale = other[name.replace("mean", "rms")]
        allowed = own["error"] + other["error"]
        assert (np.abs(np.abs(own[name]) - np.abs(other[name])) <= allowed * scale).all(), name
    assert (own.loc[is_known, ["coupler_velocity_mean", "rocker_velocity_mean"]] == 0.0).all(axis=None)


def test_they_take_the_signs_of_lengths_and_one_link_alone():
    linkage, metrics = four_bar(["r4", 0], ["r1", 0]), ["rocker_velocity_variance"]
    (first,) = explore.evaluate(linkage, designs_of(LENGTHS[:1]), metrics=metrics, window="cycle")[metrics[0]]
    for signs in ((-1, 1, 1, 1), (1, -1, 1, 1), (1, 1, -1, 1), (1, 1, 1, -1)):
        row = explore.evaluate(linkage, designs_of(LENGTHS[:1] * signs), metrics=metrics, window="cycle").iloc[0]
        assert row["status"] == 1
        assert row["nodes"] == 0
        assert row[metrics[0]] == first


def test_they_are_those_of_samples_of_a_six_bar():
    """The first loop of a Watt II six-bar, without samples, and beside the output, which is sampled."""
    designs = scattered(CASES["watt-2"], 200, np.random.default_rng(4), 0.2)
    linkage, own = linkage_of(CASES["watt-2"]), ["rocker_velocity_variance"]
    alone = explore.evaluate(linkage, designs, metrics=own, window="cycle")
    beside = explore.evaluate(linkage, designs, metrics=[*own, "output_velocity_rms"], window="cycle", tolerance=1e-12)
    ok = beside["status"] == 1
    assert ok.sum() > 100
    assert (alone["nodes"][ok] == 0).all()
    difference = np.abs(alone[own[0]] / beside[own[0]] - 1.0)
    assert (difference <= alone["error"] + beside["error"])[ok].all()


def test_strokes_and_designs_that_a_constraint_screens_have_their_own():
    """Over a stroke they are sampled; over the turn a constraint on them needs no samples."""
    linkage, designs = four_bar(["r4", 0], ["r1", 0]), designs_of(LENGTHS[:2])
    stroke = explore.evaluate(linkage, designs, metrics=["rocker_velocity_rms"], window="drive")
    names = dict(zip(("crank", "coupler", "rocker", "ground"), LENGTHS[:2].T, strict=True))
    other = explore.evaluate("crank-rocker", names, metrics=["rocker_velocity_rms"], window="drive")
    assert stroke["rocker_velocity_rms"].to_list() == pytest.approx(other["rocker_velocity_rms"].to_list(), rel=1e-9)
    (least, largest) = sorted(crank_rocker(LENGTHS[:2])["rocker_velocity_rms"])
    limited = explore.evaluate(
        linkage, designs, metrics=["rocker_velocity_rms", "rocker_acceleration_peak"], window="cycle",
        constraints={"rocker_velocity_rms": {"max": 0.5 * (least + largest)}},
    )  # fmt: skip
    assert sorted(limited["feasible"]) == [False, True]
    assert (limited["nodes"] == 0).tolist() == (~limited["feasible"]).tolist()


def test_two_loops_on_one_driver_each_have_their_own():
    """About pins on both sides of a driver off the origin, one of them with lengths that are numbers."""
    table = {
        "driver": "crank",
        "frame": {"O": [10, 20], "C": ["10 + r4", 20], "E": [-90, 20]},
        "links": {
            "crank": {"O": 0, "A": "r1", "D": [0, 30]}, "rod": {"D": 0, "F": 90}, "lever": {"E": 0, "F": 70},
            "coupler": {"A": 0, "B": "r2"}, "rocker": {"C": 0, "B": "r3"},
        },
        "branch": {"B": "left of A C", "F": "right of D E"},
    }  # fmt: skip
    metrics = ["rod_velocity_std", "lever_velocity_std", "rocker_velocity_std"]
    row = explore.evaluate(explore.Linkage(table), designs_of(LENGTHS[1:2]), metrics=metrics, window="cycle").iloc[0]
    assert row["nodes"] == 0
    numbers, others = crank_rocker(LENGTHS[:1]).iloc[0], crank_rocker(LENGTHS[1:2]).iloc[0]
    expected = [numbers["coupler_velocity_std"], numbers["rocker_velocity_std"], others["rocker_velocity_std"]]
    assert row[metrics].to_list() == pytest.approx(expected, rel=1e-13)


def test_constants_that_are_rounded_are_within_the_bound():
    """0.4 - 0.1 and 0.5 are the ground and the coupler: the crank passes a change point by 1e-16; by mpmath."""
    table = FOUR_BAR | {"frame": {"O": [0.1, 0], "C": [0.4, 0]}}
    links = {"crank": {"O": 0, "A": 0.1}, "coupler": {"A": 0, "B": 0.5}, "rocker": {"C": 0, "B": "r3"}}
    linkage, name = explore.Linkage(table | {"links": links}), "rocker_velocity_variance"
    row = explore.evaluate(linkage, {"r3": 0.3 + 2.0**-54}, metrics=[name], window="cycle").iloc[0]
    assert row[name] == pytest.approx(0.43186436149, rel=row["error"] + 1e-11)
    assert row["error"] < 1e-9
