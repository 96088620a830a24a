"""Dwells as targets: how far the output moves while the crank turns by an angle, or how long it rests."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from linkage_cases import FOUR_BAR
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar
from target_studies import study_of

import explore
from explore.base.compiling import LANES, as_argument, compiled
from explore.mechanisms.targets.dwell_errors.measuring import BEGIN, BEGIN_ERROR, N_MEASURES, VALUE, measure_dwells
from explore.mechanisms.targets.dwell_errors.travels import _fill_events
from explore.mechanisms.targets.path_errors.curve import CURVE_SIZE, ROWS_SIGNATURE
from explore.studies.request.names import find_mechanism

TABLES = Path(explore.__file__).parent / "data" / "linkages"
LENGTHS = {"crank": 30, "coupler": 100, "rocker": 80, "ground": 110}
#: Samples of a turn on the second road.
SAMPLES = 3600


def angle_of(value):
    return {"kind": "dwell", "angle": value}


def travel_of(value):
    return {"kind": "dwell", "travel": value}


def measure(mechanism, designs, target, **options):
    """The columns of a dwell of designs, and their status."""
    own = ["dwell_error" if "angle" in target else "dwell_angle", "dwell_start"]
    frame = explore.evaluate(mechanism, designs, target=target, metrics=own, **options)
    return *(frame[name].to_numpy() for name in own), frame["status"].to_numpy()


class Output:
    """The second road: the simulated output over two turns as a spline, its extremes the roots of its slope."""

    def __init__(self, mechanism, design, signal):
        angles = np.arange(SAMPLES + 1) * (360.0 / SAMPLES)
        values = explore.simulate(mechanism, design, angles=angles)[signal].to_numpy()
        if signal.endswith("angle"):
            values = np.degrees(np.unwrap(np.radians(values)))
        turns = [values[:-1] + k * (values[-1] - values[0]) for k in range(-1, 4)]
        whole = np.append(np.concatenate(turns), values[0] + 4.0 * (values[-1] - values[0]))
        self.spline = CubicSpline(np.arange(-SAMPLES, 4 * SAMPLES + 1) * (360.0 / SAMPLES), whole)
        self.extremes = self.spline.derivative().roots(extrapolate=False)
        self.size = np.abs(values).max()

    def travel(self, start, angle):
        """Largest less least place."""
        inside = self.extremes[(self.extremes > start) & (self.extremes < start + angle)]
        places = self.spline(np.r_[start, inside, start + angle])
        return places.max() - places.min()

    def least(self, angle, count=240):
        """The least travel of all starts."""
        starts = np.arange(count + 2) * (360.0 / count)
        travels = np.array([self.travel(start, angle) for start in starts])
        inner = 1 + np.flatnonzero((travels[1:-1] <= travels[:-2]) & (travels[1:-1] <= travels[2:]))
        found = [travels.min()]
        for k in inner[np.argsort(travels[inner])][:8]:
            step = 360.0 / count  # from the middle, because the method resolves 1.5e-8 of its variable
            least = minimize_scalar(lambda ahead, start=starts[k]: self.travel(start + ahead, angle),
                                    bounds=(-step, step), method="bounded", options={"xatol": 1e-10})  # fmt: skip
            found.append(least.fun)
        return min(found)


def table_designs(name, count, rng):
    """A table of the gallery, its output signal, and designs within the ranges of its study."""
    parameters = tomllib.loads((TABLES / f"{name}.toml").read_text())["parameters"]
    linkage = explore.load_linkage(TABLES / f"{name}.toml")
    designs = [
        {
            key: rng.uniform(entry["min"], entry["max"]) if isinstance(entry, dict) else entry
            for key, entry in parameters.items()
            if key != "speed"
        }
        for _ in range(count)
    ]  # fmt: skip
    return linkage, designs


@pytest.mark.parametrize(
    ("name", "signal"),
    [
        ("stephenson-3", "output_angle"),
        ("watt-2", "output_angle"),
        ("whitworth", "ram_position"),  # it turns back where its slot does
        ("scotch-yoke", "yoke_position"),
        ("elliptic-trammel", "side_position"),
        ("stephenson-3-far", "rocker_angle"),  # a group of four links
        ("jansen", "bar_h_angle"),
        ("oscillating-cylinder", "cylinder_position"),
    ],
)
def test_dwells_of_tables_are_those_of_the_simulated_output(name, signal):
    rng = np.random.default_rng(7)
    linkage, designs = table_designs(name, 6, rng)
    turning = [design for design in designs if explore.evaluate(linkage, design)["status"][0] == 1]
    assert len(turning) >= 2
    for design in turning[:2]:
        angle = rng.uniform(10, 330)
        value, start, status = (column[0] for column in measure(linkage, design, angle_of(angle)))
        assert status == 1
        output = Output(linkage, design, signal)
        # the spline of 3,600 samples has an error of the fourth power of its step, 1e-11 of the travel
        whole = output.travel(0.0, 360.0)
        assert value == pytest.approx(output.least(angle), abs=1e-9 * whole)
        assert value == pytest.approx(output.travel(start, angle), abs=1e-9 * whole)
        longest, start, _ = (column[0] for column in measure(linkage, design, travel_of(float(value))))
        assert output.travel(start, longest) == pytest.approx(value, abs=1e-9 * whole)
        assert longest >= angle - 1e-6
        assert output.least(longest + 1e-3) > value - 1e-9 * whole


@pytest.mark.parametrize("mechanism", ["crank-rocker", "slider-crank"])
def test_dwells_of_mechanisms_are_those_of_the_simulated_output(mechanism):
    rng = np.random.default_rng(3)
    signal = "rocker_angle" if mechanism == "crank-rocker" else "slider_position"
    lengths = LENGTHS if mechanism == "crank-rocker" else {"crank": 30, "rod": 80, "offset": 15}
    for _ in range(4):
        design = {name: value * rng.uniform(0.95, 1.05) for name, value in lengths.items()}
        output, angle = Output(mechanism, design, signal), rng.uniform(5, 350)
        value, start, _ = (column[0] for column in measure(mechanism, design, angle_of(angle)))
        assert value == pytest.approx(output.least(angle), abs=1e-9 * output.size)
        assert value == pytest.approx(output.travel(start, angle), abs=1e-9 * output.size)


def test_the_six_bar_of_the_documentation_rests_as_it_says():
    linkage = explore.load_linkage(TABLES / "stephenson-3.toml")
    design = {"r1": 30.69, "r2": 72.17, "r3": 101.35, "r4": 100, "rd": 132.72, "ad": -15.41, "l1": 86.27, "l2": 64.9}
    found = explore.evaluate(linkage, design, target=angle_of(90), metrics=["dwell_error", "output_angle_peak_to_peak"])
    assert found["dwell_error"][0] == pytest.approx(0.29, abs=0.005)
    assert found["output_angle_peak_to_peak"][0] == pytest.approx(66, abs=0.5)


def test_a_dwell_with_ripples_starts_in_the_middle_of_the_starts_that_serve_as_well():
    linkage = explore.load_linkage(TABLES / "stephenson-3.toml")
    design = {"r1": 30.69, "r2": 72.17, "r3": 101.35, "r4": 100, "rd": 132.72, "ad": -15.41, "l1": 86.27, "l2": 64.9}
    value, start, _ = (column[0] for column in measure(linkage, design, angle_of(80)))
    output = Output(linkage, design, "output_angle")
    serve = [other for other in np.arange(start - 30, start + 30, 0.01) if output.travel(other, 80) <= value + 1e-8]
    assert len(serve) > 100, "the extremes of the ripple are within all of these dwells"
    assert start == pytest.approx((serve[0] + serve[-1]) / 2, abs=0.01)


def test_a_centric_slider_crank_rests_longest_where_its_closed_form_says():
    """At the outer dead centre: s = r cos t + sqrt(l^2 - r^2 sin^2 t), even in t, falls from there."""
    r, rod, angle = 30.0, 100.0, 40.0
    half = np.radians(angle / 2)
    inner = r + rod - (r * np.cos(half) + np.sqrt(rod**2 - (r * np.sin(half)) ** 2))
    outer = (-r * np.cos(half) + np.sqrt(rod**2 - (r * np.sin(half)) ** 2)) - (rod - r)
    value, start, _ = measure("slider-crank", {"crank": r, "rod": rod}, angle_of(angle))
    assert value[0] == pytest.approx(min(inner, outer), rel=1e-11)
    assert start[0] == pytest.approx(180 - angle / 2, abs=1e-5)  # where both ends are equal
    longest, _, _ = measure("slider-crank", {"crank": r, "rod": rod}, travel_of(float(min(inner, outer))))
    assert longest[0] == pytest.approx(angle, rel=1e-10)


def test_a_link_that_turns_moves_on_in_each_turn():
    """The rocker of a double crank, whose travel of a turn is a turn."""
    lengths = {"crank": 70, "coupler": 100, "rocker": 80, "ground": 20}  # a double crank
    value, start, _ = (column[0] for column in measure("crank-rocker", lengths, angle_of(90.0)))
    output = Output("crank-rocker", lengths, "rocker_angle")
    assert output.spline(360.0) - output.spline(0.0) == pytest.approx(360.0)
    assert value == pytest.approx(output.least(90.0), abs=1e-8)
    assert value == pytest.approx(output.travel(start, 90.0), abs=1e-8)
    longest, _, _ = measure("crank-rocker", lengths, travel_of(400.0))
    assert longest[0] == 360.0


@pytest.mark.parametrize("angle", [355.0, 358.7, 359.0, 359.5, 359.99])
def test_a_dwell_of_nearly_the_whole_turn_leaves_out_a_reversal(angle):
    """The valley of the travel over the start is as narrow as what is left of the turn: nothing between two starts."""
    rng = np.random.default_rng(4)
    for _ in range(3):
        design = {name: value * rng.uniform(0.95, 1.05) for name, value in LENGTHS.items()}
        output = Output("crank-rocker", design, "rocker_angle")
        least = output.travel(0.0, 360.0)
        for at in output.extremes[(output.extremes >= 0.0) & (output.extremes < 360.0)]:
            for ahead in np.linspace(0.0, 360.0 - angle, 2001):
                least = min(least, output.travel(at + ahead, angle))
        value, _, status = measure("crank-rocker", design, angle_of(angle))
        # of 2,001 starts the best is at most half a step away from that of the least travel
        assert (status[0], value[0]) == (1, pytest.approx(least, rel=1e-6))
        assert value[0] <= least * (1 + 1e-12)


def test_reversals_enter_and_leave_a_dwell_in_order_whatever_an_earlier_design_left():
    """The rows beyond the number of reversals are those of the design before, of which four were found."""
    reversals, angle = np.array([[0.5, 0.0], [3.0, 0.0], [2.0, 0.0], [6.2, 0.0]]), 1.0
    places = np.sort(np.concatenate([reversals[:2, 0], reversals[:2, 0] - angle]) % (2.0 * math.pi))
    events = np.full(6, np.nan)
    assert _fill_events((None, None, 0.0, reversals, 2), angle, events) == 5
    assert events[:5].tolist() == pytest.approx([*places, places[0] + 2.0 * math.pi], abs=1e-15)
    assert np.isnan(events[5])


def test_rests_of_small_travels_meet_the_tolerance():
    """The angle of a rest is relative to the turn; its bound follows from that of the travel, by the slope."""
    designs = {name: value * np.exp(np.random.default_rng(6).normal(0, 0.05, 200)) for name, value in LENGTHS.items()}
    for travel in (0.01, 0.1, 0.5, 5.0):
        longest, _, status = measure("crank-rocker", designs, travel_of(travel))
        assert np.isfinite(longest).sum() > 150
        assert (status[np.isfinite(longest)] == 1).all()
        least, _, _ = measure("crank-rocker", {k: v[:1] for k, v in designs.items()}, angle_of(float(longest[0])))
        assert least[0] == pytest.approx(travel, rel=1e-6)


def test_a_study_that_names_no_metrics_has_those_of_the_dwell():
    parameters = {"crank": [20, 30], "rod": 100}
    own = explore.Study(mechanism="slider-crank", target=angle_of(60), parameters=parameters)
    assert [f"{o.metric}:{o.sense}" for o in own.objectives][:2] == ["dwell_error:min", "stroke:max"]


def test_an_output_that_moves_less_than_the_travel_rests_over_the_whole_turn():
    longest, _, status = measure("crank-rocker", LENGTHS, travel_of(179.0))
    assert (longest[0], status[0]) == (360.0, 1)


def test_a_crank_that_does_not_turn_has_no_dwell():
    blocked = LENGTHS | {"crank": 90}
    value, start, status = measure("crank-rocker", blocked, angle_of(60.0))
    assert np.isnan([value[0], start[0]]).all()
    assert status[0] != 1
    table = explore.Linkage(FOUR_BAR | {"output": "rocker"})
    value, start, status = measure(table, {"r1": 90, "r2": 100, "r3": 80, "r4": 110}, angle_of(60.0))
    assert np.isnan([value[0], start[0]]).all()
    assert status[0] != 1


@compiled(ROWS_SIGNATURE)
def cosine_up_to(shapes, cosines, sines, count, out):
    """An output at the cosine of the input's angle, which is not defined where that is above a number."""
    for row in range(count):
        for lane in range(LANES):
            cosine, sine = cosines[row * LANES + lane], sines[row * LANES + lane]
            numbers = out[row * CURVE_SIZE * LANES + lane :]
            numbers[0], numbers[LANES] = cosine if cosine <= shapes[lane] else math.nan, 0.0
            numbers[2 * LANES], numbers[3 * LANES] = -sine, -cosine


def test_an_output_that_is_not_defined_at_an_angle_has_no_dwell():
    designs, angle = np.array([[1.0], [0.999], [-0.5], [math.nan]]), math.radians(50.0)
    value = 1.0 - math.cos(0.5 * angle)
    for asked, most, wanted in ((angle, 0.0, value), (0.0, value, angle)):
        measures = np.zeros((len(designs), N_MEASURES))
        measure_dwells(as_argument(cosine_up_to, ROWS_SIGNATURE), designs, False, asked, most, measures)
        assert measures[0, VALUE] == pytest.approx(wanted, rel=1e-9)
        assert np.isnan(measures[1:]).all()


@compiled(ROWS_SIGNATURE)
def bumps_between_rests(shapes, cosines, sines, count, out):
    """An output with three equal rests, at 0 but for a bump u^4 where u = cos 3t - c is positive."""
    for row in range(count):
        for lane in range(LANES):
            cosine, sine = cosines[row * LANES + lane], sines[row * LANES + lane]
            u = max(4.0 * cosine**3 - 3.0 * cosine - shapes[lane], 0.0)
            slope, bend = 3.0 * (4.0 * sine**3 - 3.0 * sine), -9.0 * (u + shapes[lane])
            numbers = out[row * CURVE_SIZE * LANES + lane :]
            numbers[0], numbers[LANES] = u**4, 0.0
            numbers[2 * LANES], numbers[3 * LANES] = 4.0 * u**3 * slope, 12.0 * (u * slope) ** 2 + 4.0 * u**3 * bend


def test_of_equal_rests_that_are_wider_than_what_is_between_them_one_has_the_dwell():
    c, angle, measures = 0.87, math.radians(0.5), np.zeros((1, N_MEASURES))
    measure_dwells(as_argument(bumps_between_rests, ROWS_SIGNATURE), np.array([[c]]), False, angle, 0.0, measures)
    third = 2.0 * math.pi / 3.0
    assert measures[0, VALUE] == 0.0
    assert measures[0, BEGIN] % third == pytest.approx(0.5 * (third - angle), abs=measures[0, BEGIN_ERROR])


def test_a_table_has_the_dwells_of_the_mechanism():
    rng = np.random.default_rng(5)
    designs = {name: value * np.exp(rng.normal(0, 0.08, 200)) for name, value in LENGTHS.items()}
    renamed = dict(zip(("r1", "r2", "r3", "r4"), (designs[name] for name in LENGTHS), strict=True))
    table = explore.Linkage(FOUR_BAR | {"output": "rocker"})
    for target in (angle_of(75.0), travel_of(0.5)):
        (own, _, built_in), (other, _, of_table) = (
            measure(mechanism, columns, target) for mechanism, columns in (("crank-rocker", designs), (table, renamed))
        )
        np.testing.assert_array_equal(np.isfinite(own), np.isfinite(other))
        np.testing.assert_array_equal(built_in == 1, of_table == 1)
        np.testing.assert_allclose(own, other, rtol=1e-9)


def test_travels_near_a_change_point_are_those_of_dense_samples():
    """The rocker turns quickly at a change point: the travel from the start that is found, by dense samples there."""
    rng = np.random.default_rng(8)
    for margin in (1e-2, 1e-4, 1e-6):
        a, b, c = rng.uniform(40, 100, 3)
        crank = min(a, b, c) * 0.5
        ordered = sorted((a, b, c))
        design = {"crank": crank, "coupler": ordered[0], "rocker": ordered[1],
                  "ground": ordered[0] + ordered[1] - crank - margin}  # fmt: skip
        value, start, status = (column[0] for column in measure("crank-rocker", design, angle_of(50.0)))
        assert status == 1
        angles = np.mod(start + np.linspace(0.0, 50.0, 100_001), 360.0)
        places = explore.simulate("crank-rocker", design, angles=angles)["rocker_angle"].to_numpy()
        # between two samples the rocker moves by up to 1e-7 of its travel more
        assert np.ptp(places) == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize("target", [angle_of(300), travel_of("20 deg")])
def test_the_figure_of_a_motion_shades_the_dwell(tmp_path, target):
    results = explore.sweep(study_of("dwell", target=target), tmp_path / "d.h5", workers=1)
    assert results.objectives[0] == ("dwell_angle:max" if "travel" in target else "dwell_error:min")
    row = results.design(int(explore.rank(results).index[0]))
    start, angle = row["dwell_start"], target.get("angle") or row["dwell_angle"]
    figure = explore.charts.motion_chart(results, design=int(explore.rank(results).index[0]))
    for axes in figure.axes:
        shaded = sorted((patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches)
        stop = start + angle
        parts = [(start, stop)] if stop <= 360 else [(0, stop - 360), (start, 360)]
        np.testing.assert_allclose(shaded, parts, rtol=1e-12)
    assert figure.axes[0].get_legend_handles_labels()[1][-1] == f"dwell, {angle:.4g}°"


def test_units_are_read():
    assert find_mechanism("crank-rocker", (), angle_of("1 rad")).target.angle == pytest.approx(np.degrees(1))
    assert find_mechanism("slider-crank", (), travel_of("1 in")).target.travel == pytest.approx(25.4)
