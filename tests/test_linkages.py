"""Linkages of tables: motions, statistics and statuses against references of other roads."""

import math
import re
import tomllib

import mpmath
import numpy as np
import pytest
from linkage_cases import (
    CASES,
    FOUR_BAR,
    PARTIAL,
    REFERENCE,
    columns,
    dense,
    evaluate_graph,
    linkage_of,
    near_limits,
    rough_directions,
    scattered,
    trace,
    turns,
    values_of,
    wanted_statistics,
)

import explore
from explore import Linkage
from explore.base.errors import MotionError
from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms.linkages.metrics import REACH_NAMES
from explore.studies.request.requests import make_request

FULL = [name for name in CASES if name not in PARTIAL]
#: Those of the fast form: each kind of dyad, one or more of them.
FAST = ("slider-crank", "watt-2", "crank-shaper", "jansen", "oscillating-cylinder")


@pytest.mark.parametrize("name", CASES)
def test_places_and_rates_equal_the_reference(name):
    """To 1e-27 of the reference's 30 digits, as the graph is exact: points and slots at all its angles."""
    case = CASES[name]
    linkage = linkage_of(case)
    equations = trace(linkage)
    compared = 0
    # Decimals of the table, and sines of its angles, are doubles.
    has_doubles = re.search(r"\d\.\d|angle =", case["table"]) is not None
    digits = mpmath.mpf("1e-13" if has_doubles else "1e-27")
    with mpmath.workdps(40):
        for degrees, reference in case["at"].items():
            angle = mpmath.mpf(degrees) * mpmath.pi / 180
            numbers = {
                f"{point}_{word}{axis}": series.terms[order]
                for point, place in equations.points.items()
                for order, word in enumerate(("", "velocity_", "acceleration_"))
                for axis, series in zip("xy", place, strict=True)
            }
            for slot in equations.table.slots:
                words = ("position", "velocity", "acceleration")
                terms = equations.slot_position(slot).terms
                numbers |= {f"{slot.name}_{word}": term for word, term in zip(words, terms, strict=True)}
            numbers = {key: number for key, number in numbers.items() if key in reference}
            followed = rough_directions(linkage, values_of(case), angle)
            values = evaluate_graph(list(numbers.values()), case["parameters"], angle, followed=followed)
            for key, value in zip(numbers, values, strict=True):
                expected = mpmath.mpf(reference[key])
                assert abs(value - expected) <= digits * max(abs(expected), 100), (degrees, key)
                compared += 1
    assert compared >= 60


@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in FAST else pytest.mark.slow) for n in FULL])
def test_statistics_equal_the_reference(name):
    """Statistics over the turn to 1e-12 of the size of the signal."""
    case = CASES[name]
    linkage = linkage_of(case)
    wanted = wanted_statistics(linkage, case["turn"])
    row = explore.evaluate(linkage, values_of(case), metrics=list(wanted), window="cycle", tolerance=1e-12).iloc[0]
    for metric, (expected, size) in wanted.items():
        assert row[metric] == pytest.approx(expected, abs=1e-12 * size), metric


@pytest.mark.parametrize(("name", "columns"), [("crank-shaper", {"ram_position"}), ("whitworth", {"link_velocity"})])
def test_signals_of_a_simulation_equal_the_reference(name, columns):
    case = CASES[name]
    motion = explore.simulate(linkage_of(case), values_of(case), angles=[float(a) for a in case["at"]])
    for degrees, reference in case["at"].items():
        row = motion.loc[float(degrees)]
        for name, value in reference.items():
            if name in motion:
                assert row[name] == pytest.approx(float(value), rel=1e-12, abs=1e-11), (degrees, name)
    assert {"lever_angle", "S_transmission_angle", "D_curvature", *columns} <= set(motion)


def test_a_blocked_linkage_is_simulated_where_it_assembles():
    """A ram whose link reaches its line near the middle of the stroke: the lever's motion is that of a long link."""
    linkage, values = linkage_of(CASES["crank-shaper"]), values_of(CASES["crank-shaper"])
    angles, short = [80.0, 90.0, 100.0], values | {"link": 20.0}
    motion = explore.simulate(linkage, short, angles=angles)
    assert np.hypot(motion["S_x"] - motion["D_x"], motion["S_y"] - motion["D_y"]).to_numpy() == pytest.approx(20.0)
    whole = explore.simulate(linkage, values, angles=angles)
    assert motion["lever_acceleration"].equals(whole["lever_acceleration"])
    assert len(explore.simulate(linkage, short, angles=[85.0])) == 1
    with pytest.raises(MotionError, match=r"no motion from 90 to 180 deg: .* S is out of reach"):
        explore.simulate(linkage, short, angles=[90.0, 180.0])
    with pytest.raises(MotionError, match=r"no motion at 180 deg: .* S is out of reach"):
        explore.simulate(linkage, short, angles=[180.0])
    for whole_turn in (12, [80.0, 450.0]):
        with pytest.raises(MotionError, match=r"no full turn to simulate: .* S is out of reach"):
            explore.simulate(linkage, short, angles=whole_turn)
    at_zero = values | {"link": 15.0, "rise": 120.0}
    with pytest.raises(MotionError, match="no full turn"):
        explore.simulate(linkage, at_zero)
    assert np.isfinite(explore.simulate(linkage, at_zero, angles=[0.0])["S_x"]).all()


def _statuses():
    for name, topology in REFERENCE["statuses"]["topologies"].items():
        for number, entry in enumerate(topology["sets"]):
            yield pytest.param(topology, entry, id=f"{name}-{number}")


@pytest.mark.parametrize(("topology", "entry"), list(_statuses()))
def test_statuses_equal_the_reference(topology, entry):
    """With the intervals at which the joints of blocked ones assemble, to what rounding leaves beside narrow gaps.

    One set of 79 is blocked by 1.5e-6 rad, which is nearer than rounding tells: the status says that.
    """
    words = topology.get("branch", {}) | entry.get("branch", {})
    side = {joint: word.split(" (or ")[0] for joint, word in words.items()}
    linkage = _with_sides(topology["table"], side)
    kernel = linkage.mechanism.for_signals(REACH_NAMES)
    designs = {name: np.array([float(value)]) for name, value in entry["parameters"].items()}
    closed = kernel.evaluate_closed_form(columns(kernel, designs))
    label = kernel.status_labels[closed.status[0]]
    expected = {"turns": "ok", "change_point": "change_point_at_", "blocked": "crank_blocked_at_"}
    widths = [float(width) for width in entry.get("blocked_widths_rad", [])]
    is_near = entry["status"] == "blocked" and widths and max(widths) < 2e-6
    assert label.startswith(expected.get(entry["status"], "cannot_assemble")) or (
        is_near and label.startswith("change_point_at_")
    ), label
    count, *ends = closed.metrics[-len(REACH_NAMES) :, 0]
    if label.startswith("crank_blocked_at_"):
        found = list(zip(*[iter(ends[: 2 * int(count)])] * 2, strict=True))
        known = [(float(each["start_deg"]), float(each["end_deg"])) for each in entry["assembles_deg"]]
        if len(found) > len(known):  # two intervals of 0.003 deg are between the nodes of the reference
            islands = [each for each in found if each[1] - each[0] < 0.01]
            assert all(_assembles(linkage, entry["parameters"], sum(each) / 2.0) for each in islands)
            found = [each for each in found if each not in islands]
        error = np.deg2rad(np.abs(np.array(found) - np.array(known))).max()
        assert error <= 1e-12 + 2e-15 / min(widths)
    elif label in ("ok", "cannot_assemble"):
        assert count == (1 if label == "ok" else 0)


def _assembles(linkage, parameters, degrees):
    """Whether all factors are positive at a crank angle, with 30 digits."""
    with mpmath.workdps(30):
        factors = [factor.value.terms[0] for factor in trace(linkage).factors]
        return all(value > 0 for value in evaluate_graph(factors, parameters, mpmath.radians(degrees)))


def _with_sides(text, sides):
    """The linkage of a table whose joints are left or right as seen from the first to the second known point."""
    section = tomllib.loads(text)["linkage"]
    section.pop("sketch", None)
    branch = {joint: _words(section, joint, 1 if side == "left" else -1) for joint, side in sides.items()}
    return Linkage({**section, "branch": branch})


def _words(section, joint, sign):
    for slot in section.get("slots", {}).values():
        if slot["pin"] == joint:
            return "far" if sign > 0 else "near"
    centres = [
        next(point for point in points if point != joint) for points in section["links"].values() if joint in points
    ]
    return f"{'left' if sign > 0 else 'right'} of {centres[0]} {centres[1]}"


def test_a_four_bar_equals_the_crank_rocker_near_change_points_and_kites():
    """To 4e-15 of the largest value, as the hand-written kernel is: no digit is lost to the general form."""
    linkage = linkage_of(CASES["hoecken"])
    section = linkage.content | {"frame": {"O": [0, 0], "C": ["r4", 0]}}
    section["links"] = {
        "crank": {"O": 0, "A": "r1"}, "coupler": {"A": 0, "B": "r2"}, "rocker": {"C": 0, "B": "r3"},
    }  # fmt: skip
    four_bar = Linkage(section)
    angles = [0.0, 1e-7, 1e-3, 1.0, 40.0, 179.0, 180.0, 180.001, 250.0, 359.999999]
    rates = [f"{link}_{rate}" for link in ("coupler", "rocker") for rate in ("velocity", "acceleration")]
    for r1, r2, r3, r4 in (
        (66.0, 1083.4, 540.0, 680.0), (100.0, 300.0, 250.0, 300.0 + 250.0 - 100.0 - 1e-9), (1e-4, 90.0, 70.0, 100.0),
        (100.0, 200.0, 200.0 + 1e-9, 100.0 + 2e-9),
    ):  # fmt: skip
        own = explore.simulate(four_bar, {"r1": r1, "r2": r2, "r3": r3, "r4": r4}, angles=angles)
        lengths = {"crank": r1, "coupler": r2, "rocker": r3, "ground": r4, "branch": 1}
        other = explore.simulate("crank-rocker", lengths, angles=angles)
        for rate in rates:
            size = np.abs(other[rate]).max()
            assert np.abs(own[rate] - other[rate]).max() <= 4e-15 * size, (rate, r1, r2, r3, r4)


def _families(form):
    for name, share in (("watt-2", 0.25), ("crank-shaper", 0.25), ("slider-crank", 0.3), ("jansen", 0.12),
                        ("stephenson-3", 0.15), ("toggle-press", 0.15), ("wiper", 0.1), ("klann", 0.1),
                        ("whitworth", 0.2), ("oscillating-cylinder", 0.2), ("stephenson-2", 0.1)):  # fmt: skip
        for tolerance in (1e-6, 1e-9, 1e-12):
            is_fast = name in ("watt-2", "crank-shaper") and tolerance == 1e-9
            if (form == "fast") == is_fast:
                yield pytest.param(name, share, tolerance, marks=() if is_fast else pytest.mark.slow)


@pytest.mark.parametrize(("name", "share", "tolerance"), [*_families("fast"), *_families("slow")])
def test_bounds_hold(name, share, tolerance, request):
    """Means, variances and extremes of rates are within `error` of dense sampling, where that is exact enough."""
    is_slow = request.node.get_closest_marker("slow") is not None
    count, samples, rng = (1000, 16384, np.random.default_rng(7)) if is_slow else (60, 8192, np.random.default_rng(7))
    case, linkage = CASES[name], linkage_of(CASES[name])
    names = [s.name for s in linkage.mechanism.signals if s.name.endswith(("_velocity", "_acceleration"))]
    names = [each for each in names if not linkage.mechanism.signal(each).is_magnitude][:4]
    metrics = [f"{each}_{statistic}" for each in names for statistic in ("mean", "variance", "max")]
    made = make_request(linkage.mechanism, metrics=metrics, window="cycle", tolerance=tolerance)
    kernel = made.kernel
    designs = scattered(case, 4 * count, rng, share)
    families = [{key: column[turns(kernel, designs)][:count] for key, column in designs.items()}]
    families += [near for near in [near_limits(kernel, designs, count, rng)] if near]
    checked = above = 0
    for family in families:
        found = evaluate_columns(made, family).columns
        ok = np.isin(found["status"], (1, 7))
        fine, coarse = (dense(kernel, family, n) for n in (samples, samples // 2))
        rows = [kernel.signal(each).row for each in names]
        beyond = ok & (np.abs(_deviations(found, names, fine, rows)) > found["error"]).any(axis=(0, 1))
        if kernel.precise and beyond.any():  # by the rounding of the samples, it may be
            few = {key: column[beyond] for key, column in family.items()}
            for own, n in ((fine, samples), (coarse, samples // 2)):
                for statistics, others in zip(own, dense(kernel.precise, few, n), strict=True):
                    statistics[beyond] = others
        deviations = _deviations(found, names, fine, rows)
        assert np.isfinite(deviations[:, :, ok]).all()
        changes = np.abs(deviations - _deviations(found, names, coarse, rows))
        for each, row, both, changed in zip(names, rows, np.abs(deviations), changes, strict=True):
            peak = np.maximum(np.abs(fine[2][:, row]), np.abs(fine[3][:, row]))
            for statistic, error, change in zip(("mean", "variance"), both, changed, strict=True):
                sure = ok & (change < 0.1 * found["error"] + 1e-15)
                checked, above = checked + sure.sum(), above + (error[sure] > found["error"][sure]).sum()
                assert (error[sure] <= 10.0 * found["error"][sure]).all(), (each, statistic)
            # A sample is never above the maximum.
            assert (fine[3][:, row] - found[f"{each}_max"] <= found["error"] * peak + 1e-15 * peak)[ok].all(), each
    assert checked >= count
    assert above <= 0.001 * checked


def _deviations(found, names, dense_ones, rows):
    """Deviations of means and variances from those of dense sampling, relative, of shape (names, 2, n)."""
    means, variances = dense_ones[0][:, rows].T, dense_ones[1][:, rows].T
    squares = means**2 + variances
    own_means, own_variances = (np.array([found[f"{each}_{part}"] for each in names]) for part in ("mean", "variance"))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.stack([(own_means - means) / np.sqrt(squares), (own_variances - variances) / squares], axis=1)


def test_windows_and_magnitudes_that_have_no_turn_of_equal_steps():
    """Means of magnitudes and curvatures take the adaptive rule; those over an interval are right too.

    D turns about a point of the frame. Where it rests the sign of its curvature is that of a rounding error, which the
    bound says.
    """
    linkage, values = linkage_of(CASES["crank-shaper"]), values_of(CASES["crank-shaper"])
    motion = explore.simulate(linkage, values, angles=np.arange(0.005, 360.0, 0.01))
    names = ["D_velocity_mean", "D_curvature_min", "D_curvature_max", "lever_velocity_mean"]
    row = explore.evaluate(linkage, values, metrics=names, window="cycle").iloc[0]
    assert row["D_velocity_mean"] == pytest.approx(motion["D_velocity"].mean(), rel=1e-8)
    assert row["status"] == 7
    assert row["D_curvature_max"] == pytest.approx(-row["D_curvature_min"], rel=1e-14)
    assert motion["D_curvature"].abs().to_numpy() == pytest.approx(row["D_curvature_max"], rel=1e-14)
    part = explore.evaluate(linkage, values, metrics=names, window={"from": 20, "to": 110}).iloc[0]
    inside = motion["lever_velocity"].loc[20.0:110.0]
    assert part["lever_velocity_mean"] == pytest.approx(inside.mean(), rel=1e-7)
    angles = explore.simulate(linkage, values, angles=[20.0, 110.0])["lever_angle"]
    assert part["lever_velocity_mean"] == pytest.approx(np.deg2rad(np.diff(angles)[0]) / (math.pi / 2), rel=1e-12)


def test_the_curvature_of_a_point_that_moves_at_all_angles():
    linkage, values = linkage_of(CASES["hoecken"]), values_of(CASES["hoecken"])
    motion = explore.simulate(linkage, values, angles=np.arange(0.005, 360.0, 0.01))
    row = explore.evaluate(linkage, values, metrics=["P_curvature_max"], window="cycle").iloc[0]
    assert row["status"] == 1
    assert row["P_curvature_max"] == pytest.approx(motion["P_curvature"].max(), rel=1e-6)


def test_a_link_that_turns_fully_has_rates_but_no_statistics_of_its_angle():
    metrics = ["lever_angle_mean", "lever_velocity_mean"]
    row = explore.evaluate(linkage_of(CASES["whitworth"]), values_of(CASES["whitworth"]), metrics=metrics).iloc[0]
    assert row["status"] == 8
    assert math.isnan(row["lever_angle_mean"])
    assert row["lever_velocity_mean"] == pytest.approx(1.0, rel=1e-12)  # a turn of the lever for one of the crank


@pytest.mark.parametrize("ground", [40.0, -40.0])
def test_angles_of_links_that_turn_fully_go_on_over_turns(ground):
    """Both links of a drag link, against the built-in one without whole turns, and against themselves a turn later."""
    lengths = {"r1": 100.0, "r2": 100.0, "r3": 90.0, "r4": ground}
    angles = np.array([-400.0, -10.0, 0.0, 75.0, 180.0, 350.0, 360.0, 435.0, 795.0])
    motion = explore.simulate(Linkage(FOUR_BAR), lengths | {"speed": 1.0}, angles=angles)
    for link in ("coupler", "rocker"):
        found = motion[f"{link}_angle"]
        assert -180.0 < found[0.0] <= 180.0
        assert found[435.0] - found[75.0] == pytest.approx(360.0, rel=1e-14)
        assert found[795.0] - found[75.0] == pytest.approx(720.0, rel=1e-14)
        # the angle turns by the integral of its rate
        steps = np.linspace(0.0, 180.0, 257)[:-1] + 90.0 / 256
        mean = explore.simulate(Linkage(FOUR_BAR), lengths | {"speed": 1.0}, angles=steps)[f"{link}_velocity"].mean()
        assert found[180.0] - found[0.0] == pytest.approx(180.0 * mean, abs=1e-2)
    if ground > 0.0:
        other = {"crank": 100.0, "coupler": 100.0, "rocker": 90.0, "ground": 40.0, "branch": 1}
        wanted = explore.simulate("crank-rocker", other, angles=angles)["rocker_angle"]
        apart = np.remainder(motion["rocker_angle"] - wanted + 180.0, 360.0)
        assert apart.to_numpy() == pytest.approx(180.0, abs=1e-12)


def test_a_link_that_turns_quickly_at_a_crank_angle_has_an_angle():
    """By 1.1 rad between two of 256 crank angles, beside a change point."""
    values = {"r1": 133.61274220484933, "r2": 202.80512763053798, "r3": 203.73756261672713, "r4": 135.5561730254136}
    own = explore.evaluate(Linkage(FOUR_BAR | {"output": "rocker"}), values, metrics=["swing_angle"])
    lengths = dict(zip(("crank", "coupler", "rocker", "ground"), values.values(), strict=True))
    other = explore.evaluate("crank-rocker", lengths | {"branch": 1}, metrics=["swing_angle"])
    assert own["status"][0] == other["status"][0] == 1
    assert own["swing_angle"][0] == pytest.approx(other["swing_angle"][0], rel=1e-12)


@pytest.mark.parametrize("line", [([0.0, 10.0], ["-w", 10.0]), ([10.0, 0.0], [10.0, "-w"])])
@pytest.mark.parametrize("w", [1.0, -1.0])
def test_the_transmission_angle_of_a_slot_follows_its_direction_whatever_the_sign_of_a_parameter(line, w):
    """A direction that is a parameter, which may be negative, against the same one in numbers."""
    motions = []
    for along in (line, [[-w if part == "-w" else part for part in end] for end in line]):
        slider = Linkage({
            "driver": "crank",
            "frame": {"O": [0, 0]},
            "links": {"crank": {"O": 0, "A": "r"}, "rod": {"A": 0, "B": "l"}},
            "slots": {"ram": {"pin": "B", "link": "frame", "along": along}},
            "branch": {"B": "far"},
        })  # fmt: skip
        given = {"r": 30.0, "l": 100.0, "w": w, "speed": 1.0}
        values = {name: value for name, value in given.items() if name != "w" or along is line}
        motions.append(explore.simulate(slider, values, angles=12)["B_transmission_angle"].to_numpy())
    assert motions[0] == pytest.approx(motions[1], rel=1e-12)
    assert motions[0].max() - motions[0].min() > 10.0


def test_the_transmission_angle_is_the_worst_of_all_joints():
    case = CASES["watt-2"]
    row = explore.evaluate(linkage_of(case), values_of(case), metrics=["transmission_angle_min"]).iloc[0]
    extremes = [case["turn"][f"{joint}_transmission_angle"] for joint in "BE"]
    expected = min(min(float(e["min"]), 180.0 - float(e["max"])) for e in extremes)
    assert row["transmission_angle_min"] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("ground", [50.1, 50.01, 50.000001])
def test_designs_whose_singularity_is_too_near_for_equal_steps_have_graded_panels(ground):
    """Equal steps gave a bound above 1 and no second attempt; halved panels take 576 nodes at least."""
    lengths = {"r1": 30.0, "r2": 100.0, "r3": 80.0, "r4": ground}
    row = explore.evaluate(Linkage(FOUR_BAR), lengths, metrics=["B_transmission_angle_min"]).iloc[0]
    d = ground - 30.0
    expected = np.rad2deg(np.arccos((100.0**2 + 80.0**2 - d * d) / (2 * 100.0 * 80.0)))
    assert row["nodes"] < 320
    assert row["error"] < 1e-7
    assert row["B_transmission_angle_min"] == pytest.approx(expected, rel=1e-7)


def test_a_near_singularity_takes_up_to_256_equal_steps():
    """At a distance of 0.18: fewer than half the nodes of halved panels, and within the bound."""
    lengths = {"r1": 30.0, "r2": 100.0, "r3": 80.0, "r4": 51.2}
    row = explore.evaluate(Linkage(FOUR_BAR), lengths, metrics=["rocker_acceleration_rms"]).iloc[0]
    motion = explore.simulate(Linkage(FOUR_BAR), lengths, angles=np.arange(0.0, 360.0, 0.5))
    assert 160 < row["nodes"] <= 256
    exact = math.sqrt(np.mean(np.square(motion["rocker_acceleration"])))
    assert row["rocker_acceleration_rms"] == pytest.approx(exact, rel=row["error"])
    assert row["error"] < 1e-9


def test_a_negative_length_of_the_frame_is_bounded_by_what_it_cancels():
    """The sums of the driver's distance cancel there: a bound of the form with a positive length would be too small."""
    lengths = {"r1": 30.0, "r2": 100.0, "r3": 80.0}
    one = explore.evaluate(Linkage(FOUR_BAR), {**lengths, "r4": 60.0}, metrics=["rocker_acceleration_rms"]).iloc[0]
    other = explore.evaluate(Linkage(FOUR_BAR), {**lengths, "r4": -60.0}, metrics=["rocker_acceleration_rms"]).iloc[0]
    # Half a turn apart, and mirrored: the same rms.
    assert other["rocker_acceleration_rms"] == pytest.approx(one["rocker_acceleration_rms"], rel=1e-12)
    assert other["error"] > one["error"]


def test_constants_of_a_table_need_no_parameter():
    """A joint of three bars with lengths that are numbers keeps its transmission angle."""
    fixed = {
        "driver": "crank",
        "frame": {"O": [0, 0], "C": ["g", 0]},
        "links": {
            "crank": {"O": 0, "A": 30}, "one": {"O": 0, "J": 40}, "two": {"A": 0, "J": 25},
            "rod": {"J": 0, "B": 100}, "rocker": {"C": 0, "B": 80},
        },
        "branch": {"B": "left of J C", "J": "left of O A"},
    }  # fmt: skip
    motion = explore.simulate(Linkage(fixed), {"g": 110.0}, angles=[0, 100, 200])
    expected = np.rad2deg(np.arccos((40.0**2 + 25.0**2 - 30.0**2) / (2 * 40.0 * 25.0)))
    assert motion["J_transmission_angle"].to_list() == pytest.approx([expected] * 3, rel=1e-12)


def test_lines_that_become_parallel_have_a_status_of_their_own():
    """A pin on a slide of the frame and in a slot of the crank goes to infinity where both are parallel."""
    linkage = Linkage(
        {
            "driver": "crank",
            "frame": {"O": [0, 0]},
            "links": {"crank": {"O": 0, "A": "r"}, "bar": {"J": ["x", 50]}},
            "slots": {"slot": {"pin": "J", "link": "crank", "along": ["O", "A"]}},
            "slides": {"bar": {"link": "frame", "direction": [1, 0]}},
        }
    )
    row = explore.evaluate(linkage, {"r": 30.0, "x": 0.0}, metrics=["J_x_mean"])
    assert row.attrs["labels"]["status"][row["status"].iloc[0]] == "parallel_lines_at_J"


@pytest.mark.parametrize(("ram", "guide"), [([1, 0], [4, 1]), ([1, 4], [0, 1])])
def test_parallel_lines_part_the_intervals_at_which_a_blocked_linkage_assembles(ram, guide):
    """A rod that is too short for the turn, and a pin of two lines that are parallel in two of the crank's places.

    The second guide is parallel to the crank where the turn that is looked at begins and ends.
    """
    linkage = Linkage(
        {
            "driver": "crank",
            "frame": {"O": [0, 0]},
            "links": {"crank": {"O": 0, "A": "r"}, "rod": {"A": 0, "S": "l"}, "bar": {"J": [30, 50]}},
            "slots": {
                "slot": {"pin": "J", "link": "crank", "along": ["O", "A"]},
                "ram": {"pin": "S", "link": "frame", "along": [[0, 0], ram]},
            },
            "slides": {"bar": {"link": "frame", "direction": guide}},
            "branch": {"S": "far"},
        }
    )
    design = {"r": 50.0, "l": 30.0}
    ends = [f"assembles_{end}_{k}" for k in range(1, 5) for end in ("from", "to")]
    row = explore.evaluate(linkage, design, metrics=["assembly_intervals", *ends]).iloc[0]
    border, middle, parallel = np.degrees([np.arcsin(0.6), np.arctan2(*ram[::-1]), np.arctan2(*guide[::-1])])
    known = [
        (start % 360, start % 360 + length)
        for turn in (0, 180)
        for start, length in (
            (turn + middle - border, parallel - middle + border), (turn + parallel, middle + border - parallel)
        )
    ]  # fmt: skip
    assert row["assembly_intervals"] == 4
    assert row[ends].to_list() == pytest.approx([each for pair in sorted(known) for each in pair], abs=1e-11)
    assert row["error"] < 1e-13
    explore.simulate(linkage, design, angles=[middle - 30, parallel - 1])
    with pytest.raises(MotionError, match="deg: the two lines that place J become parallel"):
        explore.simulate(linkage, design, angles=[middle - 30, parallel + 5])


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"output": "crank"}, "output: crank turns at constant speed; name another link or a slot"),
        (
            {"frame": {"O": [0, 0], "C": [110, 0]},
             "links": {"crank": {"O": 0, "A": 30}, "coupler": {"A": 0, "B": 100}, "rocker": {"C": 0, "B": 80}}},
            "no coordinate has a parameter; give one length a name",
        ),
        (
            {"links": {**FOUR_BAR["links"], "x": {"B": 0, "Q": "b"}, "y": {"B": 0, "Q": "b"}}},
            "x and y form a group that no dyad solves",
        ),
    ],
)  # fmt: skip
def test_tables_without_a_motion_of_their_own_are_refused_in_a_line(changes, problem):
    with pytest.raises(explore.ConfigError, match=re.escape(problem)):
        Linkage({**FOUR_BAR, **changes})
