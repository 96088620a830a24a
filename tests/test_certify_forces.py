"""Certificates of forces: of mechanisms with kernels of their own by their tables, and of loads along curves."""

import math

import numpy as np
import pytest
from flint import arb, arb_series
from linkage_cases import CASES, curved_shaper, values_of, with_loads
from test_certify_linkages import proofs_of, rows_of
from test_linkage_curves import CASE, OVER, SHAPES, VALUES, curved

import explore
from explore.analysis.certifying.analytic import TERMS, angle_series, coefficients, divide, root, size
from explore.analysis.certifying.ball_graph import Function
from explore.analysis.certifying.ball_programs import Program
from explore.analysis.certifying.certification import certify_designs
from explore.analysis.certifying.subdivision import ExtremeSearch
from explore.mechanisms.linkages.declaration import linkage_mechanism
from explore.mechanisms.linkages.graph import COSINE, SINE, Graph
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

FOUR_BAR = {"crank": 50.0, "coupler": [200.0, 150.0], "rocker": [120.0, 100.0], "ground": [180.0, 160.0], "speed": 30.0}
SLIDER_CRANK = {"crank": 50.0, "rod": [200.0, 150.0], "offset": [20.0, -30.0], "speed": 30.0}
TORQUES = ("drive_torque_rms", "positive_work", "net_work", "energy_fluctuation", "pin_force_peak")
OF_FOUR_BAR = (
    "coupler_force_peak", "rocker_axial_force_min", "rocker_moment_rms", "pin_force_rms", "power_max", *TORQUES,
)  # fmt: skip
OF_SLIDER_CRANK = ("thrust_peak", "guide_force_min", "crank_pin_force_rms", "drive_power_max", *TORQUES)
#: Designs, metrics and all loads of mechanisms whose forces have kernels of their own.
CASES_OF_KERNELS = {
    "crank-rocker": (FOUR_BAR, OF_FOUR_BAR),
    "test-rig": (FOUR_BAR, OF_FOUR_BAR),
    "slider-crank": (SLIDER_CRANK, OF_SLIDER_CRANK),
}
LOADS = {
    "four-bar": {
        "constant_torque": 3.0, "opposing_torque": 4.0, "stiffness": 2.0, "damping": 0.3, "inertia": 0.02,
        "crank_mass": 1.0, "coupler_mass": 0.5, "rocker_mass": 0.7, "crank_centroid": 0.3, "coupler_centroid": 0.6,
        "rocker_centroid": -0.2, "coupler_inertia": 0.01, "rocker_inertia": 0.02, "gravity": 9.0,
    },
    "slider-crank": {
        "constant_force": -200.0, "opposing_force": 30.0, "stiffness": 500.0, "damping": 10.0, "mass": 1.0,
        "friction": 0.2, "gravity": 9.0, "crank_mass": 2.0, "crank_centroid": 0.4, "rod_mass": 1.0,
        "rod_centroid": 0.7, "rod_inertia": 0.01,
    },
}  # fmt: skip


def loads_of(name):
    return LOADS.get(name, LOADS["four-bar"])


def verdicts_of(name, designs, metrics, **options):
    """Verdicts on the rows of designs, and on those with each metric wrong by 1e-7 of its size."""
    rows = explore.evaluate(name, designs, metrics=metrics, window="cycle", **options).astype(float)
    rows = rows.to_dict(orient="records")
    false = [row | {metric: row[metric] * (1.0 + 1e-7) for metric in metrics} for row in rows]
    proofs = proofs_of(find_mechanism(name), [*rows, *false], metrics, window="cycle", **options)
    return proofs[: len(rows)], proofs[len(rows) :]


def of_kernel(name, loads, metrics):
    """The row of the first design under some loads, and its request."""
    designs = {key: np.atleast_1d(value)[0] for key, value in CASES_OF_KERNELS[name][0].items()} | loads
    (row,) = explore.evaluate(name, designs, metrics=metrics, window="cycle").astype(float).to_dict(orient="records")
    return row, make_request(find_mechanism(name), metrics=metrics, window="cycle")


@pytest.mark.parametrize(
    ("name", "branch"), [("crank-rocker", 1.0), ("crank-rocker", -1.0), ("test-rig", None), ("slider-crank", None)]
)
def test_forces_of_kernels_are_those_of_their_tables(name, branch):
    """All loads together; the graph knows nothing of the kernels. Metrics that are wrong are named."""
    designs, metrics = CASES_OF_KERNELS[name]
    designs = designs | loads_of(name) | ({"branch": branch} if branch else {})
    true, false = verdicts_of(name, designs, metrics)
    assert true == [("proved", "")] * 2
    for verdict, reason in false:
        assert verdict == "refuted"
        assert [metric for metric in metrics if f"{metric} " not in reason] == []


@pytest.mark.parametrize("load", [*LOADS["four-bar"], *LOADS["slider-crank"]])
def test_each_load_alone_is_proved(load):
    """Beside a mass where it needs one; others are none, so that no sign of what is 0 is asked for."""
    name = "crank-rocker" if load in LOADS["four-bar"] else "slider-crank"
    alone = {load: loads_of(name)[load]}
    if load.endswith(("centroid", "gravity")) or load == "friction":
        owner = {"gravity": "rocker_mass"}.get(load, load.replace("centroid", "mass").replace("friction", "mass"))
        alone |= {owner: 0.5}
    designs = {key: np.atleast_1d(value)[0] for key, value in CASES_OF_KERNELS[name][0].items()}
    (row,), _ = verdicts_of(name, designs | alone, ("drive_torque_rms", "net_work", "pin_force_peak"))
    assert row == ("proved", ""), (load, row)


def test_a_force_that_stays_the_same_is_proved_from_its_variance():
    """The thrust of a constant force; a proof by cells does not end, as no cell tells that its slope is 0."""
    (row, other), false = verdicts_of("slider-crank", SLIDER_CRANK | {"constant_force": -300.0}, ("thrust_peak",))
    assert row == other == ("proved", "")
    assert [verdict for verdict, _ in false] == ["refuted"] * 2


def test_a_power_that_touches_zero_is_proved():
    """The power into a damper alone is 0 at both ends of the stroke, and nowhere negative."""
    (row, _), false = verdicts_of("slider-crank", SLIDER_CRANK | {"damping": 30.0}, ("positive_work", "net_work"))
    assert row == ("proved", "")
    assert [verdict for verdict, _ in false] == ["refuted"] * 2


def test_what_is_0_in_pieces_has_finite_intervals():
    """The power of the drive is negative in some pieces of the turn, and there 0 is taken for it."""
    row, request = of_kernel("crank-rocker", {"coupler_mass": 1.5}, ["positive_power_max", "positive_power_min"])
    ((proof, _),) = certify_designs(request, {0: row}, [], is_front=False).values()
    assert proof.verdict == "proved"
    low, high = proof.intervals["positive_power_max"]
    assert low < row["positive_power_max"] * (1.0 + 1e-9) < high * (1.0 + 2e-9)
    assert high - low < 1e-14 * high
    assert max(map(abs, proof.intervals["positive_power_min"])) < 1e-20


#: Curves that begin where the output turns back, and that rest at their least value.
AT_ENDS = {
    "begins": ("from_least", [[0.0, 100.0], [20.0, 700.0], [60.0, 0.0]]),
    "rests": ("from_least", [[0.0, 0.0], [20.0, 0.0], [60.0, 500.0]]),
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("over", [*OVER, *AT_ENDS])
def test_loads_along_curves_are_proved(over, shape):
    """Also at the ends of the stroke, which place and corner touch, and over crank angles, where the curve jumps."""
    entry, points = (OVER | AT_ENDS)[over]
    metrics = ["drive_torque_rms", "drive_torque_max", "positive_work", "net_work", "energy_fluctuation"]
    linkage = curved(entry, points, shape, masses={"S": 2.0})
    (row,) = rows_of(linkage, VALUES, metrics, window="cycle")
    false = row | {metric: row[metric] + 1e-6 * row["drive_torque_rms"] for metric in metrics}
    proved, (verdict, reason) = proofs_of(linkage_mechanism(linkage.table), [row, false], metrics, window="cycle")
    assert proved == ("proved", "")
    assert verdict == "refuted"
    assert all(f"{metric} " in reason for metric in metrics)


def test_opposing_loads_along_a_curve_that_rests_are_proved():
    """Beside two more curves; where the opposing one is 0, its sign is not asked for."""
    linkage, metrics = curved_shaper(), ["drive_torque_rms", "net_work", "friction_power_max"]
    (row,) = rows_of(linkage, values_of(CASES["crank-shaper"]) | {"f": 8.0, "speed": 9.0}, metrics, window="cycle")
    assert proofs_of(linkage_mechanism(linkage.table), [row], metrics, window="cycle") == [("proved", "")]


def test_what_has_no_value_leaves_no_coefficient_of_a_sum():
    """A root of a series that holds 0 was a single number, which spoilt the first coefficient of a sum alone."""
    variable = arb_series([arb(0, 1), 1], TERMS)
    series = arb_series([2, 3, 4, 5, 6], TERMS)
    for lost in (root(variable - 1), divide(series, variable), angle_series(variable, variable), size(variable)):
        assert not any(term.is_finite() for term in coefficients(lost + series))


def test_cells_whose_angle_has_no_series_are_halved():
    """The search ended in an error of the library, as a cell had no angle and yet a slope."""
    designs = {
        "crank": 12.4, "coupler": 36.1, "rocker": 197.7, "ground": 221.35, "speed": 0.36, "opposing_torque": 0.43,
        "stiffness": 14.8, "crank_mass": 39.9, "rocker_mass": 0.255, "rocker_centroid": -0.0046, "gravity": 9.8,
    }  # fmt: skip
    ((verdict, reason),), _ = verdicts_of("test-rig", designs, ("coupler_force_peak",))
    assert (verdict, reason) == ("proved", "")


def test_a_slider_that_friction_locks_is_proved_to_be_locked():
    """By the exact angle of the rod; without forces friction says nothing."""
    designs = {"crank": 50.0, "rod": 70.0, "offset": [10.0, 0.0, 10.0], "friction": [0.65, 0.65, 0.4], "mass": 1.0}
    rows = explore.evaluate("slider-crank", designs, metrics=["thrust_peak"], window="cycle").astype(float)
    locked = next(code for code, own in find_mechanism("slider-crank").statuses.items() if own.label == "guide_locked")
    assert rows["status"].to_list() == [locked, 1.0, 1.0]
    proofs = proofs_of(find_mechanism("slider-crank"), rows.to_dict(orient="records"), ["thrust_peak"], window="cycle")
    assert [verdict for verdict, _ in proofs] == ["proved"] * 3
    metrics = ["slider_velocity_rms"]
    rows = explore.evaluate("slider-crank", designs, metrics=metrics, window="cycle").astype(float)
    assert rows["status"].to_list() == [1.0] * 3
    proofs = proofs_of(find_mechanism("slider-crank"), rows.to_dict(orient="records"), metrics, window="cycle")
    assert [verdict for verdict, _ in proofs] == ["proved"] * 3


@pytest.mark.parametrize("first", [-1000.0, -360.0, 0.0, 5.0, 400.0])
@pytest.mark.parametrize("window", ["cycle", {"from": -300, "to": 40}, {"from": 0, "to": 90}, {"from": 340, "to": 690}])
def test_curves_over_crank_angles_begin_at_any_angle(first, window):
    """Extremes of intervals that begin or end with the curve stay open."""
    points = [[first + place, value] for place, value in [[0.0, 5.0], [70.0, 300.0], [230.0, -100.0], [360.0, 5.0]]]
    linkage, metrics = curved("crank_angle", points), ["drive_torque_mean", "drive_torque_rms"]
    metrics += ["drive_torque_max"] if window == "cycle" else []
    (row,) = rows_of(linkage, VALUES, metrics, window=window)
    assert proofs_of(linkage_mechanism(linkage.table), [row], metrics, window=window) == [("proved", "")]


@pytest.mark.parametrize("torque", [20.0, 180.0, 1e4])
def test_errors_of_fluctuations_are_relative_to_the_torque(torque):
    """A torque on the crank that is 10^5 times what it fluctuates by; its sums are rounded."""
    linkage = with_loads(CASE, {"masses": {"S": 0.01}, "torques": {"crank": torque}})
    (row,) = rows_of(linkage, VALUES, ["energy_fluctuation"], window="cycle")
    mechanism = linkage_mechanism(linkage.table)
    false = row | {"energy_fluctuation": row["energy_fluctuation"] + 3.0 * row["error"] * 2.0 * math.pi * torque}
    proved, refuted = proofs_of(mechanism, [row, false], ["energy_fluctuation"], window="cycle")
    assert proved == ("proved", "")
    assert refuted[0] == "refuted"


def test_the_size_of_a_force_that_stays_the_same_in_a_piece_is_proved():
    """That of the load on its own pin, along a curve with an even part."""
    curve = {"over": "crank_angle", "points": [[0, 50], [200, 50], [300, 200], [360, 50]]}
    linkage = with_loads(CASES["watt-2"], {"forces": {"A": ["-cut", 0]}, "curves": {"cut": curve}})
    metrics, values = ["A_force_on_crank_mean", "A_force_on_crank_rms"], values_of(CASES["watt-2"])
    (row,) = rows_of(linkage, values, metrics, window="cycle")
    assert row["A_force_on_crank_mean"] == pytest.approx((50.0 * 200.0 + 125.0 * 160.0) / 360.0)
    assert proofs_of(linkage_mechanism(linkage.table), [row], metrics, window="cycle") == [("proved", "")]


def test_what_is_not_known_over_a_cell_leaves_no_part_of_a_sum():
    """A peak of 9.2 that is 0.01 rad wide, beside a sine: no cell is left out as that of the sine alone."""
    graph = Graph()
    cosine, sine = graph.input(COSINE), graph.input(SINE)
    number = 1e-4 / (cosine * 0.6 + sine * 0.8 + 1.00001) + sine
    program = Program(graph, (number.index,), "the sum")
    function = Function(program, program.of_design())
    peak = math.pi + math.asin(0.8)
    low, high = ExtremeSearch(function, "the sum", arb(0.1), 0.1 + 2 * arb.pi(), is_turn=True).extremes()
    assert high > 9.2 > function.value(arb(peak + 0.01))
    assert high < 9.21
    assert low > -1.0
