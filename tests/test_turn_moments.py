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
