"""Overall size of all mechanisms: the box of the formulas against that of all drawn points over a turn."""

import mpmath as mp
import numpy as np
import pytest

import explore
from explore.mechanisms.registry import MECHANISMS
from explore.mechanisms.rocking import NO_STROKE
from explore.model.drawing import Pose
from explore.model.status import Status
from explore.motions import mark_angles

RANDOM = np.random.default_rng(14)
COUNT = 60
STEP = 0.25
SIDES = ("envelope_width", "envelope_height")


def four_bars():
    """Linkages of any proportions; three of four cannot turn or rock."""
    lengths = np.exp(RANDOM.uniform(np.log(20.0), np.log(500.0), (4, 12 * COUNT)))
    return dict(zip(("crank", "coupler", "rocker", "ground"), lengths, strict=True))


def slider_cranks():
    crank = RANDOM.uniform(10.0, 200.0, COUNT)
    offset = crank * RANDOM.uniform(-3.0, 3.0, COUNT)
    return {"crank": crank, "rod": (crank + np.abs(offset)) * RANDOM.uniform(1.01, 6.0, COUNT), "offset": offset}


def variable_cranks():
    rod, speed = RANDOM.uniform(100.0, 800.0, COUNT), RANDOM.uniform(1.0, 20.0, COUNT)
    return {
        "rod": rod, "speed": speed, "slider_speed": rod * speed * RANDOM.uniform(0.02, 0.55, COUNT),
        "reversal_time": RANDOM.uniform(0.05, 2.5, COUNT) / speed, "blend_order": RANDOM.choice((1.0, 2.0, 3.0), COUNT),
    }  # fmt: skip


def gears():
    return {
        "growth": RANDOM.uniform(1.05, 1.6, COUNT), "sector": RANDOM.uniform(1.0, 5.0, COUNT),
        "centre_distance": RANDOM.uniform(50.0, 300.0, COUNT), "return_order": RANDOM.choice((0.0, 1.0, 2.0), COUNT),
    }  # fmt: skip


DRAWN = {
    "crank-rocker": lambda: four_bars() | {"branch": RANDOM.choice((1.0, -1.0), 12 * COUNT)},
    "test-rig": four_bars,
    "slider-crank": slider_cranks,
    "variable-crank": variable_cranks,
    "gears": gears,
}


def drawn_box(mechanism, design):
    """Sides of the box around all drawn points over a turn; bodies that turn steadily sweep circles."""
    columns = {name: np.array([value]) for name, value in design.items()}
    marks = list(mark_angles(mechanism, columns).values())
    angles = np.sort(np.concatenate([np.arange(0.0, 360.0, STEP), np.remainder(marks, 360.0)]))
    motion = explore.simulate(mechanism.name, design, angles=angles)
    pose = Pose.of(mechanism.signals, design, {name: motion[name].to_numpy() for name in motion}, angles)
    points = [pose.points(mechanism.drawing)[name] for name in mechanism.drawing.points]
    radii = [(centre, np.hypot(*pose.sum(profile.vectors).T).max()) for profile in mechanism.drawing.profiles
             for centre in [pose.points(mechanism.drawing)[profile.centre][0]]]  # fmt: skip
    if mechanism.name == "variable-crank":  # the disc
        radii.append((np.zeros(2), motion["crank"].max()))
    points += [centre + radius * np.array([side]) for centre, radius in radii for side in ((1, 1), (-1, -1))]
    everything = np.concatenate(points)
    return everything.max(axis=0) - everything.min(axis=0)


@pytest.mark.parametrize("name", DRAWN)
def test_the_box_is_that_of_all_drawn_points(name):
    mechanism, columns = MECHANISMS[name], DRAWN[name]()
    table = explore.evaluate(name, columns, metrics=[*SIDES, "footprint"], window="cycle", tolerance=1e-9)
    is_ok = table["status"] == Status.OK
    assert np.count_nonzero(is_ok) >= COUNT // 3
    # the crank of a test rig whose rocker turns does so too
    assert table.loc[~is_ok & (table["status"] != NO_STROKE), [*SIDES, "footprint"]].isna().all(axis=None)
    for k in np.flatnonzero(is_ok):
        design = {key: float(column[k]) for key, column in columns.items()}
        box, drawn = table.loc[k, list(SIDES)].to_numpy(dtype=float), drawn_box(mechanism, design)
        # an extreme between two samples exceeds both by at most an eighth of the step squared times a second
        # derivative, which is below a hundred sizes of the mechanism unless a mark is there
        resolution = 100.0 * np.deg2rad(STEP) ** 2 / 8.0 * box.max()
        assert (box >= drawn * (1.0 - 1e-13) - 1e-9 * (name == "variable-crank") * box).all(), design
        assert (box - drawn <= resolution).all(), design
        assert table.loc[k, "footprint"] == pytest.approx(box.prod(), rel=1e-15)


def test_the_height_of_flat_linkages():
    """Rockers near the line of the pivots, whose height is a small part of their length, to the last digits."""
    with mp.workdps(50):
        crank, coupler, rocker = (mp.mpf(10) ** -k for k in (6, 1, 2))
        lengths = [float(length) for length in (crank, coupler, rocker, coupler + rocker - 2 * crank)]
        a, b, c, d = map(mp.mpf, lengths)
        angles = [mp.acos((c**2 + d**2 - side**2) / (2 * c * d)) for side in (b - a, b + a)]
        expected = a + max(a, *(c * mp.sin(angle) for angle in angles))
        design = dict(zip(("crank", "coupler", "rocker", "ground"), lengths, strict=True))
        table = explore.evaluate("crank-rocker", design, metrics=["envelope_height", "footprint"])
        assert table["status"][0] == Status.OK
        assert expected < 0.1 * c
        assert table["envelope_height"][0] == pytest.approx(float(expected), rel=4e-16)
