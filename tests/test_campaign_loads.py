"""The error bound over hard designs under load, every request alone, against free bodies with 60 digits."""

import norms
import numpy as np
import pytest
from exact_groove import ExactGroove
from exact_loads import ExactFourBar, ExactSliderCrank
from flint import ctx

import explore
from explore.model.status import Status

TOLERANCES = (1e-6, 1e-9, 1e-12)
MOMENTS, EXTREMES = ("mean", "rms"), ("min", "max")
FOUR_BAR_REQUESTS = {
    **dict.fromkeys(("coupler_force", "rocker_axial_force", "rocker_moment", "power"), (*MOMENTS, *EXTREMES)),
    "drive_torque": ("rms", "max"),
    "positive_power": ("mean", "rms", "max"),
    "friction_power": ("mean",),
    **{f"pin_force_{pin}": ("rms", "max") for pin in "abcd"},
}
SLIDER_REQUESTS = {
    **dict.fromkeys(("thrust", "guide_force", "drive_power"), (*MOMENTS, *EXTREMES)),
    "drive_torque": ("rms", "max"),
    "positive_power": ("mean", "rms", "max"),
    "friction_power": ("mean", "max"),
    **{f"{name}_force": ("rms", "max") for name in ("crank_pivot", "crank_pin", "slider_pin")},
}
GROOVE_REQUESTS = {
    **dict.fromkeys(("thrust", "guide_force", "groove_force", "slot_force", "drive_power"), (*MOMENTS, *EXTREMES)),
    "drive_torque": ("rms", "max"),
    "positive_power": ("mean", "rms", "max"),
    "friction_power": ("mean", "max"),
    **{f"{name}_force": ("rms", "max") for name in ("crank_pin", "slider_pin", "disc_pivot")},
}


#: Designs that were found outside their bounds, with a window, a metric, its value in many digits, and its size.
FOUND = (
    # power for 0.028 deg at a dead centre
    ("slider-crank", {
        "crank": 52.938245010195104, "rod": 251.59347170971142, "offset": 53.96951538068481,
        "speed": 0.330221171059648, "rod_centroid": 0.9908847893852848, "mass": 0.35727359665797187,
        "crank_mass": 0.01821048023855686, "rod_mass": 0.04936896669018185, "damping": 0.2423033753276116,
        "constant_force": -184.35782144386062, "opposing_force": 28.193131598998313, "friction": 0.2266977420351421,
    }, "outer_to_inner", "positive_power_mean", 1.2366912414077324e-07, 1.1529e-05),
    # next to a change point
    ("slider-crank", {
        "crank": 37.011443933809694, "rod": 37.01144395537789, "offset": -1.7019426828762207e-08,
        "speed": 3.90628100583467, "rod_inertia": 3.680645787793719e-4, "rod_centroid": -0.22676796225185458,
        "stiffness": 1857.2525057144112,
    }, "cycle", "positive_power_mean", 1.584381090617515, 3.9413),
    # an extreme at 0.09 % of a reversal from its end, whose slope five samples do not tell
    ("variable-crank", {
        "rod": 1463.2258961785892, "slider_speed": 986.6401869422025, "speed": 9.034065863059226,
        "reversal_time": 1.9819115311976676e-09, "blend_order": 3,
    }, "cycle", "crank_rate_peak", 986.64017445198836213, 986.64),
    # at 0.04 %, 1.8e-13 below the end: far from a bracket's middle it was hidden by rounding
    ("variable-crank", {
        "rod": 195.65760052747274, "slider_speed": 54.101957131393505, "speed": 1.53017032228017,
        "reversal_time": 9.018011803487938e-10, "blend_order": 3,
    }, "inner_to_outer", "groove_pressure_angle_max", 34.016791885511121708, 34.0167),
    # a last step that is small by chance, from points that are not near enough
    ("variable-crank", {
        "rod": 443.4392628932239, "speed": 9.905581078103946, "slider_speed": 193.50725235278696,
        "reversal_time": 0.0026425529451765445, "blend_order": 3, "mass": 1.2656920004857595,
        "opposing_force": 1.4190093048379537, "stiffness": 118.17988782416754, "damping": 0.14275968924426152,
        "rod_inertia": 0.0002652915626231122, "pin_mass": 0.44868199817466625, "disc_centroid": 3.4984867347341346,
    }, {"from": 116, "to": 241}, "thrust_min", -5.042896084251845, 403.29),
    # 1e-12 deg, shorter than the least step of the search
    ("crank-rocker", {
        "crank": 50.0, "coupler": 171.4341743061304, "rocker": 133.91733647639305, "ground": 163.62548246172335,
    }, {"from": "40.64 deg", "to": "40.640000000001 deg"}, "coupler_acceleration_min", 0.34429071443908706, 0.34429),
    # ground of 30,000 rockers
    ("crank-rocker", {
        "crank": 22.2, "coupler": 2999991.8, "rocker": 100.0, "ground": 3e6, "branch": -1.0, "speed": 7.7,
        "coupler_mass": 1.84, "inertia": 0.079, "opposing_torque": 1.81,
    }, "overlapped_to_extended", "rocker_axial_force_min", 0.009327984846829791, 10.37675535848667),
)  # fmt: skip


@pytest.fixture(autouse=True)
def _many_digits():
    with ctx.workprec(256):
        yield


def power_of_ten(rng, low, high):
    return float(10.0 ** rng.uniform(low, high))


def slider_like(rng):
    """A four-bar whose ground and coupler are 1,000 to 1,000,000 times as long as its rocker, with any load."""
    rocker = power_of_ten(rng, 1.0, 3.0)
    crank, ground = rocker * rng.uniform(0.02, 0.7), rocker * power_of_ten(rng, 3.0, 6.0)
    design = {
        "crank": crank, "rocker": rocker, "ground": ground, "speed": power_of_ten(rng, -0.5, 2.0),
        # between the lengths at which the crank does not turn
        "coupler": ground + 0.95 * (rocker - crank) * rng.uniform(-1.0, 1.0),
        "inertia": power_of_ten(rng, -3.0, 0.0), "coupler_mass": power_of_ten(rng, -1.0, 1.0),
    }  # fmt: skip
    for name, low, high in (
        ("constant_torque", -1.0, 2.0), ("opposing_torque", -1.0, 1.0), ("stiffness", 0.0, 2.0), ("damping", -2.0, 1.0),
        ("crank_mass", -1.0, 1.0), ("rocker_mass", -1.0, 1.0), ("coupler_inertia", -3.0, 0.0),
        ("rocker_inertia", -3.0, 0.0),
    ):  # fmt: skip
        if rng.random() < 0.4:
            design[name] = power_of_ten(rng, low, high)
    return design


def crank_rocker(rng):
    return slider_like(rng) | {"branch": float(rng.choice((-1.0, 1.0)))}


def slider_crank(rng):
    """A slider-crank with any load."""
    crank = power_of_ten(rng, 1.0, 2.5)
    rod = crank * (1.0 + power_of_ten(rng, -3.0, 1.0))
    design = {
        "crank": crank, "rod": rod, "offset": (rod - crank) * rng.uniform(-0.9, 0.9),
        "speed": power_of_ten(rng, -0.5, 2.0), "mass": power_of_ten(rng, -1.0, 1.0),
    }  # fmt: skip
    for name, low, high in (
        ("opposing_force", 0.0, 2.5), ("stiffness", 1.0, 4.0), ("damping", -1.0, 2.0), ("crank_mass", -2.0, 1.0),
        ("rod_mass", -2.0, 1.0), ("rod_inertia", -4.0, -1.0),
    ):  # fmt: skip
        if rng.random() < 0.5:
            design[name] = power_of_ten(rng, low, high)
    return design


def variable_crank(rng):
    """A variable crank of short and of long reversals, with any load."""
    rod, speed = power_of_ten(rng, 2.0, 3.0), power_of_ten(rng, 0.0, 1.5)
    design = {
        "rod": rod, "speed": speed, "slider_speed": rod * speed * rng.uniform(0.03, 0.5),
        "reversal_time": power_of_ten(rng, -2.0, 0.35) / speed, "blend_order": float(rng.integers(1, 4)),
        "mass": power_of_ten(rng, -1.0, 1.0),
    }  # fmt: skip
    for name, low, high in (
        ("constant_force", 0.0, 2.5), ("opposing_force", 0.0, 2.5), ("stiffness", 1.0, 4.0), ("damping", -1.0, 2.5),
        ("friction", -2.0, -0.1), ("rod_mass", -1.0, 1.0), ("rod_inertia", -4.0, -1.0), ("pin_mass", -1.0, 0.3),
        ("disc_mass", -0.3, 1.3), ("disc_centroid", 0.0, 2.0),
    ):  # fmt: skip
        if rng.random() < 0.5:
            design[name] = power_of_ten(rng, low, high)
    return design


def narrow_pulse_of_variable_crank(rng):
    """A constant force with which the power is positive for 1e-6 to 1e-1 of a stroke, or nearly so."""
    names = "variable-crank", "slider_velocity", "drive_power", "constant_force"
    return pulse(rng, variable_crank(rng), names, 1e-3)


def steepest(design):
    """Largest tangent of the rod's angle."""
    sine = (design["crank"] + abs(design["offset"])) / design["rod"]
    return sine / np.sqrt(1.0 - sine * sine)


def friction_near_dead_centres(rng):
    """A constant force that changes the sign of the guide's force, or of the power, near a dead centre."""
    design = slider_crank(rng)
    design["friction"] = min(1.0, 0.9 / steepest(design)) * rng.uniform(0.1, 1.0)
    stop = rng.choice(("outer_angle", "inner_angle"))
    angle = float(explore.evaluate("slider-crank", design, metrics=[stop])[stop].iloc[0])
    angle += float(rng.choice((-1.0, 1.0))) * power_of_ten(rng, -4.0, 0.5)
    balanced = rng.choice(("guide_force", "drive_power"))
    return balance(design, balanced, angle, 0.0)


def narrow_pulse(rng):
    """A constant force with which the power is positive for 1e-6 to 1e-1 of a stroke, or nearly so."""
    design = slider_crank(rng)
    return pulse(rng, design, ("slider-crank", "slider_velocity", "drive_power", "constant_force"), 1e-3)


def narrow_pulse_of_four_bar(rng):
    """The same by a constant torque."""
    return pulse(rng, crank_rocker(rng), ("crank-rocker", "rocker_velocity", "power", "constant_torque"), 1.0)


def pulse(rng, design, names, unit):
    """The design with a constant load that leaves the power positive near one angle; the velocity has this SI unit."""
    mechanism, velocity_name, power_name, load = names
    angles = np.linspace(0.0, 360.0, 721)
    motion = explore.simulate(mechanism, design | {load: 1.0}, angles=angles)
    velocity, power = unit * motion[velocity_name].to_numpy(), motion[power_name].to_numpy()
    ends = np.abs(velocity) > 1e-3 * np.abs(velocity).max()
    way = velocity > 0.0 if rng.random() < 0.5 else velocity < 0.0
    ratio = np.divide(power, np.abs(velocity), out=np.full_like(power, -np.inf), where=ends & way)
    size = np.abs(power).max() / np.abs(velocity).max()
    angle, excess = float(angles[np.argmax(ratio)]), power_of_ten(rng, -10.0, -2.0) * size
    return balance(design, power_name, angle, excess, mechanism, load)


def balance(design, name, angle, excess, mechanism="slider-crank", load="constant_force"):
    """The design with a constant load that makes a signal 0 at an angle, or the power as much as an excess of load.

    Without friction both are linear in the load. With it the zero is elsewhere, but near.
    """
    plain = {key: value for key, value in design.items() if key != "friction"}
    without, with_one = (
        explore.simulate(mechanism, plain | {load: value}, angles=np.array([angle, angle + 1e-9]))
        for value in (1e-12, 1.0)
    )
    slope = with_one[name].iloc[0] - without[name].iloc[0]
    return design | {load: float(-without[name].iloc[0] / slope + excess * np.sign(slope))}


def strokes_of(first, second):
    """A window of whole strokes, as a request and a reference take it."""

    def draw(rng):
        name = str(rng.choice(("cycle", f"{first}_to_{second}", f"{second}_to_{first}")))
        return name, name

    return draw


def interval(rng):
    """An interval of 1 to 300 deg, also across angle 0, as a request and a reference take it."""
    start = int(rng.integers(-90, 270))
    stop = start + int(power_of_ten(rng, 0.0, 2.47))
    return {"from": start, "to": stop}, {"start": start, "stop": stop}


FOUR_BAR_WINDOWS, SLIDER_WINDOWS = strokes_of("overlapped", "extended"), strokes_of("outer", "inner")
GROOVE_WINDOWS = strokes_of("outer", "inner")
FAMILIES = {
    "slider-like four-bar": ("crank-rocker", ExactFourBar, crank_rocker, FOUR_BAR_REQUESTS, FOUR_BAR_WINDOWS),
    "slider-like test rig": ("test-rig", ExactFourBar, slider_like, FOUR_BAR_REQUESTS, FOUR_BAR_WINDOWS),
    "friction near dead centres": (
        "slider-crank", ExactSliderCrank, friction_near_dead_centres, SLIDER_REQUESTS, SLIDER_WINDOWS,
    ),
    "narrow positive power": ("slider-crank", ExactSliderCrank, narrow_pulse, SLIDER_REQUESTS, SLIDER_WINDOWS),
    "intervals of four-bars": ("crank-rocker", ExactFourBar, crank_rocker, FOUR_BAR_REQUESTS, interval),
    "intervals of slider-cranks": (
        "slider-crank", ExactSliderCrank, friction_near_dead_centres, SLIDER_REQUESTS, interval,
    ),
    "narrow positive power of four-bars": (
        "crank-rocker", ExactFourBar, narrow_pulse_of_four_bar, FOUR_BAR_REQUESTS, FOUR_BAR_WINDOWS,
    ),
    "variable cranks": ("variable-crank", ExactGroove, variable_crank, GROOVE_REQUESTS, GROOVE_WINDOWS),
    "intervals of variable cranks": ("variable-crank", ExactGroove, variable_crank, GROOVE_REQUESTS, interval),
    "narrow positive power of variable cranks": (
        "variable-crank", ExactGroove, narrow_pulse_of_variable_crank, GROOVE_REQUESTS, GROOVE_WINDOWS,
    ),
}  # fmt: skip


def ratios(family, seed, count):
    """True error over bound of each request of random designs, with what it was."""
    mechanism, exact, draw, requests, draw_window = FAMILIES[family]
    rng, result = np.random.default_rng(seed), []
    for _ in range(count):
        design = draw(rng)
        window, place = draw_window(rng)
        truth = exact(design).statistics(place, tuple(requests))
        for name, statistics in requests.items():
            assert np.isfinite(truth[name]).all(), (name, window, design)
            mean, square, low, high = truth[name]
            if square == 0.0:
                continue
            for statistic in statistics:
                for tolerance in TOLERANCES:
                    row = explore.evaluate(
                        mechanism, design, metrics=[f"{name}_{statistic}"], window=window, tolerance=tolerance
                    ).iloc[0]
                    assert row["status"] in (Status.OK, Status.TOLERANCE_NOT_MET), design
                    assert (row["status"] == Status.OK) == (row["error"] <= tolerance), design
                    value = row[f"{name}_{statistic}"]
                    variance = max(square - mean**2, 0.0)  # of a signal that is nearly constant, rounding alone
                    error = norms.worst(statistic, value, mean, variance, (low, high))
                    # the reference is rounded to a double
                    error = max(error - 2.3e-16, 0.0)
                    ratio = 0.0 if error == 0.0 else error / row["error"] if row["error"] else np.inf
                    result.append((ratio, f"{name}_{statistic} over {window} at {tolerance:g}: {design}"))
    return result


def check(family, seed, count):
    """At most one row in 1,000 errs by more than its bound, and none by more than ten times."""
    found = sorted(ratios(family, seed, count), reverse=True)
    assert found[0][0] <= 10.0, found[0]
    above = [row for row in found if row[0] > 1.0]
    assert len(above) <= max(1, len(found) // 1000), (len(above), len(found), above[:3])


@pytest.mark.parametrize(("mechanism", "design", "window", "metric", "true", "size"), FOUND)
@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_bounds_hold_where_they_did_not(mechanism, design, window, metric, true, size, tolerance):
    row = explore.evaluate(mechanism, design, metrics=[metric], window=window, tolerance=tolerance).iloc[0]
    assert row["status"] == (Status.OK if row["error"] <= tolerance else Status.TOLERANCE_NOT_MET)
    assert row["error"] <= max(tolerance, 1e-9)
    assert abs(row[metric] - true) <= row["error"] * size


@pytest.mark.parametrize(("seed", "count"), [(0, 3), pytest.param(1, 150, marks=pytest.mark.slow)])
@pytest.mark.parametrize("family", FAMILIES)
def test_bounds_hold(family, seed, count):
    check(family, seed, count)
