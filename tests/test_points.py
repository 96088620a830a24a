"""Points of floating links: 40-digit values, curvature at cusps, double cranks, and loads beside them."""

import pickle

import mpmath
import numpy as np
import pytest
from exact_points import path_of, signals

import explore
from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms.registry import MECHANISMS
from explore.model.drawing import Pose
from explore.model.mechanism import Mechanism
from explore.model.points import COORDINATES
from explore.model.status import Status
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

PUBLISHED = {"crank": 100.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118, "speed": 3.0}
#: A straight-line linkage of Hoecken: its point at twice the coupler's length runs straight for half a turn.
HOECKEN = {"crank": 100.0, "coupler": 250.0, "rocker": 250.0, "ground": 200.0, "speed": 2.0}
SLIDER = {"crank": 100.0, "rod": 300.0, "offset": 40.0, "speed": 3.0}
VARIABLE = {"rod": 300.0, "slider_speed": 500.0, "speed": 6.0, "reversal_time": 0.06}
SIGNALS = ("x", "y", "velocity_x", "velocity_y", "velocity", "acceleration_x", "acceleration_y", "acceleration",
           "curvature")  # fmt: skip
DOUBLE_CRANK = {"crank": 200.0, "coupler": 180.0, "rocker": 210.0, "ground": 80.0, "speed": 1.0}
RIG = {"crank": 37.0, "coupler": 460.0, "rocker": 595.0, "ground": 751.0, "speed": 60.0}
EXACT = [
    ("crank-rocker", PUBLISHED, (120.0, -40.0)),
    ("crank-rocker", {**PUBLISHED, "branch": -1.0}, (1300.0, 200.0)),
    ("crank-rocker", HOECKEN, (500.0, 0.0)),
    ("test-rig", RIG, (300.0, 80.0)),
    ("test-rig", {**RIG, "crank": 5.0, "coupler": 1271.5}, (-50.0, -20.0)),
    ("slider-crank", SLIDER, (120.0, 40.0)),
    ("slider-crank", {"crank": 100.0, "rod": 150.0, "offset": -30.0, "speed": 0.5}, (-200.0, 70.0)),
    ("variable-crank", VARIABLE, (120.0, 40.0)),
    ("variable-crank", {**VARIABLE, "blend_order": 3.0}, (450.0, -60.0)),
]
CASES = [*EXACT, ("crank-rocker", DOUBLE_CRANK, (50.0, 30.0))]
#: Input angles on both strokes and beside the anchors; none is at a break of the variable crank's law.
ANGLES = np.array([1.25, 33.0, 91.5, 170.0, 200.0, 269.0, 355.0])


def metrics(*names, point="knife"):
    return [f"{point}_{name}" for name in names]


@pytest.mark.parametrize(("mechanism", "design", "place"), EXACT)
def test_signals_are_those_of_forty_digits(mechanism, design, place):
    motion = explore.simulate(mechanism, design, points={"knife": place}, angles=ANGLES)
    path = path_of(mechanism, design, *place)
    exact = [signals(path, angle, design["speed"]) for angle in ANGLES]
    for name in SIGNALS:
        expected = np.array([float(row[name]) for row in exact])
        kind = name.removesuffix("_x").removesuffix("_y")
        # Some 50 operations of doubles, relative to the whole vector: a component near 0 is a difference of terms.
        size = np.array(
            [float(abs(mpmath.mpc(row["x"], row["y"])) if kind in "xy" else abs(row[kind])) for row in exact]
        )
        assert np.all(np.abs(motion[f"knife_{name}"] - expected) <= 2e-13 * size), name


@pytest.mark.parametrize(("mechanism", "design", "place"), CASES)
def test_statistics_are_those_of_dense_samples(mechanism, design, place):
    """Means over a turn against equal steps, which converge like a geometric series where the law has no breaks."""
    names = metrics("x_mean", "y_std", "velocity_x_rms", "velocity_mean", "acceleration_x_std", "acceleration_rms",
                    "curvature_mean")  # fmt: skip
    columns = {**design, "knife_along": place[0], "knife_across": place[1]}
    row = explore.evaluate(mechanism, columns, points=["knife"], metrics=names, window="cycle").iloc[0]
    assert row["status"] == Status.OK
    assert row["error"] <= 1e-9
    motion = explore.simulate(mechanism, design, points={"knife": place}, angles=7200)
    expected = {
        "x_mean": motion["knife_x"].mean(), "y_std": motion["knife_y"].std(ddof=0),
        "velocity_x_rms": np.sqrt((motion["knife_velocity_x"] ** 2).mean()),
        "velocity_mean": motion["knife_velocity"].mean(),
        "acceleration_x_std": motion["knife_acceleration_x"].std(ddof=0),
        "acceleration_rms": np.sqrt((motion["knife_acceleration"] ** 2).mean()),
        "curvature_mean": motion["knife_curvature"].mean(),
    }  # fmt: skip
    # The jumps of the third derivative of the variable crank's law leave an error of the square of the step.
    tolerance = 1e-5 if mechanism == "variable-crank" else 1e-8
    for name, value in expected.items():
        assert row[f"knife_{name}"] == pytest.approx(value, rel=tolerance), name


def test_extremes_are_those_of_forty_digits():
    design, place = PUBLISHED, (120.0, -40.0)
    columns = {**design, "knife_along": place[0], "knife_across": place[1]}
    row = explore.evaluate("crank-rocker", columns, points=["knife"], metrics=metrics(
        "x_max", "y_min", "velocity_max", "curvature_max"), window="cycle").iloc[0]  # fmt: skip
    path = path_of("crank-rocker", design, *place)
    motion = explore.simulate("crank-rocker", design, points={"knife": place}, angles=3600)
    for name, sign in (("x", 1), ("y", -1), ("velocity", 1), ("curvature", 1)):
        start = float((sign * motion[f"knife_{name}"]).idxmax())
        # the parabola through three values of 60 digits beside the extreme; its error is the fourth power of 1e-3 rad
        low, here, high = (signals(path, mpmath.mpf(start) + step, 3)[name] for step in (-0.05, 0, 0.05))
        exact = float(here - (high - low) ** 2 / (8 * (high - 2 * here + low)))
        assert row[f"knife_{name}_{'max' if sign > 0 else 'min'}"] == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("branch", [1.0, -1.0])
def test_hoecken_runs_straight_at_nearly_constant_speed(branch):
    """H. Hoecken's linkage with links of 1, 2.5, 2.5 and 2: half a turn within 0.25 % of a straight line."""
    columns = {**HOECKEN, "branch": branch, "knife_along": 500.0, "knife_across": 0.0}
    window = {"from": 90.0, "to": 270.0}
    row = explore.evaluate("crank-rocker", columns, points="knife", window=window, metrics=metrics(
        "x_peak_to_peak", "y_peak_to_peak", "curvature_peak")).iloc[0]  # fmt: skip
    assert row["knife_x_peak_to_peak"] == pytest.approx(4.0 * HOECKEN["crank"], rel=1e-12)
    assert 0.002 * 400.0 < row["knife_y_peak_to_peak"] < 0.0025 * 400.0


def test_a_path_that_stops_has_no_curvature_there():
    """The joint of coupler and rocker stops at its limit positions; a rod's point next to the slider nearly does."""
    columns = {**HOECKEN, "knife_along": [250.0, 249.9], "knife_across": 0.0}
    rows = explore.evaluate("crank-rocker", columns, points="knife", metrics=metrics("curvature_peak"), window="cycle")
    assert rows["status"][0] in (Status.TOLERANCE_NOT_MET, Status.NOT_FINITE)
    assert not rows["feasible"][0]
    assert rows["status"][1] == Status.OK
    fine = np.linspace(0.0, 360.0, 200_001)
    motion = explore.simulate("crank-rocker", HOECKEN, points={"knife": (249.9, 0.0)}, angles=fine)
    # samples 1.8e-3 deg apart beside a peak that is some 0.03 deg wide
    assert rows["knife_curvature_peak"][1] == pytest.approx(np.abs(motion["knife_curvature"]).max(), rel=1e-2)


def test_curvature_is_within_its_bound():
    """It has singularities of its own, where the path would stop at a complex angle, that no node count foresees.

    The first design missed ten times its bound with the nodes that the slider-crank's own singularities ask for.
    """
    near = {"crank": 96.99087966054856, "rod": 145.43978090316, "offset": 14.422336528547007,
            "knife_along": 68.8038471022667, "knife_across": 53.873240992531834}  # fmt: skip
    far = {"crank": 20.87909835956459, "rod": 105.30723758854514, "offset": 29.041766938811506,
           "knife_along": 274.37739301561913, "knife_across": -8.972565018110934}  # fmt: skip
    columns = {name: [near[name], far[name]] for name in near}
    names = metrics("curvature_mean", "curvature_std")
    rows = explore.evaluate("slider-crank", columns, points="knife", metrics=names, window="cycle")
    strict = explore.evaluate("slider-crank", columns, points="knife", metrics=names, window="cycle", tolerance=1e-12)
    for name in names:
        # of a mean relative to the rms, which is at least the standard deviation
        difference = np.abs(rows[name] - strict[name]) / strict["knife_curvature_std"]
        assert (difference <= rows["error"] + strict["error"]).all(), name
    assert (rows["error"] <= 1e-9).all()


def near_cusps(count, seed):
    """Crank-rockers with a point next to the one that rests at some crank angle, by 1e-6 to 0.1 of its distance."""
    rng = np.random.default_rng(seed)
    ranges = {"crank": (50.0, 150.0), "coupler": (800.0, 900.0), "rocker": (400.0, 500.0), "ground": (700.0, 800.0)}
    designs = {name: rng.uniform(*ends, count) for name, ends in ranges.items()}
    angles, places = rng.uniform(0.0, 360.0, count), np.empty(count, dtype=complex)
    for i in range(count):
        design = {name: float(lengths[i]) for name, lengths in designs.items()}
        motion = explore.simulate("crank-rocker", design | {"speed": 1.0}, angles=[angles[i]]).iloc[0]
        turn = np.exp(1j * np.deg2rad(angles[i] - motion["coupler_angle"]))
        places[i] = -design["crank"] * turn / motion["coupler_velocity"]
    places *= 1.0 + 10.0 ** rng.uniform(-6.0, -1.0, count) * np.exp(2j * np.pi * rng.random(count))
    return designs | {"knife_along": places.real, "knife_across": places.imag}


@pytest.mark.parametrize("window", ["cycle", "drive", {"from": 20, "to": 140}])
def test_curvature_is_within_its_bound_beside_cusps(window):
    """At any tolerance the samples tell of a peak as narrow as 1e-6 rad beside a path that nearly stops."""
    designs, names = near_cusps(120, 9), metrics("curvature_mean", "curvature_rms", "curvature_peak")
    strict, *others = (
        explore.evaluate("crank-rocker", designs, points="knife", metrics=names, window=window, tolerance=tolerance)
        for tolerance in (1e-12, 1e-9, 1e-6)
    )
    size = {"knife_curvature_peak": strict["knife_curvature_peak"]}
    for rows in others:
        assert (rows["status"] == Status.OK).sum() > 60
        for name in names:
            difference = np.abs(rows[name] - strict[name]) / size.get(name, strict["knife_curvature_rms"])
            assert (difference <= rows["error"] + strict["error"]).all(), name


def test_bounds_hold_near_the_change_point():
    """The error model of the coupler's own rates missed up to four times: its direction has their poles, too."""
    rng, count = np.random.default_rng(3), 300
    coupler, rocker = rng.uniform(50.0, 300.0, (2, count))
    crank = rng.uniform(5.0, 40.0, count)
    shortest = abs(coupler - rocker) + crank * (1.0 + 10.0 ** rng.uniform(-6.0, 0.0, count))
    designs = {"crank": crank, "coupler": coupler, "rocker": rocker, "ground": shortest}
    designs |= {"knife_along": rng.normal(50.0, 100.0, count), "knife_across": rng.normal(0.0, 100.0, count)}
    for name in ("velocity_x", "velocity_y", "acceleration_x", "acceleration_y"):
        variance, rms = metrics(f"{name}_variance", f"{name}_rms")
        frame, exact = (
            explore.evaluate("crank-rocker", designs, metrics=[variance, rms], window="cycle", points=["knife"],
                             tolerance=tolerance)
            for tolerance in (1e-6, 1e-10)
        )  # fmt: skip
        assert (frame["status"] == Status.OK).all()
        error = (frame[variance] - exact[variance]).abs() / exact[rms] ** 2
        assert (error <= frame["error"] + exact["error"]).all(), name


@pytest.mark.parametrize(("mechanism", "design", "place"), CASES)
def test_the_drawing_follows_the_point(mechanism, design, place):
    drawn = MECHANISMS[mechanism].with_points(("knife",))
    motion = explore.simulate(mechanism, design, points={"knife": place}, angles=36)
    parameters = {**design, "knife_along": place[0], "knife_across": place[1]}
    columns = {name: motion[name].to_numpy() for name in motion}
    own = {signal.name for signal in MECHANISMS[mechanism].signals}
    pose = Pose.of(drawn.signals, parameters, {n: v for n, v in columns.items() if n in own}, motion.index.to_numpy())
    points = pose.points(drawn.drawing)
    expected = motion[["knife_x", "knife_y"]].to_numpy()
    assert points["point knife"] == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())
    assert [path.point for path in drawn.drawing.paths if path.role == "point"][-1:] == ["point knife"]


def test_a_double_crank_has_points_too():
    columns = {**DOUBLE_CRANK, "knife_along": 50.0, "knife_across": 30.0}
    names = metrics("x_max", "velocity_mean", "acceleration_max", "curvature_max")
    row = explore.evaluate("crank-rocker", columns, points=["knife"], metrics=names, window="cycle").iloc[0]
    assert row["status"] == Status.OK
    assert np.isfinite(row[names].astype(float)).all()


@pytest.mark.parametrize(
    ("mechanism", "design", "others"),
    [
        ("crank-rocker", PUBLISHED, ["drive_torque_max"]),
        ("test-rig", RIG, ["drive_torque_max", "velocity_thd", "swing_sensitivity_ground"]),
    ],
)
def test_points_and_forces_in_one_request(mechanism, design, others):
    columns, names = {**design, "inertia": 2.0, "knife_along": 120.0, "knife_across": -40.0}, ["knife_x_max", *others]
    one = explore.evaluate(mechanism, columns, points=["knife"], metrics=names)
    for name in names:
        alone = explore.evaluate(mechanism, columns, points=["knife"], metrics=[name])
        assert one[name][0] == pytest.approx(alone[name][0], rel=1e-9), name


def test_a_test_rig_is_a_crank_rocker_to_a_point():
    columns = {**RIG, "coupler_mass": 3.0, "knife_along": [300.0, -50.0], "knife_across": 80.0}
    names = [
        *metrics("x_mean", "velocity_max", "acceleration_y_rms", "curvature_peak"),
        "coupler_angle_mean",
        "power_rms",
    ]
    rig, own = (
        explore.evaluate(mechanism, columns, points="knife", metrics=names, window="cycle")
        for mechanism in ("test-rig", "crank-rocker")
    )
    for name in names:
        assert rig[name].to_numpy() == pytest.approx(own[name].to_numpy(), rel=1e-12), name


def test_each_of_four_points_has_its_own_rows():
    places = {"a": (0.0, 0.0), "b": (300.0, 50.0), "c": (-20.0, 10.0), "d": (500.0, -70.0)}
    designs = {"crank-rocker": PUBLISHED, "test-rig": RIG, "slider-crank": SLIDER, "variable-crank": VARIABLE}
    for mechanism, design in designs.items():
        together = explore.simulate(mechanism, design, points=places, angles=ANGLES)
        for name, place in places.items():
            alone = explore.simulate(mechanism, design, points={"knife": place}, angles=ANGLES)
            for signal in SIGNALS:
                assert np.array_equal(together[f"{name}_{signal}"], alone[f"knife_{signal}"]), (mechanism, signal)
        along = {f"{name}_along": place[0] for name, place in places.items()}
        columns = {**design, **along, **{f"{name}_across": place[1] for name, place in places.items()}}
        names = [f"{name}_velocity_rms" for name in places]
        row = explore.evaluate(mechanism, columns, points=list(places), metrics=names, window="cycle").iloc[0]
        fine = explore.simulate(mechanism, design, points=places, angles=3600)
        for name in places:
            expected = np.sqrt((fine[f"{name}_velocity"] ** 2).mean())
            assert row[f"{name}_velocity_rms"] == pytest.approx(expected, rel=1e-5)  # breaks, as above


def test_designs_at_other_speeds_share_an_evaluation():
    columns = {**PUBLISHED, "speed": [1.0, 2.0, 4.0], "knife_along": 120.0, "knife_across": -40.0}
    names = metrics("x_max", "velocity_max", "velocity_y_variance", "acceleration_mean", "curvature_max")
    rows = explore.evaluate("crank-rocker", columns, points=["knife"], metrics=names)
    assert rows.attrs["kinematic_evaluations"] == 1
    for name, power in zip(names, (0, 1, 2, 2, 0), strict=True):
        values = rows[name].to_numpy()
        assert values == pytest.approx(values[0] * np.array([1.0, 2.0, 4.0]) ** power, rel=1e-14)


@pytest.mark.parametrize("others", [[], ["drive_torque_max"]])
@pytest.mark.parametrize(("mechanism", "design"), [("crank-rocker", PUBLISHED), ("test-rig", RIG)])
def test_a_worker_has_the_kernel_of_the_request(mechanism, design, others):
    """A kernel has rows for the signals of its request only; those of another one would be other signals."""
    points = ("blade", "knife")
    names = ["knife_velocity_max", "blade_x_min", *others]
    request = make_request(find_mechanism(mechanism, points, None), metrics=names, window="cycle")
    copy = pickle.loads(pickle.dumps(request))
    assert copy.kernel.signal_rows == request.kernel.signal_rows
    assert copy.kernel.signals == request.kernel.signals
    loaded, places = {**design, "inertia": 2.0}, dict.fromkeys(points, (40.0, 40.0))
    columns = loaded | dict.fromkeys([f"{point}_{way}" for point in points for way in COORDINATES], 40.0)
    columns = {name: np.array([value]) for name, value in columns.items()}
    whole = explore.simulate(mechanism, loaded, points=places, angles=720)
    for each in (request, copy):
        found = evaluate_columns(each, columns).columns
        assert found["knife_velocity_max"] == pytest.approx(whole["knife_velocity"].max(), rel=1e-4)
        assert found["blade_x_min"] == pytest.approx(whole["blade_x"].min(), rel=1e-4)


def test_names_are_collected_once(monkeypatch):
    """Another request with the same points does not go through all names of metrics again."""
    find_mechanism("crank-rocker", list("PQRS"))

    monkeypatch.setattr(Mechanism, "metric_names", None)

    assert find_mechanism("crank-rocker", list("PQRS")).points == tuple("PQRS")
