"""Forces against motions of slots and links, which jump where these turn back, however often; springs between links."""

import math

import numpy as np
import pytest
from linkage_cases import CASES, FOUR_BAR, linkage_of, values_of, with_loads
from scipy.optimize import brentq

import explore
from explore import Linkage
from explore.base.errors import ConfigError
from explore.evaluation.evaluate import evaluate_columns
from explore.model.status import Status
from explore.studies.request.requests import make_request

SHAPER = CASES["crank-shaper"]
PRESS = CASES["toggle-press"]
OPPOSED = {"ram": 300.0, "block": 40.0, "lever": 2.0, "link": 0.5, "crank": 0.1}


def way_of(linkage, values, place, rate):
    """The whole way of a place over a turn, by all of its reversals, and how many there are."""
    angles = np.arange(0.0, 360.0, 0.5) + 0.123
    rates = explore.simulate(linkage, values, angles=angles.tolist())[rate].to_numpy()

    def at(angle):
        return explore.simulate(linkage, values, angles=[angle])[rate].iloc[0]

    found = [
        brentq(at, angles[k], angles[k] + 0.5, xtol=1e-9)
        for k in range(len(angles))
        if (rates[k] < 0.0) != (rates[(k + 1) % len(angles)] < 0.0)
    ]
    places = explore.simulate(linkage, values, angles=found)[place].to_numpy()
    return np.abs(np.diff(np.append(places, places[0]))).sum(), len(found)


def test_work_against_motions_is_force_times_way():
    """Of slots and links at once, whether output or not, to 1e-12: a quadrature across a jump would miss 1e-3."""
    linkage, values = with_loads(SHAPER, {"opposing": OPPOSED}), values_of(SHAPER) | {"speed": 3.0}
    ways = {name: way_of(linkage, values, f"{name}_position", f"{name}_velocity")[0] for name in ("ram", "block")}
    ways |= {name: way_of(linkage, values, f"{name}_angle", f"{name}_velocity")[0] for name in ("lever", "link")}
    work = sum(OPPOSED[name] * ways[name] / 1000.0 for name in ("ram", "block"))
    work += sum(OPPOSED[name] * math.radians(ways[name]) for name in ("lever", "link"))
    work += OPPOSED["crank"] * 2.0 * math.pi
    row = explore.evaluate(linkage, values, metrics=["net_work", "positive_work"], window="cycle", tolerance=1e-11)
    assert row["status"].iloc[0] == Status.OK
    assert row[["net_work", "positive_work"]].iloc[0].tolist() == pytest.approx([work, work], rel=1e-11)


def test_the_ram_of_a_press_turns_back_four_times():
    linkage, values = with_loads(PRESS, {"opposing": {"ram": 2000}}), values_of(PRESS)
    way, count = way_of(linkage, values, "ram_position", "ram_velocity")
    assert count == 4
    row = explore.evaluate(linkage, values, metrics=["net_work", "ram_velocity_max"], window="cycle", tolerance=1e-11)
    assert row["net_work"].iloc[0] == pytest.approx(2.0 * way, rel=1e-11)


def test_a_force_on_one_stroke_alone_takes_positive_work():
    """Half of it is a force, half opposes: on the other stroke they cancel, and the power is rounding."""
    linkage, values = with_loads(SHAPER, {"forces": {"S": [-150, 0]}, "opposing": {"ram": 150}}), values_of(SHAPER)
    metrics = ["net_work", "positive_work", "stroke"]
    row = explore.evaluate(linkage, values, metrics=metrics, window="cycle", tolerance=1e-11).iloc[0]
    assert row["status"] == Status.OK
    work = 0.3 * row["stroke"]
    assert row[["net_work", "positive_work"]].tolist() == pytest.approx([work, work], rel=1e-11)


def test_a_stroke_has_the_force_of_its_own_side():
    """No extreme over a stroke is that beyond its end, however the search for zeros rounds; near limits, too."""
    linkage = with_loads(SHAPER, {"opposing": {"ram": 300}})
    rng, count = np.random.default_rng(2), 200
    designs = {name: np.full(count, value) for name, value in values_of(SHAPER).items()}
    designs["crank"] = 120.0 * (1.0 - 10.0 ** rng.uniform(-6.0, -0.2, count))
    designs["link"] = rng.uniform(266.0, 400.0, count)
    forces = [f"S_force_on_link_x_{extreme}" for extreme in ("min", "max")]
    rates = [f"ram_velocity_{extreme}" for extreme in ("min", "max")]
    for stroke, sign in (("forward", 1.0), ("backward", -1.0)):
        for tolerance in (1e-6, 1e-12):
            request = make_request(
                linkage.mechanism, metrics=[*forces, *rates], window=stroke, tolerance=tolerance
            )  # fmt: skip
            columns = evaluate_columns(request, designs).columns
            ends = np.stack([columns[rate] for rate in rates])
            # Of some designs beside their limit a pair of reversals is narrower than the search for strokes sees.
            moves = np.abs(ends).min(axis=0) <= 1e-9 * np.abs(ends).max(axis=0)
            assert moves.sum() >= 20
            for metric in forces:
                assert columns[metric][moves] == pytest.approx(-300.0 * sign, rel=1e-12)


@pytest.mark.parametrize("name", ["crank-shaper", "toggle-press", "watt-1", "slider-crank", "excavator"])
def test_the_drive_gives_what_motions_against_forces_take(name):
    """Over a turn, with jumps where anything turns back; designs are cut there together, in pieces."""
    table = linkage_of(CASES[name]).mechanism.table
    slots = [slot.name for slot in table.slots if slot.name != table.driver]
    opposing = dict.fromkeys(slots, 50.0) | {link.name: 1.0 for link in table.links}
    loads = {"opposing": opposing, "friction": dict.fromkeys(slots[:1], 0.1), "masses": {table.points[-1]: 1.0}}
    linkage = with_loads(CASES[name], {key: load for key, load in loads.items() if load})
    rng = np.random.default_rng(5)
    designs = {key: value * rng.uniform(0.95, 1.05, 64) for key, value in values_of(CASES[name]).items()}
    rows = explore.evaluate(
        linkage, designs | {"speed": np.full(64, 5.0)}, window="cycle", tolerance=1e-11,
        metrics=["drive_power_mean", "drive_power_rms", "friction_power_mean"],
    )  # fmt: skip
    rows = rows[rows["status"] == Status.OK]
    assert len(rows) > 50
    difference = (rows["drive_power_mean"] - rows["friction_power_mean"]).abs() / rows["drive_power_rms"]
    assert difference.max() <= 1e-11
    # The adaptive rule begins with 576.
    assert rows["nodes"].median() < 500


def test_motions_are_opposed_over_an_interval_of_a_blocked_crank_and_over_a_range():
    short, interval = values_of(SHAPER) | {"link": 20.0}, {"from": 80, "to": 100}
    linkage = with_loads(SHAPER, {"opposing": {"ram": 300}})
    row = explore.evaluate(linkage, short, metrics=["drive_torque_mean"], window=interval, tolerance=1e-11).iloc[0]
    places = explore.simulate(linkage, short, angles=[80.0, 100.0])["ram_position"]
    assert row["drive_torque_mean"] == pytest.approx(
        0.3 * (places.iloc[0] - places.iloc[1]) / math.radians(20), rel=1e-10
    )
    limited = Linkage(linkage.content | {"range": [10, 90]})
    row = explore.evaluate(limited, values_of(SHAPER), metrics=["drive_torque_mean"], tolerance=1e-11).iloc[0]
    places = explore.simulate(limited, values_of(SHAPER), angles=[10.0, 90.0])["ram_position"]
    assert row["drive_torque_mean"] == pytest.approx(
        0.3 * (places.iloc[0] - places.iloc[1]) / math.radians(80), rel=1e-10
    )


def test_a_negative_parameter_opposes_nothing():
    """It would drive."""
    linkage = with_loads(SHAPER, {"opposing": {"ram": "cut"}})
    row = explore.evaluate(linkage, values_of(SHAPER) | {"cut": -3.0}, metrics=["drive_torque_mean"], window="cycle")
    assert row["status"].iloc[0] == Status.NOT_FINITE


@pytest.mark.parametrize("metrics", [["lever_angle_std", "drive_torque_cv"], ["drive_torque_cv", "lever_angle_std"]])
def test_what_is_not_finite_stays_so_beside_what_misses_the_tolerance(metrics):
    """A blank angle, of a lever that turns fully, had the status of values that are kept."""
    whitworth = CASES["whitworth"]
    linkage = with_loads(whitworth, {"opposing": {"ram": 1e-3}, "masses": {"S": 2.0}})
    row = explore.evaluate(linkage, values_of(whitworth), metrics=metrics, window="cycle", tolerance=1e-13).iloc[0]
    assert row["status"] == Status.NOT_FINITE
    assert math.isnan(row["error"])


@pytest.mark.parametrize("statistic", ["mean", "power_mean", "rms", "max"])
def test_statistics_of_a_force_that_is_not_finite_are_blank(statistic):
    """Means were 0: of a spring on a lever that turns fully."""
    whitworth, metric = CASES["whitworth"], f"C_force_on_frame_{statistic}"
    linkage = with_loads(whitworth, {"springs": {"s": {"between": "lever", "rate": 2.0, "rest": 0}}})
    row = explore.evaluate(linkage, values_of(whitworth), metrics=[metric], window="cycle").iloc[0]
    assert row["status"] == Status.NOT_FINITE
    assert math.isnan(row[metric])


def test_a_spring_between_two_links_follows_the_angle_between_them():
    """Its torque by the velocities of both; the crank takes what the links do not."""
    spring = {"between": ["link", "lever"], "rate": 1.5, "rest": -60}
    linkage, values = with_loads(SHAPER, {"springs": {"coil": spring}}), values_of(SHAPER) | {"speed": 2.0}
    motion = explore.simulate(linkage, values, angles=np.arange(0.0, 360.0, 15.0).tolist())
    angle = np.radians(motion["link_angle"] - motion["lever_angle"] + 60.0)
    expected = 1.5 * angle * (motion["link_velocity"] - motion["lever_velocity"]) / 2.0
    size = np.abs(expected).max()
    assert motion["drive_torque"].to_numpy() == pytest.approx(expected.to_numpy(), abs=1e-14 * size)
    assert Linkage(linkage.content) == linkage


@pytest.mark.parametrize(
    ("loads", "problem"),
    [
        ({"opposing": {"rim": 3}}, "opposing.rim: unknown slot or link 'rim'"),
        (
            {"springs": {"s": {"between": ["link", "crank"], "rate": 1, "rest": 0}}},
            "springs.s.between: crank turns with",
        ),
        ({"masses": {"S": "-m"}}, "masses.S: m is never negative, so this never is an amount"),
    ],
)
def test_loads_that_cannot_be_are_refused(loads, problem):
    with pytest.raises(ConfigError) as error:
        with_loads(SHAPER, loads)
    assert str(error.value).startswith(f"linkage.loads.{problem}")


def test_a_mass_of_an_unknown_link_is_one_mistake():
    problem = r"^linkage.loads.masses.levr: unknown link or moving point 'levr'; did you mean 'lever'\?$"
    with pytest.raises(ConfigError, match=problem):
        with_loads(SHAPER, {"masses": {"levr": {"mass": 1, "centroid": "D"}}})


def test_a_link_that_only_translates_has_no_torque():
    content = linkage_of(CASES["scotch-yoke"]).content | {"loads": {"torques": {"yoke": 3}}}
    with pytest.raises(ConfigError, match=r"^linkage.loads.torques.yoke: yoke does not turn against frame"):
        Linkage(content)


def test_amounts_may_have_units():
    linkage = with_loads(SHAPER, {"gravity": [0, "-9.81 m/s^2"], "masses": {"S": "600 g"}})
    assert linkage == with_loads(SHAPER, {"gravity": [0, -9.81], "masses": {"S": 0.6}})


def test_a_spring_on_a_link_does_not_know_whole_turns():
    """Neither of its rest nor of the angle, whichever crank angle the motion begins with."""
    torques = []
    for rest in (170, -190, 530):
        spring = {"between": "rocker", "rate": 1, "rest": rest}
        frame = {"O": [0, 0], "C": ["0.17 * r4", "0.985444 * r4"]}
        linkage = Linkage(FOUR_BAR | {"output": "rocker", "frame": frame, "loads": {"springs": {"coil": spring}}})
        lengths = {"r1": 30.0, "r2": 90.0, "r3": 60.0, "r4": 50.0}
        for angles in ([231.9, 345.1], [345.1]):
            torques.append(explore.simulate(linkage, lengths, angles=angles)["drive_torque"].iloc[-1])
    assert torques == pytest.approx([torques[0]] * 6, abs=1e-14)  # of angles of 3 rad
    assert abs(torques[0]) < 0.1


#: A link on a pivot of the frame whose slot passes another point there; one on the crank whose slot passes its pivot.
RESTING = {"held": {"H": 0, "T": "h"}, "fast": {"A": 0, "P": 60}}
RESTING_SLOTS = {"stop": {"pin": "K", "link": "held", "along": ["H", "T"]}} | {
    "sleeve": {"pin": "O", "link": "fast", "along": ["A", "P"]}
}


@pytest.mark.parametrize(
    ("loads", "problem"),
    [
        ({"opposing": {"held": 2}}, "opposing.held: held does not turn, as it is of one rigid part with the frame"),
        ({"opposing": {"stop": 2}}, "opposing.stop: the pin K rests in stop, as both are of one rigid part"),
        ({"friction": {"sleeve": 0.1}}, "friction.sleeve: the pin O rests in sleeve, as both are of one rigid part"),
    ],
)
def test_what_rests_is_not_opposed(loads, problem):
    """Its rate is rounding, with the sign of which the load acted."""
    content = FOUR_BAR | {"output": "rocker", "slots": RESTING_SLOTS}
    content |= {"frame": FOUR_BAR["frame"] | {"H": [0, -90], "K": [40, -60]}, "links": FOUR_BAR["links"] | RESTING}
    assert Linkage(content)
    with pytest.raises(ConfigError, match=f"^linkage.loads.{problem}; leave it out$"):
        Linkage(content | {"loads": {"masses": {"B": 1}} | loads})
