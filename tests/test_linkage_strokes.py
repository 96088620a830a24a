"""Strokes of linkages, the crank angles at which blocked ones assemble, and their size, by other roads."""

import math
import shutil
import subprocess

import mpmath
import numpy as np
import pytest
from linkage_cases import (
    BOOM,
    BOOM_LENGTHS,
    CASES,
    PARTIAL,
    columns,
    evaluate_graph,
    find_limits,
    linkage_of,
    scattered,
    trace,
    trammel,
    values_of,
    wanted_statistics,
)

import explore
from explore import Linkage
from explore.base.compiling import LANES
from explore.evaluation.evaluate import compile_kernels
from explore.evaluation.quadrature.windows import LONGER, orient
from explore.figures.reporting.javascript import translate
from explore.mechanisms.linkages.mark_errors import store_error
from explore.mechanisms.linkages.metrics import REACH_NAMES
from explore.mechanisms.linkages.programs import CLOSED_ERROR_ROW
from explore.mechanisms.linkages.statuses import NO_STROKES
from explore.model.status import Status
from explore.studies.request.requests import make_request

#: Outputs that turn back exactly twice, and the name of the metric of how far they move.
ROCKING = {
    "crank-shaper": ("ram_position", "stroke"), "slider-crank": ("guide_position", "stroke"),
    "watt-2": ("output_angle", "swing_angle"), "oscillating-cylinder": ("cylinder_position", "stroke"),
}  # fmt: skip

#: A slider-crank whose slider's line passes the pivot of the crank.
CENTRED = {
    "driver": "crank",
    "frame": {"O": [0, 0]},
    "links": {"crank": {"O": 0, "A": "r"}, "rod": {"A": 0, "B": "l"}},
    "slots": {"guide": {"pin": "B", "link": "frame", "along": ["O", [1, 0]]}},
    "branch": {"B": "far"},
}


def label(row):
    return row.attrs["labels"]["status"][row["status"].iloc[0]]


def test_the_error_of_strokes_is_that_of_their_ends_over_their_lengths():
    ratio_row = CLOSED_ERROR_ROW + 1
    record, ratios = np.zeros((ratio_row + 1, LANES)), np.linspace(1.5, 9.0, LANES)
    record[ratio_row] = ratios
    store_error(np.full(LANES, 1e-6), ratio_row, record.reshape(-1))
    shorter = 2.0 * math.pi / (1.0 + ratios)
    expected = 1e-6 / shorter + 1e-6 / (2.0 * math.pi - shorter)
    assert record[CLOSED_ERROR_ROW] == pytest.approx(expected, rel=1e-8)


def reversals(linkage, parameters, rate):
    """Crank angles (rad, 30 digits) where a rate changes its sign, by dense sampling and bisection of the graph."""
    equations = trace(linkage)
    slot = next((slot for slot in equations.table.slots if f"{slot.name}_position" == rate), None)
    if slot:
        number = equations.slot_position(slot).terms[1]
    else:
        cosine, sine = equations.directions[rate.removesuffix("_angle")]
        number = cosine.terms[0] * sine.terms[1] - sine.terms[0] * cosine.terms[1]

    def value(angle):
        return evaluate_graph([number], parameters, angle)[0]

    with mpmath.workdps(30):
        angles = [2 * mpmath.pi * (k + mpmath.mpf("0.31")) / 90 for k in range(91)]
        signs = [value(angle) > 0 for angle in angles]
        found = []
        for k in range(90):
            if signs[k] != signs[k + 1]:
                found.append((mpmath.findroot(value, (angles[k], angles[k + 1]), solver="anderson"), signs[k + 1]))
    return found


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow if n == "oscillating-cylinder" else ()) for n in ROCKING]
)
def test_strokes_equal_roots_of_thirty_digits(name):
    """Ends of strokes, time ratio and means over strokes to 1e-12; the range equals the reference's."""
    case, (position, moves) = CASES[name], ROCKING[name]
    linkage = linkage_of(case)
    (least,), (greatest,) = (
        [angle for angle, rises in reversals(linkage, case["parameters"], position) if rises == wanted]
        for wanted in (True, False)
    )
    forward = float((greatest - least) % (2 * mpmath.pi))
    rate = f"{position.rpartition('_')[0]}_velocity"
    metrics = ["time_ratio", moves, f"{rate}_mean_forward", f"{rate}_mean_backward", f"{rate}_mean_drive"]
    row = explore.evaluate(linkage, values_of(case), metrics=metrics, tolerance=1e-12).iloc[0]
    ratio = max(forward, 2 * math.pi - forward) / min(forward, 2 * math.pi - forward)
    assert row["time_ratio"] == pytest.approx(ratio, rel=1e-12)
    if "time_ratio" in case.get("published", {}):
        assert row["time_ratio"] == pytest.approx(float(case["published"]["time_ratio"]), rel=1e-12)
    extremes = case["turn"].get(position)
    moved = row[moves] if moves == "stroke" else math.radians(row[moves])
    if extremes:
        assert row[moves] == pytest.approx(float(extremes["max"]) - float(extremes["min"]), rel=1e-12)
    assert row[f"{rate}_mean_forward"] == pytest.approx(moved / forward, rel=1e-11)
    assert row[f"{rate}_mean_backward"] == pytest.approx(-moved / (2 * math.pi - forward), rel=1e-11)
    if ratio > 1.0 + 1e-9:
        slow = "forward" if forward > math.pi else "backward"
        assert row[f"{rate}_mean_drive"] == row[f"{rate}_mean_{slow}"]


#: Outputs whose strokes are half a turn each, with their parameters of a length: by symmetry, and by a driven pin.
EVEN = {
    "guide": (CENTRED, {"r": (20.0, 40.0), "l": (80.0, 120.0)}),
    "boom": (BOOM, {"b": (45.0, 50.0), "c": (100.0, 104.0)}),
}


@pytest.mark.parametrize("output", EVEN)
def test_of_strokes_that_take_the_same_time_the_slow_one_is_backward_in_all_designs(output):
    """Rounding told it, by two half-tangents beside 0 and half a turn: half of the sliders had the other."""
    section, ranges = EVEN[output]
    rng = np.random.default_rng(3)
    designs = {name: rng.uniform(*ends, 300) for name, ends in ranges.items()}
    fixed = {name: value for name, value in BOOM_LENGTHS.items() if section is BOOM and name not in designs}
    metrics = ["time_ratio", *(f"{output}_velocity_mean_{window}" for window in ("drive", "return"))]
    table = explore.evaluate(Linkage(section | {"output": output}), designs | fixed, metrics=metrics)
    assert (table["status"] == Status.OK).all()
    assert (table["time_ratio"] == 1.0).all()
    assert (table[metrics[1]] < 0.0).all()
    assert (table[metrics[2]] > 0.0).all()


@pytest.mark.parametrize("output", EVEN)
def test_a_page_tells_the_same_slow_stroke(output):
    """Rounding told it there: of the sliders half had the forward one."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    section, ranges = EVEN[output]
    kernel = make_request(Linkage(section | {"output": output}).mechanism, metrics=["time_ratio"]).kernel
    rng = np.random.default_rng(3)
    designs = [
        [*(float(rng.uniform(*ranges[name])) if name in ranges else BOOM_LENGTHS.get(name, 1.0) for name in names)]
        for names in [[p.name for p in kernel.kernel_parameters]] * 100
    ]
    least, greatest = kernel.marks["least"], kernel.marks["greatest"]
    script = f"""
        const f = {translate(close=kernel.close, orient=orient)};
        const starts = {designs}.map((design) => {{
            const record = new Float64Array({kernel.record_rows});
            record.set(design, {kernel.first_parameter});
            f.close(record);
            return f.orient({LONGER}, record[{least}], record[{greatest}])[0] === record[{greatest}];
        }});
        console.log(starts.every(Boolean));
    """
    run = subprocess.run([node], input=script, capture_output=True, text=True, check=True)
    assert run.stdout == "true\n"


def test_an_output_that_turns_fully_has_no_strokes():
    case = CASES["whitworth"]
    content = linkage_of(case).content | {"output": "lever"}
    row = explore.evaluate(Linkage(content), values_of(case), metrics=["time_ratio"])
    assert label(row) == "no_strokes"
    assert math.isnan(row["time_ratio"].iloc[0])


RESTING = {
    "driver": "crank", "output": "arm",
    "frame": {"O": [0, 0], "C": [100, 0], "D": [160, 0]},
    "links": {"crank": {"O": 0, "A": "r"}, "arm": {"C": 0, "P": 50}, "stay": {"D": 0, "P": 40},
              "rod": {"A": 0, "B": 90}, "rocker": {"C": 0, "B": 70}},
    "branch": {"P": "left of C D", "B": "left of A C"},
}  # fmt: skip


def test_an_output_that_rests_is_not_decided():
    row = explore.evaluate(Linkage(RESTING), {"r": 30.0}, metrics=["time_ratio"])
    assert label(row) == "strokes_not_decided"
    assert label(explore.evaluate(Linkage(RESTING), {"r": 30.0}, metrics=["rocker_velocity_max"])) == "ok"


@pytest.mark.parametrize("load", ["springs", "dampers"])
@pytest.mark.parametrize("output", ["h", "v"])
def test_strokes_do_not_depend_on_points_that_loads_join(output, load):
    """P meets O where v turns back."""
    element = {"between": ["P", "O"], "rate": 0.5} | ({"rest": 10.0} if load == "springs" else {})
    values = {"l": 100.0, "m": 30.0} | ({"speed": 4.0} if load == "dampers" else {})
    linkage = trammel(output=output, loads={load: {"joining": element}})
    row = explore.evaluate(linkage, values, metrics=["time_ratio", "drive_torque_max_forward"])
    assert row["time_ratio"].iloc[0] == pytest.approx(1.0, abs=1e-15)
    assert label(row) != "strokes_not_decided"


@pytest.mark.parametrize(
    "name",
    ["crank-shaper", *(pytest.param(n, marks=pytest.mark.slow) for n in ("watt-2", "jansen", "klann", "toggle-press"))],
)
def test_how_often_random_outputs_turn_back_is_counted(name):
    """Against 4,096 samples of the rate, which tell the number unless two zeros are nearer than that."""
    linkage, designs = linkage_of(CASES[name]), scattered(CASES[name], 400, np.random.default_rng(4), 0.2)
    request = make_request(linkage.mechanism, metrics=["time_ratio"], window="cycle")
    kernel, output = request.kernel, request.mechanism.output_signals[""]
    labels = [kernel.status_labels[code] for code in kernel.evaluate_closed_form(columns(kernel, designs)).status]
    moving = [k for k, each in enumerate(labels) if each in ("ok", "no_strokes", "strokes_not_decided")][:60]
    assert moving
    assert ("ok" in labels) == (name != "klann")  # whose leg turns back four times
    assert labels.count("strokes_not_decided") == 0
    for k in moving:
        values = {key: column[k] for key, column in designs.items()}
        rate = explore.simulate(linkage, values, angles=np.arange(4096) * 360.0 / 4096)[output].to_numpy()
        count = np.count_nonzero((rate > 0.0) != (np.roll(rate, 1) > 0.0))
        assert (count == 2) == (labels[k] == "ok"), (name, values)


def newton_step(factor, values, angle):
    value, slope = evaluate_graph(factor.terms[:2], values, angle)
    return value / slope


@pytest.mark.parametrize("beyond", [1e-2, 1e-6, 1e-10])
def test_ends_of_intervals_have_their_errors(beyond):
    """Where the crank of a Watt is hardly blocked the ends lose half of their digits; against a root of the factor."""
    case = CASES["watt-2"]
    linkage, ends = linkage_of(case), REACH_NAMES[1:3]
    kernel, rng = linkage.mechanism.for_signals(()), np.random.default_rng(2)
    between, last = find_limits(kernel, scattered(case, 99, rng, 0.2), 6, rng)
    designs = between(last + beyond)
    rows = explore.evaluate(linkage, designs, metrics=[REACH_NAMES[0], *ends])
    factors = [factor.value for factor in trace(linkage).factors]
    checked = 0
    for k, row in rows.iterrows():
        values = {name: column[k] for name, column in designs.items()}
        for end in ends if row[REACH_NAMES[0]] == 1 else ():
            with mpmath.workdps(40):
                place = told = mpmath.radians(mpmath.mpf(row[end]))
                factor = min(factors, key=lambda each: abs(newton_step(each, values, told)))
                for _ in range(6):
                    place -= newton_step(factor, values, place)
                assert abs(place - told) <= row["error"] <= 1e-13 / math.sqrt(beyond)
                checked += 1
    assert checked >= 6


@pytest.mark.parametrize("name", PARTIAL)
def test_a_blocked_linkage_moves_over_an_interval(name):
    """Statistics over the interval of the reference to 1e-12 of the size of the signal."""
    case = CASES[name]
    linkage, (start, stop) = linkage_of(case), case["interval_deg"]
    wanted = wanted_statistics(linkage, case["interval"])
    window = {"from": start, "to": stop}
    row = explore.evaluate(linkage, values_of(case), metrics=list(wanted), window=window, tolerance=1e-12)
    assert label(row) == "ok"
    for metric, (expected, size) in wanted.items():
        assert row[metric].iloc[0] == pytest.approx(expected, abs=1e-12 * size), metric
    beyond = explore.evaluate(linkage, values_of(case), metrics=list(wanted)[:1], window={"from": 0, "to": 180})
    assert label(beyond).startswith(("crank_blocked_at_", "change_point_at_"))


@pytest.mark.parametrize("name", ["crank-shaper", "watt-2"])
def test_a_design_of_no_numbers_ends(name):
    """No halving decides a factor that is no number: the rounds are bounded. Kernels are compiled by such a design."""
    linkage = linkage_of(CASES[name])
    request = make_request(linkage.mechanism, metrics=["transmission_angle_min"], window="cycle")
    compile_kernels(request)


def test_a_linkage_that_assembles_nowhere():
    linkage = linkage_of(CASES["slider-crank"])
    row = explore.evaluate(linkage, {"r": 10.0, "l": 20.0, "e": 50.0}, metrics=["guide_velocity_rms", REACH_NAMES[0]])
    assert label(row) == "cannot_assemble"
    assert row[REACH_NAMES[0]].iloc[0] == 0


def test_the_size_is_that_of_all_places_of_all_points():
    case = CASES["crank-shaper"]
    linkage = linkage_of(case)
    row = explore.evaluate(linkage, values_of(case), metrics=["footprint", "envelope_width", "envelope_height"]).iloc[0]
    motion = explore.simulate(linkage, values_of(case), angles=np.arange(0.0, 360.0, 0.05))
    frame = {"O": (0.0, 0.0), "C": (0.0, -120.0)}
    sides = []
    for axis, k in (("x", 0), ("y", 1)):
        places = [motion[f"{point}_{axis}"] for point in "ADS"] + [np.array([place[k]]) for place in frame.values()]
        sides.append(max(map(np.max, places)) - min(map(np.min, places)))
    assert [row["envelope_width"], row["envelope_height"]] == pytest.approx(sides, rel=1e-6)
    assert row["footprint"] == pytest.approx(row["envelope_width"] * row["envelope_height"], rel=1e-12)


def test_a_wide_swing_that_starts_anywhere_in_its_range_is_one_range():
    """A lever that a crank swings by a slot, with its pivot in any direction from that of the crank."""
    crank, lever = {"O": 0, "A": "r"}, {"Q": 0}
    slot = {"pin": "A", "link": "lever", "along": ["Q", [1, 0]]}
    section = {"driver": "crank", "frame": {"O": [0, 0], "Q": ["x", "y"]}, "links": {"crank": crank, "lever": lever}}
    directions, half = np.arange(0, 360, 30), math.degrees(math.asin(0.98))
    designs = {"x": np.cos(np.radians(directions)), "y": np.sin(np.radians(directions)), "r": 0.98}
    ends = ["lever_angle_min_cycle", "lever_angle_max_cycle"]
    table = explore.evaluate(Linkage(section | {"slots": {"slot": slot}, "output": "lever"}), designs, metrics=ends)
    for end, side in zip(ends, (-half, half), strict=True):
        turned = table[end] - (directions + 180.0 + side)
        np.testing.assert_allclose(turned, 360.0 * np.round(turned / 360.0), atol=1e-9)
    np.testing.assert_allclose(table[ends[1]] - table[ends[0]], 2.0 * half, rtol=1e-11)


def test_reversals_between_two_nodes_are_counted():
    """A pin that passes near the pivot of the lever turns it, and the ram four times, within less than a cell."""
    rng, count = np.random.default_rng(1), 60
    height, rod = rng.uniform(80.0, 140.0, count), rng.uniform(1.02, 4.0, count)
    crank, lever, rise = height * (1.0 - 10.0 ** rng.uniform(-6.0, -1.5, count)), 250.0, 140.0
    designs = {"crank": crank, "height": height, "lever": np.full(count, lever), "link": (rise + height) * rod}
    designs |= {"rise": np.full(count, rise)}
    steps = np.geomspace(1e-9, np.pi, 100_000)
    angle = -0.5 * np.pi + np.concatenate([-steps[::-1], steps])
    x, y = crank[:, None] * np.cos(angle), height[:, None] + crank[:, None] * np.sin(angle)
    distance = np.hypot(x, y)
    across, up = lever * x / distance, designs["rise"][:, None] + height[:, None] - lever * y / distance
    swing = crank[:, None] * (crank[:, None] + height[:, None] * np.sin(angle))
    rate = swing * (up * across / np.sqrt(designs["link"][:, None] ** 2 - up**2) - lever * y / distance)
    reversals = (np.diff(rate > 0.0, axis=1)).sum(axis=1) + ((rate[:, 0] > 0.0) != (rate[:, -1] > 0.0))
    assert (reversals == 4).sum() > 40
    linkage = linkage_of(CASES["crank-shaper"])
    status = explore.evaluate(linkage, designs | {"speed": np.ones(count)}, metrics=["time_ratio"])["status"]
    assert (status == np.where(reversals == 2, Status.OK, NO_STROKES)).all()
