"""The crank-rocker under load: on both branches against second methods, and the work of a turn."""

import numpy as np
import pytest
from exact_loads import ExactFourBar, assert_signals
from mujoco_model import Body, Cut, inverse_dynamics, magnitude

import explore
from explore.base.units.shown import ShownUnits
from explore.figures.reporting.motion import describe_motion, kernel_for
from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER
from explore.mechanisms.four_bar_loads import LOADS

PLAIN = {"crank": 100.0, "coupler": 300.0, "rocker": 250.0, "ground": 350.0, "speed": 20.0}
LOAD = {
    "constant_torque": 5.0, "opposing_torque": 30.0, "stiffness": 40.0, "damping": 0.3, "inertia": 0.02,
    "crank_mass": 1.0, "coupler_mass": 2.0, "rocker_mass": 1.5, "coupler_inertia": 0.01, "rocker_inertia": 0.2,
    "crank_centroid": -0.2, "coupler_centroid": 0.3, "rocker_centroid": 0.6,
}  # fmt: skip
DRAG_LINK = PLAIN | {"crank": 250.0, "ground": 60.0}
ANGLES = np.linspace(0.0, 360.0, 73)[:-1] + 1.234
BRANCHES = pytest.mark.parametrize("branch", [1.0, -1.0])


def draw(count, seed):
    """Crank-rockers clear of the change point, on both branches, each with about half of the loads."""
    rng, designs = np.random.default_rng(seed), []
    while len(designs) < count:
        lengths = np.exp(rng.uniform(np.log(50.0), np.log(500.0), 4))
        crank, *others = lengths
        if 2.0 * (crank + max(others)) < 1.9 * lengths.sum() - lengths.sum() and crank < 0.95 * min(others):
            load = {name: value * np.exp(rng.normal()) for name, value in LOAD.items() if rng.random() < 0.5}
            load |= {"constant_torque": rng.normal(0.0, 5.0), "speed": rng.uniform(1.0, 60.0)}
            designs.append(dict(zip(("crank", "coupler", "rocker", "ground"), map(float, lengths), strict=True)) | load)
            designs[-1]["branch"] = rng.choice([1.0, -1.0])
    return designs


def evaluate(designs, metrics, **options):
    """The metrics of designs that need not give the same loads."""
    defaults = {p.name: p.default for p in LOADS}
    columns = {name: np.array([({**defaults, **d})[name] for d in designs]) for name in {*defaults, *designs[0]}}
    return explore.evaluate("crank-rocker", columns, metrics=metrics, **{"window": "cycle", **options})


def test_signals_are_those_of_free_bodies():
    for design in draw(200, 0):
        motion = explore.simulate("crank-rocker", design, angles=ANGLES[::3])
        assert_signals(motion, ExactFourBar, design, "rocker_velocity")


@pytest.mark.slow
def test_forces_agree_with_mujoco():
    pytest.importorskip("mujoco")
    defaults = {p.name: p.default for p in LOADS}
    for number, drawn in enumerate(draw(100, 1)):
        # MuJoCo needs masses, and moments of inertia about the centroids above 0
        design = defaults | {name: LOAD[name] for name in ("crank_mass", "coupler_mass", "rocker_mass")} | drawn
        crank, coupler, rocker, ground = (1e-3 * design[name] for name in ("crank", "coupler", "rocker", "ground"))
        arms = [design[f"{n}_centroid"] * x for n, x in (("crank", crank), ("coupler", coupler), ("rocker", rocker))]
        design["coupler_inertia"] += 0.01
        design["rocker_inertia"] += design["rocker_mass"] * arms[2] ** 2 + 0.01
        design["gravity"] *= number % 2
        about_centroid = design["inertia"] + design["rocker_inertia"] - design["rocker_mass"] * arms[2] ** 2
        exact = explore.simulate("crank-rocker", design, angles=ANGLES)
        middle = np.deg2rad(explore.evaluate("crank-rocker", design, metrics=["mid_angle"])["mid_angle"][0])
        bodies = (
            Body("crank", design["crank_mass"], 0.01, (arms[0], 0.0)),
            Body("coupler", design["coupler_mass"], design["coupler_inertia"], (arms[1], 0.0), (crank, 0.0), "crank"),
            Body("rocker", design["rocker_mass"], about_centroid, (arms[2], 0.0), (ground, 0.0),
                 stiffness=design["stiffness"], rest=middle, damping=design["damping"]),
        )  # fmt: skip
        theta, speed = np.deg2rad(ANGLES), design["speed"]
        coupler_rates, rocker_rates = (
            [exact[f"{link}_{rate}"].to_numpy() for rate in ("velocity", "acceleration")]
            for link in ("coupler", "rocker")
        )
        turned = np.deg2rad(exact["coupler_angle"].to_numpy()) - theta
        swung = np.remainder(np.deg2rad(exact["rocker_angle"].to_numpy()) - middle + np.pi, 2.0 * np.pi) - np.pi
        motion = {
            "crank": (theta, np.full_like(theta, speed), np.zeros_like(theta)),
            "coupler": (turned, coupler_rates[0] - speed, coupler_rates[1]),  # the angle to the crank
            "rocker": (middle + swung, *rocker_rates),
        }
        load = {"rocker": design["constant_torque"] - design["opposing_torque"] * np.sign(rocker_rates[0])}
        cut = Cut("coupler", (coupler, 0.0), "rocker", (rocker, 0.0))
        torque, pins = inverse_dynamics(bodies, cut, design["gravity"], motion, load, "crank")
        scale = max(magnitude(force).max() for force in pins.values())
        for pin, name in zip("abcd", ("crank", "coupler", "cut", "rocker"), strict=True):
            assert np.abs(exact[f"pin_force_{pin}"] - magnitude(pins[name])).max() <= 1e-11 * scale, design
        assert np.abs(exact["drive_torque"] - torque).max() <= 1e-11 * scale * crank, design


def test_the_test_rig_is_the_crank_rocker_of_branch_1():
    metrics = [
        f"{signal.name}_{s}"
        for signal in CRANK_ROCKER.signals
        if signal.depends_on_load
        for s in (("max", "rms", "power_mean") if signal.is_magnitude else ("mean", "std", "min", "max"))
    ]
    metrics += ["pin_force_peak", "pin_force_rms", "bearing_mean_force", "positive_work", "net_work", "swing_angle"]
    for design in draw(12, 2):
        design |= {"branch": 1.0}
        ours = explore.evaluate("crank-rocker", design, metrics=metrics, window="cycle")
        rig = explore.evaluate("test-rig", {k: v for k, v in design.items() if k != "branch"}, metrics=metrics)
        assert np.array_equal(ours[metrics], rig[metrics], equal_nan=True)  # fmt: skip


def test_the_work_of_a_turn_is_what_the_load_dissipates():
    designs = draw(300, 3)
    names = ["drive_torque_mean", "drive_torque_rms", "net_work", "positive_work", "rocker_velocity_rms", "swing_angle"]
    frame = evaluate(designs, names, tolerance=1e-11)
    # the work of constant torque, spring, weight and inertia over a turn is 0
    opposing = np.array([d.get("opposing_torque", 0.0) for d in designs]) * 2.0 * np.deg2rad(frame["swing_angle"])
    damping = np.array([d.get("damping", 0.0) for d in designs]) * frame["rocker_velocity_rms"] ** 2
    lost = opposing + damping * 2.0 * np.pi / frame["speed"]
    assert (frame["net_work"] - lost).abs().max() <= 2e-11 * lost.max()
    work = 2.0 * np.pi * frame["drive_torque_mean"]
    assert ((work - frame["net_work"]).abs() <= 2e-11 * 2.0 * np.pi * frame["drive_torque_rms"]).all()
    assert (frame["positive_work"] >= frame["net_work"] * (1.0 - 1e-10)).all()
    assert (lost == 0.0).any()
    assert (frame["net_work"][lost == 0.0] == 0.0).all()


@pytest.mark.parametrize("metric", ["drive_torque_max", "pin_force_peak"])
def test_bounds_without_masses_are_those_of_vanishing_ones(metric):
    """Forces of links without masses are computed in another way, with the same rounding."""
    design = PLAIN | {"constant_torque": 5.0, "stiffness": 40.0, "crank_mass": [0.0, 1e-12]}
    table = explore.evaluate("crank-rocker", design, metrics=[metric], window="cycle", tolerance=1e-12)
    assert table[metric][0] == pytest.approx(table[metric][1], rel=1e-12)
    assert table["error"][0] == pytest.approx(table["error"][1], rel=1e-9)


@BRANCHES
def test_only_dynamic_loads_depend_on_the_speed(branch):
    speeds = {"speed": np.array([10.0, 20.0, 40.0])}
    for load, count in (({"opposing_torque": 3.0, "stiffness": 4.0}, 1), ({"coupler_mass": 1.0}, 3)):
        design = PLAIN | load | speeds | {"branch": branch}
        frame = explore.evaluate("crank-rocker", design, metrics=["pin_force_peak", "rocker_velocity_rms"])
        assert frame.attrs["kinematic_evaluations"] == count
        assert (frame["pin_force_peak"].nunique() == 1) == (count == 1)


def test_a_drag_link_has_no_forces():
    """Its rocker turns: there is no mid-angle where a spring is relaxed, and no stroke that a torque opposes."""
    frame = explore.evaluate("crank-rocker", DRAG_LINK | LOAD, metrics=["pin_force_peak"], window="cycle")
    assert CRANK_ROCKER.status_labels[int(frame["status"][0])] == "no_stroke"
    assert np.isnan(frame["pin_force_peak"][0])
    motion = explore.simulate("crank-rocker", DRAG_LINK | LOAD)
    assert list(motion) == list(explore.simulate("crank-rocker", DRAG_LINK))
    assert np.isfinite(motion).all(axis=None)


def test_designs_without_a_load_have_no_forces_and_no_extended_kernel():
    assert "drive_torque" not in explore.simulate("crank-rocker", PLAIN)
    frame = explore.evaluate("crank-rocker", PLAIN | {"stiffness": [0.0, 5.0]}, metrics=["drive_torque_rms"])
    assert CRANK_ROCKER.status_labels[int(frame["status"][0])] == "not_given"
    assert list(np.isnan(frame["drive_torque_rms"])) == [True, False]
    assert kernel_for(CRANK_ROCKER, ["crank", "speed"]) is CRANK_ROCKER
    assert kernel_for(CRANK_ROCKER, ["crank", "gravity"]) is CRANK_ROCKER


def test_a_page_computes_forces_where_the_study_gives_a_load():
    plain, loaded = (describe_motion(kernel_for(CRANK_ROCKER, given), ShownUnits()) for given in ([], ["rocker_mass"]))
    for name in ("signals", "panels"):
        assert len(plain[name]) < len(loaded[name])
    assert "drive_torque" in {signal["name"] for signal in loaded["signals"]}
    assert loaded["breaks"] == ["overlapped", "extended"]
