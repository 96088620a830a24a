"""Loads that follow curves: values of SciPy, torques by virtual power, bounds beside integrals between all corners."""

import math
import tomllib
from itertools import pairwise

import numpy as np
import pytest
from linkage_cases import BOOM, BOOM_LENGTHS, CASES, values_of, with_loads
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

import explore
from explore import Linkage
from explore.base.errors import ConfigError
from explore.model.status import Status
from explore.service.job_files import read_job_file
from explore.studies.config.study_file import load_study

CASE = CASES["crank-shaper"]
VALUES = values_of(CASE) | {"speed": 2.0}
POINTS = [[-23.0, 0.0], [-13.0, 300.0], [12.0, 250.0], [40.0, 250.0], [122.0, 900.0], [123.0, -10.0], [162.0, 100.0]]
#: What curves of the shaper are over, as entries, with points that its places pass.
OVER = {
    "slot": ("ram", POINTS),
    "point": ({"point": "S", "along": [-3, 4]}, [[0.0, 2.0], [30.0, 800.0], [90.0, 0.0]]),
    "from_least": ("from_least", [[5.0, 0.0], [20.0, 700.0], [60.0, 0.0]]),
    "to_greatest": ("to_greatest", [[0.0, 500.0], [3.0, 900.0], [6.0, 0.0]]),
    "crank_angle": ("crank_angle", [[-30.0, 5.0], [40.0, 300.0], [200.0, -100.0], [330.0, 5.0]]),
}
SHAPES = ("linear", "cubic")


def curved(over, points, shape="linear", **changes):
    """The shaper with a force on its ram along the curve `cut`."""
    curve = {"over": over, "points": points, "shape": shape}
    return with_loads(CASE, {"forces": {"S": ["-cut", 0]}, "curves": {"cut": curve}} | changes)


def reference(points, shape):
    """The curve by SciPy."""
    x, y = np.array(points).T
    if shape == "linear":
        return lambda place: np.interp(place, x, y)
    cubic = PchipInterpolator(x, y)
    return lambda place: cubic(np.clip(place, x[0], x[-1]))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("over", OVER)
def test_curves_are_those_of_scipy_and_do_the_work_of_their_force(over, shape):
    """To 1e-14 of the largest value, as sums of all intervals are rounded; the torque by the velocity of the ram."""
    entry, points = OVER[over]
    angles = np.arange(0.0, 360.0, 0.5)
    motion = explore.simulate(curved(entry, points, shape), VALUES, angles=angles)
    place, value = motion["cut_place"].to_numpy(), motion["cut_value"].to_numpy()
    size = np.abs(points).max(axis=0)[1]
    assert value == pytest.approx(reference(points, shape)(place), abs=1e-14 * size * len(points))
    x, y = motion["S_x"].to_numpy(), motion["S_y"].to_numpy()
    expected = {
        "slot": x, "point": (4 * y - 3 * x) / 5, "from_least": x - x.min(), "to_greatest": x.max() - x,
        "crank_angle": np.where(angles > 330.0, angles - 360.0, angles),
    }[over]  # fmt: skip
    # the least and the greatest of 720 places are 0.001 mm from the ends of the stroke
    assert place == pytest.approx(expected, abs=2e-3 if "least" in over or "greatest" in over else 1e-12)
    work = value * motion["S_velocity_x"] / 2.0 / 1000.0
    assert motion["drive_torque"].to_numpy() == pytest.approx(work, abs=1e-15 * np.abs(work).max() * 10)


@pytest.mark.parametrize("seed", range(8))
def test_cubics_of_any_points_are_those_of_scipy(seed):
    """Two to nine points with equal and falling values, at which slopes are 0, and steps of any size."""
    rng = np.random.default_rng(seed)
    x = -30.0 + np.cumsum(10.0 ** rng.uniform(-2.0, 1.5, 2 + seed))
    points = np.stack([x, rng.integers(-3, 4, 2 + seed) * 100.0], axis=1).tolist()
    motion = explore.simulate(curved("ram", points, "cubic"), VALUES, angles=np.arange(0.0, 360.0, 1.0))
    value = reference(points, "cubic")(motion["cut_place"].to_numpy())
    assert motion["cut_value"].to_numpy() == pytest.approx(value, abs=1e-11)


class Shaper:
    """The ram of the shaper by the geometry of a triangle and a circle, in doubles."""

    def __init__(self, values):
        self.r, self.h, self.l, self.k, self.rise = (
            values[name] for name in ("crank", "height", "lever", "link", "rise")
        )

    def position(self, angle):
        x, y = self.r * np.cos(angle), self.h + self.r * np.sin(angle)
        d = np.hypot(x, y)
        return self.l * x / d + np.sqrt(self.k**2 - (self.rise + self.h - self.l * y / d) ** 2)

    def rate(self, angle):
        x, y = self.r * np.cos(angle), self.h + self.r * np.sin(angle)
        d = np.hypot(x, y)
        turning = (self.r**2 + self.r * self.h * np.sin(angle)) / d**2
        up, across = self.l * y / d, self.l * x / d
        below = self.rise + self.h - up
        return turning * (-up + below * across / np.sqrt(self.k**2 - below**2))

    def corners(self, levels):
        """Ascending crank angles of a turn at which the ram is at one of the levels, with both ends."""
        angles = np.linspace(-math.pi, math.pi, 2881)
        found = [-math.pi, math.pi]
        for level in levels:
            signs = self.position(angles) > level
            for k in np.flatnonzero(signs[1:] != signs[:-1]):
                found.append(
                    brentq(lambda t, level=level: self.position(t) - level, angles[k], angles[k + 1], xtol=1e-15)
                )
        return sorted(found)


def moments(shaper, curve, levels):
    """Mean and mean square of the torque over the turn, N m, by Gauss's rule in 8 parts between all corners."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    mean = square = 0.0
    for first, last in pairwise(shaper.corners(levels)):
        for low, high in pairwise(np.linspace(first, last, 9)):
            angles = low + (nodes + 1.0) * (high - low) / 2.0
            torque = curve(shaper.position(angles)) * shaper.rate(angles) / 1000.0
            mean += (weights * torque).sum() * (high - low) / 2.0
            square += (weights * torque**2).sum() * (high - low) / 2.0
    return mean / (2.0 * math.pi), square / (2.0 * math.pi)


def steep_curve(rng, least, stroke):
    """A curve of a press: points 0.001 mm to 10 mm apart somewhere in the stroke, at its ends too."""
    count = int(rng.integers(2, 9))
    steps = 10.0 ** rng.uniform(-3.0, 1.0, count)
    place = least + stroke * rng.choice([0.0, 1.0, rng.uniform()]) - steps.sum() * rng.uniform()
    return np.stack([place + np.cumsum(steps), rng.uniform(0.0, 1000.0, count)], axis=1).tolist()


@pytest.mark.parametrize(
    "seeds", [pytest.param(range(6), id="few"), pytest.param(range(6, 100), marks=pytest.mark.slow, id="many")]
)
def test_bounds_hold_between_all_corners(seeds):
    """Moments are within their bounds of those by Gauss's rule, which is rounded by 1e-13 beside steep corners."""
    worst = 0.0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        values = VALUES | {"crank": 50.0 * rng.uniform(0.5, 1.2), "link": 80.0 * rng.uniform(0.9, 2.0)}
        shaper, shape = Shaper(values), SHAPES[seed % 2]
        places = shaper.position(np.linspace(0.0, 2.0 * math.pi, 3601))
        points = steep_curve(rng, places.min(), np.ptp(places))
        # The force acts 30 deg off the ram's line, so that it has no potential.
        mean, square = moments(shaper, reference(points, shape), [x for x, _ in points])
        for tolerance in (1e-6, 1e-9, 1e-12):
            row = explore.evaluate(
                curved("ram", points, shape), values, metrics=["drive_torque_rms", "drive_torque_mean"],
                window="cycle", tolerance=tolerance,
            ).iloc[0]  # fmt: skip
            assert (row["status"] == Status.OK) == (row["error"] <= tolerance)
            rms = math.sqrt(square)
            errors = abs(row["drive_torque_rms"] - rms) / rms, abs(row["drive_torque_mean"] - mean) / rms
            worst = max(worst, (max(errors) - 1e-13) / row["error"])
            assert row["error"] < 1e-9 or tolerance > 1e-9, (seed, row["error"])
    assert worst <= 1.0


def area_below(points):
    """The area below a straight curve, N m."""
    return np.trapezoid(*np.array(points).T[::-1]) / 1000.0


def test_the_work_of_a_punch_is_the_area_below_its_curve():
    """In the last 5 mm of the forward stroke, over that stroke; the extreme beside the last corner."""
    points = [[0.0, 0.0], [0.5, 4000.0], [4.0, 3000.0], [5.0, 0.0]]
    linkage = curved("to_greatest", points)
    metrics = ["drive_torque_mean", "cut_value_max", "stroke", "time_ratio", "positive_work"]
    row = explore.evaluate(linkage, VALUES, metrics=metrics, window="forward", tolerance=1e-11).iloc[0]
    area = area_below(points)
    shares = np.array([row["time_ratio"], 1.0]) / (1.0 + row["time_ratio"]) * 2.0 * math.pi
    works = row["drive_torque_mean"] * shares
    assert min(abs(works / area - 1.0)) < 1e-11
    assert row["cut_value_max"] == pytest.approx(4000.0, rel=1e-12)


def test_a_force_gives_its_work_back_and_half_of_it_with_half_as_opposing_does_not():
    """The error of a work of nearly 0 is relative to the powers that cancel."""
    points = [[0.0, 0.0], [0.5, 4000.0], [4.0, 3000.0], [5.0, 0.0]]
    row = explore.evaluate(
        curved("to_greatest", points), VALUES, metrics=["net_work", "positive_work"], window="cycle"
    ).iloc[0]
    assert row["status"] == Status.OK
    assert abs(row["net_work"]) < row["error"] * 10.0 * row["positive_work"]  # rms of the power: below 10 means
    assert row["error"] < 1e-9
    halves = {"forces": {"S": ["-0.5 * cut", 0]}, "opposing": {"ram": "0.5 * cut"}}
    row = explore.evaluate(curved("to_greatest", points, **halves), VALUES, metrics=["net_work"], window="cycle").iloc[
        0
    ]
    assert row["status"] == Status.OK
    assert row["net_work"] == pytest.approx(area_below(points), rel=row["error"] + 1e-12)


def test_curves_of_an_output_link_and_of_a_range_are_in_degrees():
    """From the least angle of the output; over crank angles of a driver that does not turn, constant outside."""
    case = CASES["watt-2"]
    curve = {"over": "from_least", "points": [[0, 3], [10, 5], [20, 4]]}
    linkage = with_loads(case, {"torques": {"output": "cut"}, "curves": {"cut": curve}})
    motion = explore.simulate(linkage, values_of(case), angles=np.arange(0.0, 360.0, 0.5))
    swing = motion["output_angle"] - motion["output_angle"].min()
    assert motion["cut_place"].to_numpy() == pytest.approx(swing, abs=1e-3)
    assert motion["cut_value"].to_numpy() == pytest.approx(np.interp(motion["cut_place"], [0, 10, 20], [3, 5, 4]))
    content = curved("ram", POINTS).content | {"range": [-170, 100]}
    content["loads"]["curves"]["cut"] = {"over": "crank_angle", "points": [[-20, 0], [10, 90]]}
    motion = explore.simulate(Linkage(content), VALUES, angles=[-170.0, -20.0, -5.0, 10.0, 100.0])
    assert motion["cut_value"].to_numpy() == pytest.approx([0.0, 0.0, 45.0, 90.0, 90.0], abs=1e-13)


def test_an_output_without_two_strokes_has_no_ends_to_measure_from():
    case = CASES["toggle-press"]
    curve = {"over": "to_greatest", "points": [[0, 3], [10, 5]]}
    linkage = with_loads(case, {"forces": {"S": [0, "cut"]}, "curves": {"cut": curve}})
    row = explore.evaluate(linkage, values_of(case), metrics=["drive_torque_mean"], window="cycle")
    assert row.attrs["labels"]["status"][row["status"].iloc[0]] == "no_strokes"
    curve = {"over": "ram", "points": [[150, 0], [165, 5000]]}
    linkage = with_loads(case, {"forces": {"S": [0, "cut"]}, "curves": {"cut": curve}})
    row = explore.evaluate(linkage, values_of(case), metrics=["drive_torque_max"], window="cycle").iloc[0]
    assert row["status"] == Status.OK


def test_more_points_than_places_of_a_panel():
    """A curve of 150 points is passed 300 times in a turn."""
    x = np.linspace(-20.0, 160.0, 150)
    points = np.stack([x, 500.0 + 300.0 * np.sin(x / 9.0)], axis=1).tolist()
    row = explore.evaluate(curved("ram", points), VALUES, metrics=["drive_torque_rms"], window="cycle").iloc[0]
    _, square = moments(Shaper(VALUES), reference(points, "linear"), x)
    assert row["status"] == Status.OK
    assert row["drive_torque_rms"] == pytest.approx(math.sqrt(square), rel=row["error"] + 1e-13)


def test_an_output_that_is_misspelt_says_nothing_of_the_units_of_a_curve(tmp_path):
    (tmp_path / "cut.csv").write_text("place [mm],value\n0,0\n5,900\n")
    points = [[0, 0], [5, 900]]
    text = curved("to_greatest", points).to_toml().replace('output = "ram"', 'output = "Ram"')
    assert f"points = {points}" in text
    (tmp_path / "table.toml").write_text(text.replace(f"points = {points}", 'file = "cut.csv"'))
    with pytest.raises(ConfigError) as caught:
        explore.load_linkage(tmp_path / "table.toml")
    assert str(caught.value).count("\n") == 0
    assert "did you mean 'ram'?" in str(caught.value)


def test_a_file_of_a_curve_travels_in_the_study(tmp_path):
    """Units of its heading count; the text of the study has the points, and reads without the file."""
    rows = "place [cm], value\n-2.3, 0\n" + "\n".join(f"{x / 10}, {y}" for x, y in POINTS[1:])
    (tmp_path / "cut.csv").write_text(rows)
    content = (
        curved("ram", POINTS, "cubic").to_toml().replace(f"points = {POINTS}".replace(".0", ""), 'file = "cut.csv"')
    )
    assert 'file = "cut.csv"' in content
    study = (
        'mechanism = "linkage"\n# a comment\n[evaluate]\nmetrics = ["drive_torque_max"]\n[parameters]\n'
        + "".join(f"{name} = {value}\n" for name, value in VALUES.items())
        + content
    )
    (tmp_path / "study.toml").write_text(study)
    loaded = load_study(tmp_path / "study.toml")
    assert loaded.linkage == curved("ram", POINTS, "cubic")
    (tmp_path / "cut.csv").unlink()
    text = loaded.to_toml()
    assert "# a comment" in text
    assert "cut.csv" not in text
    (tmp_path / "again.toml").write_text(text)
    assert load_study(tmp_path / "again.toml") == loaded
    with pytest.raises(ConfigError, match=r"cut\.file: a server reads no file of a curve"):
        read_job_file("job", study.encode())


def test_the_content_of_curves_describes_them():
    for over, points in OVER.values():
        linkage = curved(over, points, "cubic")
        assert Linkage(linkage.content) == linkage == Linkage(tomllib.loads(linkage.to_toml()))


PROBLEMS = {
    "no file": ({"cut": {"over": "ram", "file": "none.csv"}}, "cut.file: no such file: "),
    "both": ({"cut": {"over": "ram", "file": "a", "points": POINTS}}, "cut: has both points and a file; leave one out"),
    "neither": ({"cut": {"over": "ram"}}, "cut: has no points; a complete one is "),
    "one point": ({"cut": {"over": "ram", "points": [[0, 1]]}}, "cut.points: has 1 points; write two or more"),
    "order": (
        {"cut": {"over": "ram", "points": [[0, 1], [0, 2]]}},
        "cut.points: places must ascend, and point 2 is at 0 after 0",
    ),
    "pair": (
        {"cut": {"over": "ram", "points": [[0, 1], 3]}}, "cut.points: point 2 must be a pair [place, value], got 3"
    ),
    "turn": (
        {"cut": {"over": "crank_angle", "points": [[0, 1], [90, 2]]}},
        "cut: the crank turns fully, and the points span 90 deg; write them for 360 deg",
    ),
    "ends": (
        {"cut": {"over": "crank_angle", "points": [[0, 1], [360, 2]]}},
        "cut: 0 and 360 deg are the same angle, with the values 1 and 2",
    ),
    "over": ({"cut": {"over": "rom", "points": POINTS}}, "cut.over: unknown slot or way, or a point such as "),
    "direction": (
        {"cut": {"over": {"point": "S", "along": [0, 0]}, "points": POINTS}}, "cut.over.along: has no direction"
    ),
    "shape": ({"cut": {"over": "ram", "points": POINTS, "shape": "cubik"}}, "cut.shape: unknown shape 'cubik'"),
    "unused": (
        {"cut": {"over": "ram", "points": POINTS}, "rest": {"over": "ram", "points": POINTS}},
        "rest: no load uses it; write its name in one",
    ),
    "name": ({"cut": {"over": "ram", "points": POINTS}, "D": {"over": "ram", "points": POINTS}}, "D: D is the name of"),
    "many": (
        {f"c{k}": {"over": "ram", "points": [[x, 1] for x in range(101)]} for k in range(2)} | {"cut": None},
        ": have 202 points together; at most 200 are possible",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("curves", "problem"), PROBLEMS.values(), ids=PROBLEMS)
def test_curves_with_mistakes_are_refused(curves, problem):
    with pytest.raises(ConfigError) as error:
        with_loads(CASE, {"forces": {"S": ["-cut", 0]}, "curves": curves})
    assert any(
        line.startswith(f"linkage.loads.curves{'' if problem[0] == ':' else '.'}{problem}")
        for line in str(error.value).splitlines()
    )


@pytest.mark.parametrize(
    ("loads", "problem"),
    [
        ({"masses": {"S": "cut"}}, "masses.S: cut is a curve, which only forces, torques, opposing can have"),
        ({"forces": {"S": ["1 / cut", 0]}}, "forces.S: with the curve cut only numbers, parameters and + - * are"),
        ({"opposing": {"ram": "cut"}}, "opposing.ram: must not be negative, and a curve is -10 at its lowest"),
    ],
)
def test_loads_that_cannot_have_a_curve_are_refused(loads, problem):
    with pytest.raises(ConfigError) as error:
        with_loads(CASE, loads | {"curves": {"cut": {"over": "ram", "points": POINTS}}})
    assert f"linkage.loads.{problem}" in str(error.value)


@pytest.mark.parametrize("window", [{"from": 170, "to": 180}, {"from": 180, "to": 190}, {"from": 0, "to": 180}])
def test_extremes_at_the_ends_of_a_window_have_their_rounding(window):
    """A stop that begins where the travel of a driven pin ends: its force there is 0, by rounding 1e-7 of 5 kN."""
    signals, found = ("P_force_on_boom_x", "P_force_on_boom_y", "drive_force"), []
    for force in (5000.0, 0.0):
        curve = {"over": "cylinder", "points": [[110, 0], [110.0001, force]]}
        loads = {"forces": {"P": ["stop", "-2 * stop"]}, "masses": {"P": 1.0}, "gravity": [0, -9.81]}
        linkage = Linkage(BOOM | {"output": "boom", "loads": loads | {"curves": {"stop": curve}}})
        metrics = [f"{signal}_{end}" for signal in signals for end in ("min", "max")]
        found.append(explore.evaluate(linkage, BOOM_LENGTHS, metrics=metrics, window=window).iloc[0])
    row, true = found
    for signal in signals:
        size = max(abs(true[f"{signal}_min"]), abs(true[f"{signal}_max"]))
        for end in ("min", "max"):
            assert abs(row[f"{signal}_{end}"] - true[f"{signal}_{end}"]) <= row["error"] * size, signal
