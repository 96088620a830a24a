"""Certificates of linkages of tables: enclosures beside mpmath, and false rows that must be found."""

import math
import re
from dataclasses import dataclass

import mpmath
import numpy as np
import pytest
from flint import arb, ctx
from linkage_cases import (
    AMOUNTS,
    BOOM,
    BOOM_LENGTHS,
    CASES,
    FOUR_BAR,
    evaluate_graph,
    linkage_of,
    loaded_shaper,
    scattered,
    values_of,
    with_loads,
)
from test_pin_friction import DESIGN, ROUGH

import explore
from explore import Linkage
from explore.analysis.certifying import ball_programs, pieces
from explore.analysis.certifying.ball_graph import trace
from explore.analysis.certifying.balls import UnprovedError
from explore.analysis.certifying.certification import certify_designs
from explore.analysis.certifying.designs import Design
from explore.analysis.certifying.fluctuations import fluctuation
from explore.analysis.certifying.means import arc_means, turn_means
from explore.analysis.certifying.pieces import Piece
from explore.mechanisms.linkages.declaration import linkage_mechanism
from explore.mechanisms.linkages.metrics import REACH_NAMES
from explore.mechanisms.linkages.statuses import (
    CANNOT_ASSEMBLE,
    STROKES_NOT_DECIDED,
    TURN_NOT_DECIDED,
    blocked_at,
)
from explore.model.status import Status
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

#: The output's rate and its derivative of linkages whose rows are certified.
OUTPUTS = {
    "slider-crank": ("guide_velocity", "guide_acceleration"),
    "watt-2": ("output_velocity", "output_acceleration"),
    "crank-shaper": ("ram_velocity", "ram_acceleration"),
}
STATISTICS = ("mean", "rms", "variance", "min", "max", "peak_to_peak")


def metrics_of(name):
    return [f"{OUTPUTS[name][0]}_{statistic}" for statistic in STATISTICS] + ["transmission_angle_min", "footprint"]


def proofs_of(mechanism, rows, metrics, **options):
    """Verdicts on rows, with their reasons."""
    request = make_request(mechanism, metrics=metrics, **options)
    proofs = certify_designs(request, dict(enumerate(rows)), [], is_front=False)
    return [(proof.verdict, proof.reason) for proof, _ in proofs.values()]


def rows_of(linkage, designs, metrics, **options):
    return explore.evaluate(linkage, designs, metrics=metrics, **options).astype(float).to_dict(orient="records")


def true_row(name):
    """The row of a case, and the mechanism."""
    linkage = linkage_of(CASES[name])
    (row,) = rows_of(linkage, values_of(CASES[name]), metrics_of(name), window="cycle", tolerance=1e-10)
    return linkage_mechanism(linkage.table), row


@pytest.mark.parametrize("name", OUTPUTS)
def test_statistics_hold_the_numbers_of_mpmath(name):
    """Which takes 1,200 equal steps of the turn, and the roots of the derivative."""
    case, (rate, change) = CASES[name], OUTPUTS[name]
    linkage = linkage_of(case)
    quantities = trace(linkage.table).quantities
    numbers = [quantities[each].number for each in (rate, change)]
    inputs = {f"={value!r}": value for value in _numbers(linkage.table)} | values_of(case)
    angles = 2 * math.pi * np.arange(1200) / 1200
    with mpmath.workdps(40):

        def at(angle):
            return evaluate_graph(numbers, inputs, angle)

        values = [at(2 * mpmath.pi * k / 1200)[0] for k in range(1200)]
        doubles = np.array(list(map(float, values)))
        low, high = (
            at(mpmath.findroot(lambda angle: at(angle)[1], angles[k] + 1e-4))[0]
            for k in (doubles.argmin(), doubles.argmax())
        )
        square = sum(value**2 for value in values) / 1200
        mean = sum(values) / 1200
        truth = {
            "mean": mean, "rms": mpmath.sqrt(square), "variance": square - mean**2,
            "min": low, "max": high, "peak_to_peak": high - low,
        }  # fmt: skip
        truth = {f"{rate}_{statistic}": mpmath.nstr(value, 35) for statistic, value in truth.items()}
    mechanism = linkage_mechanism(linkage.table)
    request = make_request(mechanism, metrics=list(truth), window="cycle")
    design = Design(values_of(case) | {"speed": 1.0}, request)
    with ctx.workprec(256):
        for metric in request.metrics:
            enclosure = design.enclose(metric)
            assert enclosure.is_narrow
            assert abs(enclosure.ball - arb(truth[metric.name])) < 1e-22 * enclosure.scale, metric.name


def _numbers(table):
    graph = trace(table).equations.graph
    names = [str(node[1]) for node in graph.nodes if node[0] == "input"]
    return [float(name[1:]) for name in names if name.startswith("=")]


@pytest.mark.parametrize("name", OUTPUTS)
def test_true_rows_are_proved(name):
    mechanism, row = true_row(name)
    assert row["status"] == Status.OK
    assert proofs_of(mechanism, [row], metrics_of(name), window="cycle", tolerance=1e-10) == [("proved", "")]


@pytest.mark.parametrize("name", OUTPUTS)
def test_false_rows_are_refuted(name):
    """Statistics off by one and a half of their bound, another status, and a design that is not feasible."""
    mechanism, row = true_row(name)
    room = 1.5 * (row["error"] + 2e-15)
    rms, rate = row[f"{OUTPUTS[name][0]}_rms"], OUTPUTS[name][0]
    largest = max(abs(row[f"{rate}_min"]), abs(row[f"{rate}_max"]))
    scales = {"mean": rms, "rms": rms, "variance": rms**2, "min": largest, "max": largest, "peak_to_peak": largest}
    changed = {f"{rate}_{statistic}": scale * room for statistic, scale in scales.items()}
    changed |= {column: row[column] * room for column in ("transmission_angle_min", "footprint")}
    options = {"window": "cycle", "tolerance": 1e-10}
    false = [row | {column: row[column] + change} for column, change in changed.items()]
    for column, (verdict, reason) in zip(
        changed, proofs_of(mechanism, false, metrics_of(name), **options), strict=True
    ):
        assert (verdict, reason.startswith(column)) == ("refuted", True), reason
    ((verdict, reason),) = proofs_of(mechanism, [row | {"status": 22.0}], metrics_of(name), **options)
    assert (verdict, reason.startswith("status is ok by exact signs")) == ("refuted", True)
    angle = row["transmission_angle_min"]
    options["constraints"] = {"transmission_angle_min": {"min": angle + 0.5}}
    claim = row | {"feasible": 1.0, "transmission_angle_min_margin": -0.5}
    ((verdict, reason),) = proofs_of(mechanism, [claim], metrics_of(name), **options)
    assert (verdict, reason) == ("refuted", "it is not feasible: transmission_angle_min")


@pytest.mark.parametrize("name", OUTPUTS)
def test_designs_that_do_not_turn_are_proved(name):
    """Far from the case many are blocked; a row that says that such a design turns is refuted.

    Open are only designs of which no angle assembles, but not each for the reason of one joint.
    """
    linkage, metrics = linkage_of(CASES[name]), metrics_of(name)[:1]
    designs = scattered(CASES[name], 48, np.random.default_rng(3), 0.9)
    rows = rows_of(linkage, designs, metrics, window="cycle")
    blocked = [row for row in rows if row["status"] >= 20 or row["status"] == CANNOT_ASSEMBLE]
    assert len(blocked) > 6
    mechanism = linkage_mechanism(linkage.table)
    proofs = proofs_of(mechanism, blocked, metrics, window="cycle")
    verdicts = [verdict for verdict, _ in proofs]
    assert verdicts.count("proved") > 0.8 * len(blocked)
    assert {reason for _, reason in proofs} <= {"", "whether it assembles at some angle is not decided"}
    turning = [row | {"status": float(Status.OK), "error": 0.0, "feasible": 1.0} for row in blocked]
    others = [verdict for verdict, _ in proofs_of(mechanism, turning, metrics, window="cycle")]
    assert others == ["refuted" if verdict == "proved" else "open" for verdict in verdicts]


@pytest.mark.parametrize("name", ["crank-shaper", "whitworth", "toggle-press"])
def test_crank_angles_at_which_blocked_designs_assemble_are_proved(name):
    """Of one interval, of two, and of none; an end that is off by 1e-7 deg is refuted, and another number."""
    metrics = list(REACH_NAMES)
    rows = rows_of(linkage_of(CASES[name]), scattered(CASES[name], 40, np.random.default_rng(1), 0.9), metrics)
    blocked = [row for row in rows if row["status"] >= blocked_at(0)][:5]
    assert len(blocked) == 5
    mechanism = linkage_mechanism(linkage_of(CASES[name]).table)
    assert proofs_of(mechanism, blocked, metrics) == [("proved", "")] * 5
    false = [row | {"assembles_to_1": row["assembles_to_1"] + 1e-7} for row in blocked]
    false += [row | {"assembly_intervals": row["assembly_intervals"] + 1.0} for row in blocked]
    assert [verdict for verdict, _ in proofs_of(mechanism, false, metrics)] == ["refuted"] * 10


def test_a_four_bar_has_the_verdicts_of_the_crank_rocker():
    """On true rows and false ones, with a constraint."""
    linkage, random = Linkage(FOUR_BAR), np.random.default_rng(5)
    names = ("r1", "r2", "r3", "r4")
    lengths = np.array([50.0, 200.0, 150.0, 180.0])[:, None] * (1.0 + 0.3 * random.uniform(-1.0, 1.0, (4, 12)))
    options = {"window": "cycle", "constraints": {"rocker_velocity_max": {"max": 0.35}}, "tolerance": 1e-10}
    found = []
    for which, columns in ((linkage, names), ("crank-rocker", ("crank", "coupler", "rocker", "ground"))):
        metrics = ["rocker_velocity_rms", "rocker_velocity_max"]
        rows = rows_of(which, dict(zip(columns, lengths, strict=True)), metrics, **options)
        false = [row | {"rocker_velocity_rms": row["rocker_velocity_rms"] * (1.0 + 1e-8)} for row in rows]
        false += [row | {"feasible": 1.0 - row["feasible"]} for row in rows]
        mechanism = linkage_mechanism(linkage.table) if which is linkage else find_mechanism(which)
        found.append([verdict for verdict, _ in proofs_of(mechanism, rows + false, metrics, **options)])
    assert found[0] == found[1]
    assert found[0][:12] == ["proved"] * 12
    assert set(found[0][12:]) == {"proved", "refuted"}  # without a velocity, nothing is false


STROKE_METRICS = ("time_ratio", "ram_velocity_peak", "ram_velocity_mean", "ram_acceleration_rms", "stroke")


@pytest.mark.parametrize("window", ["forward", "drive", "return"])
def test_strokes_are_proved(window):
    """Their ends are the zeros of the output's rate, with its signs on both sides."""
    linkage, metrics = linkage_of(CASES["crank-shaper"]), list(STROKE_METRICS)
    mechanism, options = linkage_mechanism(linkage.table), {"window": window, "drive": "fast", "tolerance": 1e-10}
    (row,) = rows_of(linkage, values_of(CASES["crank-shaper"]), metrics, **options)
    assert proofs_of(mechanism, [row], metrics, **options) == [("proved", "")]
    false = [row | {name: row[name] * (1.0 + 1.5e-9)} for name in metrics]
    for name, (verdict, reason) in zip(metrics, proofs_of(mechanism, false, metrics, **options), strict=True):
        assert (verdict, reason.startswith(f"{name} ")) == ("refuted", True), reason


@pytest.mark.parametrize("status", [TURN_NOT_DECIDED, STROKES_NOT_DECIDED, blocked_at(0) + 1])
def test_what_the_program_did_not_decide_is_open(status):
    """That is no false statement, also of a design that turns."""
    mechanism, row = true_row("crank-shaper")
    metrics = metrics_of("crank-shaper")
    undecided = row | dict.fromkeys(metrics, math.nan) | {"status": float(status), "feasible": 0.0}
    ((verdict, reason),) = proofs_of(mechanism, [undecided], metrics, window="cycle", tolerance=1e-10)
    assert (verdict, reason) == ("open", f"nothing was computed: {mechanism.statuses[status].label}")


def test_reversals_where_the_slope_is_not_known_over_all_of_a_cell():
    """Newton's method must go to the side of the zero there; the lever's end rests where the ram does."""
    linkage, metrics = linkage_of(CASES["crank-shaper"]), ["time_ratio", "D_velocity_rms", "D_velocity_max"]
    sizes = {"height": 115.902660, "crank": 50.146114, "lever": 254.184138, "link": 79.608311, "rise": 151.361902}
    options = {"window": "forward", "tolerance": 1e-9}
    (row,) = rows_of(linkage, {name: np.array([value]) for name, value in sizes.items()}, metrics, **options)
    assert proofs_of(linkage_mechanism(linkage.table), [row], metrics, **options) == [("proved", "")]


def test_a_speed_that_is_constant_is_proved():
    linkage, metrics = linkage_of(CASES["crank-shaper"]), ["A_velocity_rms", "A_velocity_max", "A_acceleration_max"]
    (row,) = rows_of(linkage, values_of(CASES["crank-shaper"]), metrics, window="cycle")
    assert proofs_of(linkage_mechanism(linkage.table), [row], metrics, window="cycle") == [("proved", "")]
    false = row | {"A_velocity_max": row["A_velocity_max"] * (1.0 - 1e-6)}
    ((verdict, _),) = proofs_of(linkage_mechanism(linkage.table), [false], metrics, window="cycle")
    assert verdict == "refuted"


@pytest.mark.parametrize("window", ["cycle", {"from": 240, "to": 300}])
def test_angles_beside_half_a_turn_are_those_of_the_program(window):
    """Which follows a link from the crank angle 0 on, also to an interval: the rocker is beyond 180 deg there."""
    table = FOUR_BAR | {"frame": {"O": [0, 0], "C": [50, "-r4"]}, "branch": {"B": "right of A C"}}
    linkage, metrics = Linkage(table), ["rocker_angle_min", "rocker_angle_max"]
    lengths = {"r1": 60.0, "r2": 150.0, "r3": 120.0, "r4": np.array([90.0, 130.0, 170.0])}
    rows = rows_of(linkage, lengths, metrics, window=window)
    assert all(row["rocker_angle_max"] > 180.0 for row in rows)
    false = [row | {name: row[name] - 360.0 for name in metrics} for row in rows]
    verdicts = [
        verdict for verdict, _ in proofs_of(linkage_mechanism(linkage.table), rows + false, metrics, window=window)
    ]
    assert verdicts == ["proved"] * 3 + ["refuted"] * 3


@pytest.mark.parametrize("name", ["crank-shaper", "watt-2"])
def test_an_interval_that_is_not_reached_leaves_the_status_of_the_turn(name):
    """The joints that do not assemble in the interval are not always those that block the crank."""
    linkage, metrics, window = linkage_of(CASES[name]), metrics_of(name)[:1], {"from": 40, "to": 70}
    rows = rows_of(linkage, scattered(CASES[name], 24, np.random.default_rng(3), 0.9), metrics, window=window)
    blocked = [row for row in rows if row["status"] >= blocked_at(0) or row["status"] == CANNOT_ASSEMBLE]
    proofs = proofs_of(linkage_mechanism(linkage.table), blocked, metrics, window=window)
    assert [verdict for verdict, _ in proofs].count("proved") > 0.6 * len(blocked) > 5
    assert {reason for _, reason in proofs} <= {"", "whether it assembles at some angle is not decided"}


def test_forces_are_proved():
    """Of masses under gravity and a spring; false ones are refuted."""
    loads = {"gravity": [0, -9.81], "masses": {"coupler": {"mass": 2.0, "centroid": [100, 10], "inertia": 0.01}}}
    linkage, metrics = Linkage(FOUR_BAR | {"loads": loads}), ["drive_torque_rms", "drive_power_max", "pin_force_peak"]
    lengths = {"r1": 50.0, "r2": 200.0, "r3": 150.0, "r4": 180.0, "speed": np.array([1.0, 20.0])}
    rows = rows_of(linkage, lengths, metrics, window="cycle")
    mechanism = linkage_mechanism(linkage.table)
    assert proofs_of(mechanism, rows, metrics, window="cycle") == [("proved", "")] * 2
    false = [rows[1] | {name: rows[1][name] * (1.0 + 1e-6)} for name in metrics]
    assert {verdict for verdict, _ in proofs_of(mechanism, false, metrics, window="cycle")} == {"refuted"}


def test_power_means_of_forces_are_proved():
    """Of a force that is never near 0; a false one is refuted."""
    metric = "C_force_on_frame_power_mean_cycle"
    linkage = Linkage(FOUR_BAR | {"loads": {"gravity": [0, -9.81], "masses": {"B": 2.0}}})
    (row,) = rows_of(linkage, {"r1": 50.0, "r2": 200.0, "r3": 150.0, "r4": 180.0, "speed": 5.0}, [metric])
    mechanism = linkage_mechanism(linkage.table)
    proved, (verdict, _) = proofs_of(mechanism, [row, row | {metric: row[metric] * (1.0 + 1e-8)}], [metric])
    assert (proved, verdict) == (("proved", ""), "refuted")


def test_means_of_a_function_with_an_antiderivative():
    """1/(a - cos(theta)), whose integral is 2 arctan(sqrt((a + 1)/(a - 1)) tan(theta/2))/sqrt(a^2 - 1)."""
    with ctx.workprec(128):
        a = arb(5) / 4
        root = (a * a - 1).sqrt()

        def function(angle):
            return 1 / (a - angle.cos())

        def integral(angle):
            return 2 * (((a + 1) / (a - 1)).sqrt() * (angle / 2).tan()).atan() / root

        def close(ball, true):
            return ball.overlaps(true) and ball.rad() < 1e-21

        mean, square = turn_means(function, "")
        assert close(mean, 1 / root)
        assert close(square, a / root**3)
        start, stop = arb(-1), arb(2)
        mean, _ = arc_means(function, start, stop, "")
        assert close(mean, (integral(stop) - integral(start)) / 3)
        with pytest.raises(UnprovedError, match="too close"):
            turn_means(lambda angle: 1 / (1 - angle.cos()), "too close")
        with pytest.raises(UnprovedError, match="too close"):
            arc_means(lambda angle: 1 / (1 - angle.cos()), start, stop, "too close")


def test_a_force_of_nothing_but_rounding_is_open():
    """A cylinder without a mass takes up no force across itself; its values are narrow balls about 0."""
    loads = {"forces": {"P": [0, -40]}, "masses": {"P": 2.0}}
    linkage = Linkage(BOOM | {"output": "boom", "loads": loads})
    metrics = [f"cylinder_normal_force_rms_{window}" for window in ("forward", "backward")]
    rows = rows_of(linkage, BOOM_LENGTHS, metrics)
    ((verdict, reason),) = proofs_of(linkage_mechanism(linkage.table), rows, metrics)
    assert verdict == "open"
    assert reason.endswith("with 1024 bits")


#: Loads that jump where the ram turns back; without the mass, the power is 0 there too.
ROUGH_RAM = {"forces": {"S": [-40, 0]}, "friction": {"ram": 0.1}}
JUMPING = {
    "rough": with_loads(CASES["crank-shaper"], ROUGH_RAM),
    "rough-and-heavy": with_loads(CASES["crank-shaper"], ROUGH_RAM | {"masses": {"S": 2.0}}),
    "all": loaded_shaper(),
}


@pytest.mark.parametrize("window", ["cycle", "drive"])
@pytest.mark.parametrize("loads", JUMPING)
def test_jumps_and_corners_are_proved(loads, window):
    """Of friction, opposing loads and positive power, between the angles where they are; false rows are refuted."""
    linkage = JUMPING[loads]
    values = values_of(CASES["crank-shaper"]) | AMOUNTS
    values = {each.name: values[each.name] for each in linkage.mechanism.parameters if each.name in values}
    metrics = ["drive_torque_rms", "drive_torque_max", "drive_torque_min", "friction_power_max"]
    if window == "cycle":
        metrics += ["positive_power_mean", "positive_work", "net_work", "energy_fluctuation"]
    (row,) = rows_of(linkage, values, metrics, window=window)
    mechanism = linkage_mechanism(linkage.table)
    false = row | {metric: row[metric] + 1e-6 * row["drive_torque_rms"] for metric in metrics}
    proved, (verdict, reason) = proofs_of(mechanism, [row, false], metrics, window=window)
    assert proved == ("proved", "")
    assert verdict == "refuted"
    assert all(f"{metric} " in reason for metric in metrics)


def test_what_follows_a_motor_is_open():
    """Also where a parameter and the speed are inputs besides the statistic."""
    loads = {"masses": {"S": 2.0}, "motor": {"flywheel": "J", "slope": 2.0}}
    linkage, metrics = with_loads(CASES["crank-shaper"], loads), ["speed_fluctuation", "motor_torque_max"]
    (row,) = rows_of(linkage, values_of(CASES["crank-shaper"]) | {"J": 0.5, "speed": 9.0}, metrics, window="cycle")
    ((verdict, reason),) = proofs_of(linkage.mechanism, [row], metrics, window="cycle")
    assert verdict == "open"
    assert "speed_fluctuation cannot be certified: no enclosure is implemented" in reason


@pytest.mark.parametrize("window", ["cycle", {"from": 335, "to": 357}])
def test_motions_that_turn_back_together_are_proved(window):
    """Ram and lever; over the interval 128 bits are too few, and a zero is known to no more digits with 256."""
    loads = ROUGH_RAM | {"opposing": {"ram": 30.0, "lever": 2.0}, "masses": {"S": 2.0}}
    linkage, metrics = with_loads(CASES["crank-shaper"], loads), ["drive_torque_mean", "positive_power_mean"]
    (row,) = rows_of(linkage, values_of(CASES["crank-shaper"]) | {"speed": 9.0}, metrics, window=window)
    assert proofs_of(linkage.mechanism, [row], metrics, window=window) == [("proved", "")]
    false = [row | {name: row[name] * (1.0 + 1e-6)} for name in metrics]
    assert [verdict for verdict, _ in proofs_of(linkage.mechanism, false, metrics, window=window)] == ["refuted"] * 2


@dataclass(frozen=True)
class Flat:
    """A function that is the same at all angles."""

    number: arb

    def value(self, angle):
        return self.number + 0 * angle

    def series(self, angle):
        return [[self.number, arb(0), arb(0), arb(0), arb(0)]]

    def series_over(self, middle, half):
        return self.series(middle)


def test_pieces_of_fluctuations_follow_each_other():
    """Also those that start at one double: the integral goes from 0 to 1, 3 and 2."""
    with ctx.workprec(128):
        tiny = arb(2) ** -64
        ends = [arb(0), arb(1), 1 + tiny, 2 + tiny]
        first, second, third = (
            Piece(start, stop, Flat(arb(change) / (stop - start)), stop - start < arb("0.5"))
            for start, stop, change in zip(ends, ends[1:], (1, 2, -1), strict=False)
        )
        assert fluctuation([first, third, second], arb(0), "steps", "").contains(3)


def test_many_terms_with_corners_are_open_and_said_in_words(monkeypatch):
    metrics = ["drive_torque_rms"]
    monkeypatch.setattr(pieces, "_MOST_BRANCHES", 4)
    rows = rows_of(ROUGH, DESIGN, metrics, window="cycle")
    ((verdict, reason),) = proofs_of(linkage_mechanism(ROUGH.table), rows, metrics, window="cycle")
    assert verdict == "open"
    assert re.fullmatch(r"drive_torque has \d+ terms with jumps or corners; proofs take at most 4", reason)


def test_programs_have_no_name_of_a_table_in_their_text(monkeypatch):
    texts, written = [], ball_programs._written

    def noted(*parts):
        texts.append(str(parts))
        return written(*parts)

    monkeypatch.setattr(ball_programs, "_written", noted)
    linkage = Linkage(
        {
            "driver": "own_crank",
            "frame": {"own_o": [0, 0]},
            "links": {"own_crank": {"own_o": 0, "own_a": "own_r"}, "own_rod": {"own_a": 0, "own_b": "own_l * 2"}},
            "slots": {"own_guide": {"pin": "own_b", "link": "frame", "along": ["own_o", [1, "own_e"]]}},
            "branch": {"own_b": "far"},
        }
    )
    designs, metrics = (
        {"own_r": [20.0], "own_l": [40.0], "own_e": [0.1]},
        ["own_guide_velocity_mean", "own_guide_velocity_max"],
    )
    rows = rows_of(linkage, designs, metrics, window="cycle")
    assert proofs_of(linkage.mechanism, rows, metrics, window="cycle") == [("proved", "")]
    assert texts
    assert not any("own" in text for text in texts)
