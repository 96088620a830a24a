"""Loads of linkages of tables: values of the reference, balances of links, work, and bounds of torques."""

import math
import tomllib
from pathlib import Path

import mpmath
import numpy as np
import pytest
from linkage_cases import (
    ALL_LOADS,
    AMOUNTS,
    BOOM,
    BOOM_LENGTHS,
    CASES,
    DRIVEN_SLIDER,
    FOUR_BAR,
    OLDHAM,
    SLIDING_BAR,
    curved_shaper,
    dense,
    evaluate_graph,
    linkage_of,
    loaded_shaper,
    near_limits,
    rough_directions,
    trace,
    trammel,
    trammel_of_blocks,
    turns,
    values_of,
    with_loads,
)

import explore
from explore import Linkage
from explore.base.errors import ConfigError
from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms.linkages.loads import Loading
from explore.mechanisms.linkages.reactions import Reactions
from explore.model.status import Status
from explore.studies.request.requests import make_request

LOADED = [name for name, case in CASES.items() if "loads" in case]


def section_of(given):
    """The loads of a case as a section of its table."""

    def numbers(texts):
        return [float(text) for text in texts]

    masses = {point: float(mass) for point, mass in given["point_masses_kg"].items()}
    for link, entry in given["links"].items():
        masses[link] = {
            "mass": float(entry["mass_kg"]),
            "centroid": numbers(entry["centroid_mm"]),
            "inertia": float(entry["inertia_kg_m2"]),
        }
    forces = {point: numbers(force) for point, force in given.get("forces_N", {}).items()}
    opposing = {slot: float(force) for slot, force in given.get("opposing_N", {}).items()}
    section = {
        "gravity": numbers(given["gravity_m_per_s2"]), "masses": masses, "forces": forces, "opposing": opposing
    }  # fmt: skip
    return {name: part for name, part in section.items() if part}


def loaded(name):
    """A case with the loads of the reference, and its values."""
    case = CASES[name]
    given = case["loads"]["given"]
    return with_loads(case, section_of(given)), values_of(case) | {"speed": float(given["speed_rad_per_s"])}


@pytest.mark.parametrize("name", LOADED)
def test_the_drive_torque_equals_the_reference(name):
    """At single angles and over the turn to 1e-14 of the peak, 30 digits rounded to doubles; extremes at jumps, too."""
    linkage, values = loaded(name)
    reference = CASES[name]["loads"]
    turn = {key: float(value) for key, value in reference["turn"]["drive_torque_N_m"].items()}
    peak = max(abs(turn["min"]), abs(turn["max"]))
    motion = explore.simulate(linkage, values, angles=[float(degrees) for degrees in reference["at"]])
    expected = [float(values["drive_torque_N_m"]) for values in reference["at"].values()]
    assert motion["drive_torque"].to_numpy() == pytest.approx(expected, abs=1e-14 * peak)
    assert motion["drive_power"].to_numpy() == pytest.approx(motion["drive_torque"] * values["speed"], rel=1e-15)
    statistics = ("mean", "rms", "min", "max")
    metrics = [f"drive_torque_{statistic}" for statistic in statistics]
    row = explore.evaluate(linkage, values, metrics=metrics, window="cycle", tolerance=1e-12).iloc[0]
    assert row["status"] == 1
    assert [row[metric] for metric in metrics] == pytest.approx([turn[s] for s in statistics], abs=1e-14 * peak)


@pytest.mark.parametrize("name", LOADED)
def test_forces_in_joints_equal_the_reference(name):
    """At single angles to 1e-15 of the peak, and their largest values over the turn."""
    linkage, values = loaded(name)
    reference = CASES[name]["loads"]
    largest = {key.replace("/", "_force_on_"): float(of["max"]) for key, of in _pins(reference["turn"]).items()}
    peak = max(largest.values())
    motion = explore.simulate(linkage, values, angles=[float(degrees) for degrees in reference["at"]])
    for of, (_, row) in zip(reference["at"].values(), motion.iterrows(), strict=True):
        for key, (x, y) in of["joint_force_xy_N"].items():
            signal = key.replace("/", "_force_on_")
            found = [row[signal], row[f"{signal}_x"], row[f"{signal}_y"]]
            assert found == pytest.approx([float(of["joint_force_N"][key]), float(x), float(y)], abs=1e-15 * peak)
        for slot, force in of["slot_normal_force_N"].items():
            assert row[f"{slot}_normal_force"] == pytest.approx(float(force), abs=1e-15 * peak)
    metrics = [f"{signal}_max" for signal in largest]
    row = explore.evaluate(linkage, values, metrics=[*metrics, "pin_force_peak"], window="cycle", tolerance=1e-12).iloc[
        0
    ]
    assert row["status"] == Status.OK
    assert row[metrics].tolist() == pytest.approx(list(largest.values()), rel=1e-12)
    assert row["pin_force_peak"] == pytest.approx(peak, rel=1e-12)


def _pins(turn):
    return {key: of for key, of in turn["joint_force_max_N"].items() if "/" in key}


#: Linkages with all kinds of steps, and values of their parameters.
TABLES = {name: (linkage_of(case), values_of(case)) for name, case in CASES.items()} | {
    "boom": (Linkage(BOOM), BOOM_LENGTHS | {"offset": 15.0}),
    "trammel": (trammel(), {"l": 100.0, "m": 30.0}),
    "blocks": (trammel_of_blocks(), {"l": 100.0, "m": 30.0}),
    "driven-slider": (Linkage(DRIVEN_SLIDER), {"t": 30.0, "l": 50.0}),
    "oldham": (Linkage(OLDHAM), {"e": 8.0}),
    "sliding-bar": (Linkage(SLIDING_BAR), {"r": 40.0}),
}


#: Crank angles, rad, at which those assemble that do not turn.
ANGLES = {"peaucellier": ("-0.2", "0.3"), "scott-russell": ("0.3", "0.6")}


@pytest.mark.parametrize("name", TABLES)
def test_balances_of_links_lead_to_the_torque_by_power_and_to_the_force_on_the_frame(name):
    """All links and points have masses; with 30 digits, at two angles."""
    (linkage, values), rng = TABLES[name], np.random.default_rng(3)
    content, table = linkage.content, linkage.table
    fixed = set(table.frame.place_of)
    masses = {point: rng.uniform(0.1, 2.0) for point in table.points if point not in fixed}
    for link in table.links:
        masses[link.name] = {
            "mass": rng.uniform(0.1, 2.0), "centroid": rng.uniform(-40.0, 60.0, 2).tolist(), "inertia": 0.003
        }  # fmt: skip
    linkage = Linkage(content | {"loads": {"gravity": [1.0, -9.81], "masses": masses}})
    equations = trace(linkage)
    loading = Loading(equations, linkage.table.loads)
    reactions = Reactions(equations, loading)
    table, zero = linkage.table, equations.graph.constant(0.0)
    if table.driven_slot:
        power = reactions.along * equations.slot_position(table.driven_slot).terms[1]
    else:
        power = reactions.moment
    # The frame takes what pins, slots and slides give to it.
    frame = [force for (_, body), force in reactions.on_bodies.items() if body == "frame"]
    for slot in table.slots:
        if slot.body == "frame":
            x, y = (part.terms[0] for part in equations.slot_direction(slot))
            normal = reactions.across[slot.name]
            along = reactions.along if slot is table.driven_slot else zero
            frame.append((y * normal - x * along, -(x * normal) - y * along))
    for slide in table.slides:
        if slide.body == "frame":
            x, y = (part.terms[0] for part in equations.slide_direction(slide))
            frame.append((y * reactions.across[slide.link], -(x * reactions.across[slide.link])))
    given = [force for forces in loading.on_pins.values() for force in forces]
    given += [force for forces in loading.on_bodies.values() for _, force in forces]
    sums = [sum((force[axis] for force in forces), zero) for forces in (frame, given) for axis in (0, 1)]
    assert len(frame) >= 1
    with mpmath.workdps(40):
        for angle in map(mpmath.mpf, ANGLES.get(name, ("0.3", "2.9"))):
            numbers = [power, loading.torque, *sums]
            followed = rough_directions(linkage, values, angle)
            moment, torque, fx, fy, gx, gy = evaluate_graph(numbers, values | {"speed": 3.0}, angle, followed=followed)
            assert abs(moment / 1000 - torque) < 1e-12 * max(abs(torque), abs(gy) / 1000)
            assert max(abs(fx - gx), abs(fy - gy)) < 1e-12 * abs(gy)


UNITS = {"cut": "N", "g": "m/s^2", "m": "kg", "j": "kg m^2", "f": "N", "k": "N/m"}


def shaper():
    return loaded_shaper(), values_of(CASES["crank-shaper"]) | AMOUNTS


def test_the_work_of_the_drive_is_what_the_load_takes():
    """What dampers lose, less that of the torques: 0.05 N m on the crank are 0.1 pi N m in a turn."""
    linkage, values = shaper()
    metrics = ["net_work", "positive_work", "drive_torque_mean", "friction_power_mean"]
    row = explore.evaluate(linkage, values, metrics=metrics, window="cycle", tolerance=1e-11).iloc[0]
    assert row["status"] == 1
    lost = row["friction_power_mean"] * 2.0 * math.pi / 9.0
    assert row["net_work"] == pytest.approx(lost - 0.1 * math.pi, rel=1e-11)
    assert row["net_work"] == pytest.approx(row["drive_torque_mean"] * 2.0 * math.pi, rel=1e-11)
    assert row["positive_work"] > row["net_work"]


def test_parameters_of_loads_have_units_and_do_not_change_the_motion():
    linkage, values = shaper()
    parameters = {p.name: p for p in linkage.mechanism.parameters}
    assert {name: parameters[name].unit for name in UNITS} == UNITS
    assert {p.name for p in parameters.values() if p.affects == "load"} == set(UNITS)
    plain = linkage_of(CASES["crank-shaper"])
    metrics = ["ram_velocity_rms", "ram_acceleration_peak", "time_ratio"]
    with_them = explore.evaluate(linkage, values, metrics=metrics, window="cycle")
    without = explore.evaluate(
        plain, values_of(CASES["crank-shaper"]) | {"speed": 9.0}, metrics=metrics, window="cycle"
    )
    assert with_them[metrics].equals(without[metrics])


def test_inertia_grows_with_the_square_of_the_speed():
    """A parabola through three speeds, which share their motion, leads through a fourth one."""
    linkage, values = shaper()
    speeds = np.array([2.0, 5.0, 11.0, 17.0])
    designs = {name: np.full(4, value) for name, value in values.items()} | {"speed": speeds}
    result = explore.evaluate(linkage, designs, metrics=["drive_torque_mean", "drive_torque_max"], tolerance=1e-11)
    assert (result["status"] == 1).all()
    motions = [explore.simulate(linkage, values | {"speed": speed}, angles=[60.0]) for speed in speeds]
    torques = [motion["drive_torque"].iloc[0] for motion in motions]
    fitted = np.polynomial.Polynomial.fit(speeds[:3], torques[:3], 2)
    assert fitted(17.0) == pytest.approx(torques[3], rel=1e-12)
    assert result["drive_torque_max"].is_unique


def test_expressions_of_negative_masses_are_no_numbers():
    case = CASES["crank-shaper"]
    linkage = with_loads(case, {"masses": {"S": "m - 1"}}, m="kg")
    row = explore.evaluate(linkage, values_of(case) | {"m": 0.5}, metrics=["drive_torque_max"], window="cycle").iloc[0]
    assert row["status"] == Status.NOT_FINITE
    row = explore.evaluate(linkage, values_of(case) | {"m": 1.5}, metrics=["drive_torque_max"], window="cycle").iloc[0]
    assert row["drive_torque_max"] > 0.0


@pytest.mark.parametrize("metric", ["drive_torque_rms", "drive_torque_std", "positive_work", "pin_force_peak"])
def test_forces_whose_squares_overflow_are_no_numbers(metric):
    """And nothing warns: the status tells it."""
    linkage = with_loads(CASES["crank-shaper"], {"forces": {"S": [-1e250, 0]}})
    row = explore.evaluate(linkage, values_of(CASES["crank-shaper"]), metrics=[metric], window="cycle").iloc[0]
    assert row["status"] == Status.NOT_FINITE


def test_a_spring_on_a_link_that_turns_fully_has_no_number():
    case = CASES["whitworth"]
    spring = {"between": "arm", "rate": 1, "rest": 0}
    names = [link.name for link in linkage_of(case).table.links]
    turning = next(name for name in names if name != "crank" and case["turns_of_links"].get(name))
    linkage = with_loads(case, {"springs": {"coil": spring | {"between": turning}}})
    row = explore.evaluate(linkage, values_of(case), metrics=["drive_torque_max"], window="cycle").iloc[0]
    assert row["status"] == Status.NOT_FINITE


def test_a_spring_of_no_length_acts_where_its_points_meet():
    """The crank's pin is at H at the crank angle 0; the energy k r^2 (1 - cos) has the slope k r^2 sin."""
    frame, spring = FOUR_BAR["frame"] | {"H": ["r1", 0]}, {"between": ["H", "A"], "rate": 400, "rest": 0}
    linkage = Linkage(FOUR_BAR | {"frame": frame, "loads": {"springs": {"coil": spring}}})
    lengths = {"r1": 50.0, "r2": 200.0, "r3": 150.0, "r4": 180.0}
    motion = explore.simulate(linkage, lengths, angles=[0.0, 30.0, 90.0])
    assert motion["drive_torque"].to_numpy() == pytest.approx([0.0, 0.5, 1.0], abs=1e-15)
    row = explore.evaluate(linkage, lengths, metrics=["drive_torque_rms"], window="cycle").iloc[0]
    assert row["status"] == Status.OK
    assert row["drive_torque_rms"] == pytest.approx(math.sqrt(0.5), rel=1e-14)


def test_the_content_of_loads_describes_them():
    linkage, _ = shaper()
    assert Linkage(linkage.content) == linkage == Linkage(tomllib.loads(linkage.to_toml()))
    assert linkage.content["loads"] == ALL_LOADS
    assert linkage.mechanism.name != linkage_of(CASES["crank-shaper"]).mechanism.name


def test_a_driven_slot_has_power_and_no_torque():
    content = {
        "driver": "jack", "travel": [0, "s"],
        "frame": {"O": [0, 0], "C": [100, 0]},
        "links": {"arm": {"C": 0, "P": "l"}, "rod": {"P": 0, "Q": 120}},
        "slots": {"jack": {"pin": "Q", "link": "frame", "along": ["O", [0, 1]]}},
        "branch": {"P": "left of C Q"},
        "loads": {"gravity": [0, -9.81], "masses": {"P": 2}},
    }  # fmt: skip
    linkage = Linkage(content)
    motion = explore.simulate(linkage, {"l": 80.0, "s": 60.0, "speed": 3.0}, angles=[40.0])
    assert "drive_torque" not in motion
    row = motion.iloc[0]
    work = 2 * (
        (row["P_acceleration_y"] / 1000 + 9.81) * row["P_velocity_y"]
        + row["P_acceleration_x"] / 1000 * row["P_velocity_x"]
    )
    assert row["drive_power"] == pytest.approx(work / 1000, rel=1e-13)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_bounds_of_torques_hold(tolerance):
    """Ordinary shapers and such beside their limits, against dense sampling where that is exact enough."""
    linkage, values = loaded_shaper(without=["opposing"]), values_of(CASES["crank-shaper"]) | AMOUNTS
    values.pop("cut")
    names = ("drive_torque", "friction_power")
    metrics = [f"{name}_{statistic}" for name in names for statistic in ("mean", "variance")]
    made = make_request(linkage.mechanism, metrics=metrics, window="cycle", tolerance=tolerance)
    kernel, rng = made.kernel, np.random.default_rng(11)
    designs = {name: value * (1.0 + 0.2 * rng.uniform(-1.0, 1.0, 200)) for name, value in values.items()}
    families = [{name: column[turns(kernel, designs)] for name, column in designs.items()}]
    families += [near_limits(kernel, designs, 40, rng)]
    checked = 0
    for family in families:
        found = evaluate_columns(made, family).columns
        fine, coarse = dense(kernel, family, 8192), dense(kernel, family, 4096)
        for name in names:
            signal = kernel.signal(name)
            factor = family["speed"] ** signal.speed_power
            rms = np.sqrt(fine[0][:, signal.row] ** 2 + fine[1][:, signal.row])
            for k, (statistic, scale, power) in enumerate((("mean", rms, 1), ("variance", rms**2, 2))):
                exact = fine[k][:, signal.row]
                error = np.abs(found[f"{name}_{statistic}"] / factor**power - exact) / scale
                sure = np.abs(exact - coarse[k][:, signal.row]) / scale < 0.1 * found["error"] + 1e-15
                sure &= np.isin(found["status"], (Status.OK, Status.TOLERANCE_NOT_MET))
                checked += sure.sum()
                assert (error[sure] <= found["error"][sure]).all(), (name, statistic)
    assert checked >= 400


def test_what_opposes_the_output_takes_its_force_times_the_way_there_and_back():
    """In a turn, in its two strokes, and in an interval across the reversal at 204.6 deg."""
    case = CASES["crank-shaper"]
    linkage = with_loads(case, {"opposing": {"ram": 300}})
    metrics = ["net_work", "stroke", "drive_power_mean_forward", "drive_power_mean_backward", "positive_work"]
    row = explore.evaluate(linkage, values_of(case) | {"speed": 2.0}, metrics=metrics, tolerance=1e-12).iloc[0]
    assert row["net_work"] == pytest.approx(2 * 300 * row["stroke"] / 1000, rel=1e-12)
    assert row["positive_work"] == pytest.approx(row["net_work"], rel=1e-12)
    lengths = {"forward": 335.375681647835924 - 204.624318352164075, "backward": 360 - 130.751363295671849}
    for stroke, length in lengths.items():
        mean = 300 * row["stroke"] / 1000 / (math.radians(length) / 2.0)
        assert row[f"drive_power_mean_{stroke}"] == pytest.approx(mean, rel=1e-12)
    interval = {"from": 150, "to": 250}
    work = explore.evaluate(linkage, values_of(case), metrics=["drive_torque_mean"], window=interval, tolerance=1e-12)
    places = explore.simulate(linkage, values_of(case), angles=[150.0, 204.624318352164075, 250.0])["ram_position"]
    way = np.abs(np.diff(places)).sum()
    assert work["drive_torque_mean"].iloc[0] == pytest.approx(0.3 * way / math.radians(100), rel=1e-12)


def test_bounds_hold_across_jumps():
    """Statistics at a tolerance of 1e-6 are within their bounds of those at 1e-12."""
    linkage, values = shaper()
    rng = np.random.default_rng(5)
    designs = {name: value * (1.0 + 0.1 * rng.uniform(-1.0, 1.0, 60)) for name, value in values.items()}
    metrics = [f"drive_torque_{statistic}" for statistic in ("mean", "rms", "max", "min")]
    coarse, fine = (
        evaluate_columns(make_request(linkage.mechanism, metrics=metrics, window="cycle", tolerance=each), designs)
        for each in (1e-6, 1e-12)
    )
    ok = (coarse.columns["status"] == Status.OK) & (fine.columns["status"] == Status.OK)
    assert ok.sum() >= 40
    for metric in metrics:
        error = np.abs(coarse.columns[metric] - fine.columns[metric])[ok]
        assert (error <= (coarse.columns["error"] * fine.columns["drive_torque_rms"])[ok] * 2.0).all(), metric


def test_metrics_of_the_whole_motion_exist_over_an_interval_that_a_blocked_crank_reaches():
    """A pump jack whose crank, of twice its length, moves from 273.5 to 547.3 deg only."""
    linkage = explore.load_linkage(Path(explore.__file__).parent / "data/linkages/pump-jack.toml")
    design = {"r": 200, "cx": 240, "cy": 290, "p": 300, "b": 240, "h": 300, "arm": 200, "pull": 800, "speed": 1.0}
    ends = {"from": 300, "to": 400}
    names = ["pin_force_peak_interval", "transmission_angle_min_interval", "swing_angle_interval", "footprint_interval"]
    row = explore.evaluate(linkage, design, metrics=names, window=ends).iloc[0]
    assert row["status"] == Status.OK
    motion = explore.simulate(linkage, design, angles=np.linspace(300, 400, 4001))
    forces = [name for name in motion if "_force_on_" in name and not name.endswith(("_x", "_y"))]
    angles = motion[[name for name in motion if name.endswith("_transmission_angle")]].to_numpy()
    expected = {
        "pin_force_peak_interval": motion[forces].to_numpy().max(),
        "transmission_angle_min_interval": np.minimum(angles, 180 - angles).min(),
        "swing_angle_interval": np.ptp(motion["beam_angle"]),
    }
    for name, value in expected.items():
        assert row[name] == pytest.approx(value, rel=1e-6)
    assert row["footprint_interval"] > 0
    assert explore.evaluate(linkage, design, metrics=["pin_force_peak"], window=ends)["pin_force_peak"].isna().all()


def test_loads_have_a_largest_number():
    springs = {f"s{k}": {"between": "ram", "rate": 1, "rest": 0} for k in range(101)}
    with pytest.raises(ConfigError, match=r"^linkage.loads: has 101 entries; at most 100 are possible$"):
        with_loads(CASES["crank-shaper"], {"springs": springs})


def test_names_of_tables_in_results_stay_the_same():
    """Results of before name their mechanism by these; a field that is added to a part of tables changes them."""
    names = [table.digest[:12] for table in (loaded_shaper().table, curved_shaper().table)]
    assert names == ["bd374057187b", "051b36597cac"]
    assert linkage_of(CASES["watt-2"]).table.digest[:12] == "170967f96666"
