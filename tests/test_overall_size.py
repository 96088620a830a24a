"""Overall size of all mechanisms: the box of the formulas against that of all drawn points, also named ones."""

import mpmath as mp
import numpy as np
import pytest
from exact_points import path_of

import explore
from explore.mechanisms.registry import MECHANISMS
from explore.mechanisms.rocking import NO_STROKE
from explore.model.drawing import Pose
from explore.model.status import Status
from explore.running.motions import mark_angles

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
    places = {point: (design[f"{point}_along"], design[f"{point}_across"]) for point in mechanism.points}
    lengths = {name: value for name, value in design.items() if not name.startswith(mechanism.points or ("none",))}
    motion = explore.simulate(mechanism.name, lengths, angles=angles, points=places)
    pose = Pose.of(mechanism.signals, design, {name: motion[name].to_numpy() for name in motion}, angles)
    points = [pose.points(mechanism.drawing)[name] for name in mechanism.drawing.points]
    radii = [(centre, np.hypot(*pose.sum(profile.vectors).T).max()) for profile in mechanism.drawing.profiles
             for centre in [pose.points(mechanism.drawing)[profile.centre][0]]]  # fmt: skip
    if mechanism.name == "variable-crank":  # the disc
        radii.append((np.zeros(2), motion["crank"].max()))
    points += [centre + radius * np.array([side]) for centre, radius in radii for side in ((1, 1), (-1, -1))]
    everything = np.concatenate(points)
    return everything.max(axis=0) - everything.min(axis=0)


def with_arms(name, columns):
    """The mechanism with two points, and their places, up to twice as far from the crank's pin as any link is long."""
    points = ("arm", "knife")
    lengths = [column for key, column in columns.items() if key in ("crank", "coupler", "rod", "rocker", "ground")]
    reach = 2.0 * np.max(lengths, axis=0)
    places = {f"{point}_{side}": reach * RANDOM.uniform(-1.0, 1.0, len(reach)) for point in points
              for side in ("along", "across")}  # fmt: skip
    return MECHANISMS[name].with_points(points), columns | places


@pytest.mark.parametrize("with_points", [False, True])
@pytest.mark.parametrize("name", DRAWN)
def test_the_box_is_that_of_all_drawn_points(name, with_points):
    mechanism, columns = MECHANISMS[name], DRAWN[name]()
    if with_points and mechanism.floating_link is None:
        return
    if with_points:
        mechanism, columns = with_arms(name, columns)
    table = explore.evaluate(name, columns, metrics=[*SIDES, "footprint"], window="cycle", tolerance=1e-9,
                             points=mechanism.points)  # fmt: skip
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


#: Designs of each mechanism and branch with a point that goes beyond all links.
ARMS = [
    ("crank-rocker", {"crank": 30.0, "coupler": 95.0, "rocker": 70.0, "ground": 100.0}),
    ("crank-rocker", {"crank": 30.0, "coupler": 95.0, "rocker": 70.0, "ground": 100.0, "branch": -1.0}),
    ("test-rig", {"crank": 37.0, "coupler": 460.0, "rocker": 595.0, "ground": 751.0, "speed": 60.0}),
    ("slider-crank", {"crank": 100.0, "rod": 300.0, "offset": 40.0}),
    pytest.param("variable-crank", {"rod": 300.0, "slider_speed": 500.0, "speed": 6.0, "reversal_time": 0.06},
                 marks=pytest.mark.slow),
]  # fmt: skip


@pytest.mark.parametrize(("mechanism", "design"), ARMS)
def test_the_box_with_an_arm_is_that_of_forty_digits(mechanism, design):
    """Extremes of the paths of all joints and of the arm by search, within the bound that the row states."""
    link = design.get("coupler", design.get("rod"))
    length = 4.0 * max(link, design.get("ground", 0.0))
    arm = {"arm_along": 0.6 * length, "arm_across": -0.8 * length}
    row = explore.evaluate(mechanism, design | arm, metrics=[*SIDES, "footprint"], window="cycle", points="arm").iloc[0]
    assert row["status"] == Status.OK
    assert row["error"] <= 1e-9
    paths = [path_of(mechanism, design, *place) for place in ((0.0, 0.0), (link, 0.0), arm.values())]
    radius = largest(lambda angle: abs(paths[0](angle)))
    box = []
    for part, pivot in ((mp.re, design.get("ground", 0.0)), (mp.im, 0.0)):
        coordinates = [lambda angle, path=path, part=part: part(path(angle)) for path in paths]
        low = max(radius, -pivot, *(largest(lambda angle, line=line: -line(angle)) for line in coordinates))
        box.append(low + max(radius, pivot, *map(largest, coordinates)))
    # the bound of the area is the largest, and holds for the sides too; some roundings more
    for name, expected in zip((*SIDES, "footprint"), (*box, box[0] * box[1]), strict=True):
        assert abs(row[name] - expected) <= (row["error"] + 1e-15) * expected, name


def largest(function):
    """The largest value of a smooth periodic function, by golden-section search around the best of 90 samples."""
    step = mp.pi / 45
    best = max(range(90), key=lambda k: function(k * step)) * step
    low, high, ratio = best - step, best + step, (mp.sqrt(5) - 1) / 2
    for _ in range(45):
        width = ratio * (high - low)
        if function(high - width) > function(low + width):
            high = low + width
        else:
            low = high - width
    return function((low + high) / 2)
