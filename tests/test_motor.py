"""A motor that the load slows down, behind a flywheel: closed forms, Fourier series, and limits."""

import mpmath
import numpy as np
import pytest
from linkage_cases import CASES, FOUR_BAR, values_of, with_loads

import explore
from explore.base.errors import ConfigError, RequestError
from explore.model.status import Status

ENERGY, LARGEST = "drive_torque_lagged_fluctuation_cycle", "drive_torque_lagged_max_cycle"
METRICS = ["speed_fluctuation", "motor_torque_max", ENERGY, LARGEST, "drive_torque_rms_cycle"]
SLIDER, HOECKEN = CASES["slider-crank"], CASES["hoecken"]
SPEED = 7.0


def evaluate(linkage, design, metrics=METRICS, **settings):
    settings = {"tolerance": 1e-10, "window": "cycle"} | settings
    return explore.evaluate(linkage, design | {"speed": SPEED}, metrics=metrics, **settings).iloc[0]


def driven(case, flywheel, slope, **loads):
    return with_loads(case, {**loads, "motor": {"flywheel": flywheel, "slope": slope}})


@mpmath.workdps(40)
def segments_behind_lag(angles, torques, rate):
    """The largest torque behind a lag, and the range of its integral, of torques that are straight between deg.

    On a straight piece, of the slope b, M is T - b/r and a multiple of exp(-r phi); it is largest at the ends of
    pieces, or where that has the slope b.
    """
    angles, torques = mpmath.mp.pi * angles / 180, torques * mpmath.mpf(1)
    rate = mpmath.mpf(rate)
    lengths, slopes = np.diff(angles), np.diff(torques) / np.diff(angles)

    def follow(start):
        ends = [start]
        for torque, slope, length in zip(torques, slopes, lengths, strict=False):
            rest = ends[-1] - (torque - slope / rate)
            yield ends[-1]
            if rest * slope > 0.0 and 0.0 < (turned := mpmath.log(rate * rest / slope) / rate) < length:
                yield torque + slope * (turned - 1.0 / rate) + rest * mpmath.exp(-rate * turned)
            ends.append(torque + slope * (length - 1.0 / rate) + rest * mpmath.exp(-rate * length))
        yield ends[-1]

    without = [*follow(mpmath.mpf(0))][-1]
    values = [*follow(without / -mpmath.expm1(-2 * mpmath.mp.pi * rate))]
    assert mpmath.almosteq(values[-1], values[0], 1e-25)
    return float(max(values)), float((max(values) - min(values)) / rate)


def harmonics_behind_lag(torque, rate):
    """The same of a torque at equal steps of a turn, by its Fourier series and Newton's method for the extremes."""
    orders = np.arange(len(torque) // 2 + 1)
    series = np.fft.rfft(torque) / len(torque)
    energy = np.where(orders > 0, -2.0 * series / np.where(orders > 0, 1j * orders + rate, 1.0), 0.0)

    def value(angles, derivative):
        return (np.exp(1j * np.outer(angles, orders)) @ (energy * (1j * orders) ** derivative)).real

    at_steps = np.fft.irfft(energy * (0.5 * len(torque)), len(torque))
    angles = np.array([np.argmin(at_steps), np.argmax(at_steps)]) * (2.0 * np.pi / len(torque))
    for _ in range(4):
        angles = angles - value(angles, 1) / value(angles, 2)
    low, high = value(angles, 0)
    return series[0].real - rate * low, high - low


@pytest.mark.parametrize("slope", [1e-3, 0.5, 30.0, 4e3])
def test_a_torque_of_straight_pieces_has_a_closed_form(slope):
    """To the tolerance; what the crank is loaded with is what the drive gives."""
    angles, torques = np.array([0.0, 40.0, 95.0, 200.0, 360.0]), np.array([10.0, 10.0, 90.0, -20.0, 10.0])
    curve = {"over": "crank_angle", "points": np.stack([angles, torques], axis=1).tolist()}
    linkage = driven(HOECKEN, 2.0, slope, torques={"crank": "-1 * press"}, curves={"press": curve})
    row, rate = evaluate(linkage, values_of(HOECKEN)), slope / (2.0 * SPEED)
    largest, energy = segments_behind_lag(angles, torques, rate)
    rms = row["drive_torque_rms_cycle"]
    assert row["status"] == 1
    assert row["error"] <= 1e-10
    assert row[ENERGY] == pytest.approx(energy, abs=row["error"] * rms * 2.0 * np.pi)
    assert row["motor_torque_max"] == row[LARGEST] == pytest.approx(largest, abs=row["error"] * max(rms, largest))
    assert row["speed_fluctuation"] == pytest.approx(row[ENERGY] / (2.0 * SPEED**2), rel=1e-14)


@pytest.mark.parametrize(("flywheel", "slope"), [(0.8, 2.5), (0.05, 0.7), (0.1, 20.0), (50.0, 1e-4)])
@pytest.mark.parametrize(
    "loads", [{"masses": {"B": 2.0}}, {"masses": {"B": 2.0}, "dampers": {"cut": {"between": "guide", "rate": 9}}}]
)
def test_a_smooth_torque_equals_its_fourier_series(flywheel, slope, loads):
    """To the tolerance, also where the panels are cut at reversals."""
    linkage = driven(SLIDER, flywheel, slope, **loads, forces={"B": [-40, 0]})
    design = values_of(SLIDER)
    row = evaluate(linkage, design)
    motion = explore.simulate(linkage, design | {"speed": SPEED}, angles=np.arange(512) * (360.0 / 512.0))
    largest, energy = harmonics_behind_lag(motion["drive_torque"].to_numpy(), slope / (flywheel * SPEED))
    rms = row["drive_torque_rms_cycle"]
    assert row["error"] <= 1e-10
    assert row[ENERGY] == pytest.approx(energy, abs=row["error"] * rms * 2.0 * np.pi)
    assert row[LARGEST] == pytest.approx(largest, abs=(row["error"] + 1e-14) * max(rms, abs(largest)))


def test_a_torque_with_corners_is_that_of_many_samples():
    """Friction jumps at reversals, where its power has corners; that of 2^16 samples is good to 1e-9."""
    linkage = driven(SLIDER, 0.4, 3.0, masses={"B": 2.0}, opposing={"guide": 60.0})
    design, count = values_of(SLIDER), 2**16
    row = evaluate(linkage, design)
    motion = explore.simulate(linkage, design | {"speed": SPEED}, angles=np.arange(count) * (360.0 / count))
    largest, energy = harmonics_behind_lag(motion["drive_torque"].to_numpy(), 3.0 / (0.4 * SPEED))
    assert row[ENERGY] == pytest.approx(energy, rel=2e-9)
    assert row[LARGEST] == pytest.approx(largest, rel=2e-9)


def test_a_steady_motor_leaves_all_to_the_flywheel():
    """And one that hardly turns faster without a load gives what the load takes, to 1 % of its change in a radian."""
    loads = {"masses": {"B": 2.0}, "forces": {"B": [-40, 0]}}
    others = ["energy_fluctuation", "drive_torque_mean_cycle", "drive_torque_max_cycle", *METRICS]
    steady = evaluate(driven(SLIDER, 0.8, 0.0, **loads), values_of(SLIDER), others)
    assert steady[ENERGY] == pytest.approx(steady["energy_fluctuation"], rel=1e-11)
    assert steady["motor_torque_max"] == pytest.approx(steady["drive_torque_mean_cycle"], abs=1e-14)
    stiff = evaluate(driven(SLIDER, 0.8, 800.0, **loads), values_of(SLIDER), others)
    assert stiff["motor_torque_max"] == pytest.approx(stiff["drive_torque_max_cycle"], rel=1e-3)
    assert stiff["motor_torque_max"] < stiff["drive_torque_max_cycle"]


def test_a_motor_that_is_nearly_steady_keeps_its_digits():
    """What the mean is off by, over the rate, is no part of the energy."""
    linkage = driven(SLIDER, "J", "k", masses={"B": 2.0})
    slopes = np.array([0.0, 9e-30, 1e-26, 1e-24, 1e-22, 1e-20, 1e-18, 1e-15])
    design = values_of(SLIDER) | {"J": 0.8, "k": slopes, "speed": SPEED}
    rows = explore.evaluate(linkage, design, metrics=METRICS, window="cycle", tolerance=1e-10)
    assert (rows["status"] == 1).all()
    assert rows[ENERGY].to_numpy() == pytest.approx(rows[ENERGY][0], rel=1e-13)
    assert rows[LARGEST].to_numpy() == pytest.approx(rows[LARGEST][0], abs=1e-14)


@pytest.mark.parametrize("slope", [2.01, 1e5, 1e300])
def test_a_motor_that_follows_the_load_at_once_has_no_numbers(slope):
    """Its largest torque is that of the drive, which is a metric of its own."""
    row = evaluate(driven(SLIDER, 2e-3 / SPEED, slope, masses={"B": 2.0}), values_of(SLIDER))
    assert row["status"] == Status.NOT_FINITE
    assert np.isnan(row[METRICS[:4]].astype(float)).all()
    assert np.isfinite(evaluate(driven(SLIDER, 2e-3 / SPEED, 1.99, masses={"B": 2.0}), values_of(SLIDER))[ENERGY])


def test_parameters_of_a_motor_are_swept_and_no_flywheel_is_no_number():
    linkage = driven(SLIDER, "J", "k", masses={"B": 2.0})
    units = {p.name: (p.unit, p.affects) for p in linkage.mechanism.parameters}
    assert units["J"] == ("kg m^2", "load")
    assert units["k"] == ("N m s/rad", "load")
    design = values_of(SLIDER) | {"J": [0.4, 0.0, 0.8, 0.4], "k": [2.0, 2.0, 2.0, 0.0], "speed": SPEED}
    rows = explore.evaluate(linkage, design, metrics=["speed_fluctuation"], window="cycle")
    assert rows["status"].tolist() == [1, Status.NOT_FINITE, 1, 1]
    alone = explore.evaluate(linkage, {**design, "J": 0.8, "k": 2.0}, metrics=["speed_fluctuation"], window="cycle")
    assert rows["speed_fluctuation"][2] == alone["speed_fluctuation"][0]
    assert rows["speed_fluctuation"][0] < rows["speed_fluctuation"][3]


def test_a_motor_with_a_negative_amount_is_no_number():
    """Expressions can be negative; two of them give a rate, and a fluctuation that would rank first."""
    loads = {"masses": {"B": 2.0}, "motor": {"flywheel": "J - 1", "slope": "k - 1"}}
    linkage = with_loads(SLIDER, loads, J="kg m^2", k="N m s/rad")
    design = values_of(SLIDER) | {"J": [0.5, 2.0, 0.5, 2.0], "k": [2.0, 0.5, 0.5, 2.0], "speed": SPEED}
    rows = explore.evaluate(linkage, design, metrics=["speed_fluctuation"], window="cycle")
    assert rows["status"].tolist() == [Status.NOT_FINITE] * 3 + [1]
    assert np.isnan(rows["speed_fluctuation"][:3]).all()


def test_the_content_of_a_motor_describes_it():
    linkage = driven(SLIDER, "J", 2.5, masses={"B": 2.0})
    assert linkage.content["loads"]["motor"] == {"flywheel": "J", "slope": 2.5}
    assert explore.Linkage(linkage.content).mechanism.kernel_version == linkage.mechanism.kernel_version
    other = driven(SLIDER, "J", 2.6, masses={"B": 2.0})
    assert other.mechanism.kernel_version != linkage.mechanism.kernel_version


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"motor": {"flywheel": 0.8, "slope": 2.5}}, "motor: drives loads, and there is none"),
        ({"motor": {"flywheel": 0.8}, "masses": {"B": 1}}, "slope"),
        (
            {"motor": {"flywheel": -0.8, "slope": 1}, "masses": {"B": 1}},
            "motor.flywheel: must not be negative, got -0.8",
        ),
        (
            {"motor": {"flywheel": 0, "slope": 1}, "masses": {"B": 1}},
            "motor.flywheel: must not be 0: the motor's torque",
        ),
        ({"motor": 3.0, "masses": {"B": 1}}, r"motor = \{ flywheel = 0.8, slope = 2.5 \}"),
    ],
)
def test_what_is_no_motor_is_refused(content, message):
    with pytest.raises(ConfigError, match=message):
        explore.Linkage(FOUR_BAR | {"loads": content})


def test_only_a_link_that_turns_fully_has_a_motor():
    loads = {"masses": {"B": 1}, "motor": {"flywheel": 0.8, "slope": 2.5}}
    with pytest.raises(ConfigError, match="drives a link that turns fully, and crank does not"):
        explore.Linkage(FOUR_BAR | {"loads": loads, "range": [10, 50]})
    with pytest.raises(RequestError, match="a lagged_max is that of a full turn; use drive_torque_lagged_max_cycle"):
        explore.evaluate(
            explore.Linkage(FOUR_BAR | {"loads": loads}), {"r1": 40, "r2": 120, "r3": 80, "r4": 130, "speed": 1},
            metrics=["drive_torque_lagged_max_drive"],
        )  # fmt: skip
