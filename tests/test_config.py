"""Study files: their content and its hash."""

import json
import math
import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from studies import GOOD, with_parameter

import explore
from explore.base.units.quantities import quantity
from explore.mechanisms.registry import MECHANISMS
from explore.studies.config.study_file import load_study, starter
from explore.studies.designs.spaces import BLOCK_SIZE, ContinuousAxis, ListedAxis, SpacedAxis

CONFIGS = Path(__file__).parent.parent / "configs"


EXAMPLE = """\
mechanism = "crank-rocker"
[parameters]
crank   = [100, 150, 200]                              # a list
coupler = { start = 900, stop = 1100, num = 21 }
rocker  = 541.7118
ground  = { min = 650, max = 800, log = true }
speed   = ["40 rpm", "60 rpm", 7]
phases  = 3
[sampling]
method = "sobol"
count = 100000
seed = 1
[evaluate]
window = "drive"
drive = "slow"
metrics = ["cv", "rocker_acceleration_max", "swing_angle", "transmission_angle_min", "mean_output_ratio"]
tolerance = 1e-9
[constraints]
transmission_angle_min = { min = 30 }
transmission_angle_max = { max = "2.6 rad" }
mean_output_ratio = { min = 0.02, max = 0.2 }
[rank]
metrics = ["cv", "mean_output_ratio:max", "transmission_angle_min:max"]
"""

# Valid studies


def test_design_example(load):
    study = load(EXAMPLE)
    assert study.space.axes == (
        ListedAxis("crank", (100.0, 150.0, 200.0)),
        SpacedAxis("coupler", 900.0, 1100.0, 21),
        ListedAxis("rocker", (541.7118,)),
        ContinuousAxis("ground", 650.0, 800.0, True),
        ListedAxis("phases", (3.0,)),
        ListedAxis("speed", (4.188790204786391, 2 * math.pi, 7.0)),  # 4 pi / 3, rounded once
    )
    assert (study.space.method, study.space.n_designs, study.space.seed) == ("sobol", 100_000, 1)
    assert [m.name for m in study.request.metrics][:2] == ["cv", "rocker_acceleration_max"]
    assert [c.metric.name for c in study.request.constraints] == sorted(
        ["transmission_angle_min", "transmission_angle_max", "mean_output_ratio"]
    )
    assert [(o.metric, o.sense) for o in study.objectives] == [
        ("cv", "min"),
        ("mean_output_ratio", "max"),
        ("transmission_angle_min", "max"),
    ]


def test_only_named_parameters_are_axes_and_speed_varies_fastest(load):
    study = load(GOOD + "speed = [1, 2]\nbranch = [1, -1]\n")
    assert [axis.name for axis in study.space.axes] == ["crank", "coupler", "rocker", "ground", "branch", "speed"]
    assert study.space.designs(0, 4)["speed"].tolist() == [1.0, 2.0, 1.0, 2.0]
    assert study.space.n_designs == 4


def test_defaults(load):
    study = load(GOOD)
    mechanism = study.request.mechanism
    assert (study.space.method, study.space.n_designs, study.request.window.name) == ("grid", 1, "drive")
    assert [m.name for m in study.request.metrics] == list(mechanism.default_metrics[""])
    assert [o.metric for o in study.objectives] == ["cv", "swing_angle", "transmission_angle_min"]
    assert study.to_toml() == GOOD


def test_default_objectives_that_are_not_computed_are_left_out(load):
    study = load(GOOD + '[evaluate]\nwindow = "cycle"\n')
    assert [o.metric for o in study.objectives] == ["transmission_angle_min"]
    assert load(GOOD + '[evaluate]\nmetrics = ["time_ratio"]\n').objectives == ()


def test_interval_window(load):
    window = load(GOOD + '[evaluate]\nwindow = { from = 0, to = "1.5 rad" }\n').request.window
    assert (window.name, window.start) == ("interval", 0.0)
    assert math.radians(window.stop) == pytest.approx(1.5, rel=1e-15)


def test_byte_order_mark_and_windows_line_ends(load, problems):
    assert load("\ufeff" + GOOD.replace("\n", "\r\n")).sha256 == load(GOOD).sha256
    text = GOOD.replace("\n", "\r\n") + 'metrics = """\r\n\r\n"""\r\nphases = 13\r\n'
    assert [p.split(": ")[0] for p in problems(text)] == ["study.toml:7", "study.toml:10"]


def test_num_1_is_one_value(load):
    one = load(with_parameter("crank", "{ start = 100, stop = 120, num = 1 }")[0])
    assert one.space.axes[0] == ListedAxis("crank", (100.0,))
    assert one.sha256 == load(GOOD).sha256


def test_spaced_phases(load):
    assert load(GOOD + "phases = { start = 1, stop = 12, num = 12 }\n").space.n_designs == 12


def test_grid_config_is_the_newcomers_study():
    study = load_study(CONFIGS / "grid.toml")
    assert study.space.n_designs >= 200_000
    assert len(study.space.axes[-1]) == 3
    ranked = {objective.metric for objective in study.objectives}
    assert any(metric.signal.speed_power for metric in study.request.sampled if metric.name in ranked)
    assert {"mean", "variance", "cv"} <= {metric.name for metric in study.request.metrics}


def test_published_config_keeps_the_lengths_exact():
    designs = load_study(CONFIGS / "published.toml").space.designs(0, 9)
    assert designs["crank"].tolist() == [100.0] * 3 + [150.0] * 3 + [200.0] * 3
    assert designs["speed"].tolist() == [4.2735, 5.9829, 7.6923] * 3
    assert (designs["coupler"][0], designs["rocker"][0], designs["ground"][0]) == (1083.4236, 541.7118, 691.7118)


@pytest.mark.parametrize("mechanism", MECHANISMS.values(), ids=lambda mechanism: mechanism.name)
def test_starter_runs(load, mechanism):
    study = load(starter(mechanism))
    assert study.request.mechanism is mechanism
    assert study.space.n_designs > 1
    assert study.objectives


@pytest.mark.parametrize(
    "mechanism", [m for m in MECHANISMS.values() if m.loop_lengths], ids=lambda mechanism: mechanism.name
)
def test_the_solved_length_of_a_starter_runs_in_the_place_of_its_swept_one(load, mechanism):
    text = starter(mechanism)
    (solved,) = re.findall(r"^# (.* = \{ solve = .*)$", text, re.MULTILINE)
    name = solved.partition(" ")[0]
    text, replaced = re.subn(rf"^{name} .*$", solved, text, flags=re.MULTILINE)
    assert replaced == 1
    study = load(text)
    solved_length = study.space.solved_length
    results = explore.sweep(study, "study.h5")
    assert results.counts["ok"] > results.n_designs / 2
    values = explore.rank(results)[solved_length.metric.name]
    assert len(values) > 1
    np.testing.assert_allclose(values, solved_length.value, rtol=1e-11)


@pytest.mark.parametrize(
    ("start", "stop", "count", "unit"),
    [("20", "60", 41, "rpm"), ("0.1", "10", 100, "rpm"), ("9", "90", 10, "deg/s"), ("0.5", "5", 46, "Hz")],
)
def test_even_speeds_are_those_that_a_condition_names(load, start, stop, count, unit):
    """A condition such as `speed <= 33 rpm` would leave out what rounding has above it."""
    study = load(GOOD + f'speed = {{ start = "{start} {unit}", stop = "{stop} {unit}", num = {count} }}\n')
    step = (Fraction(stop) - Fraction(start)) / (count - 1)
    named = [f"{float(Fraction(start) + k * step)!r} {unit}" for k in range(count)]
    assert study.space.designs(0, count)["speed"].tolist() == [quantity(text, "rad/s") for text in named]


def test_speeds_that_are_no_decimals_of_their_unit_stay(load):
    study = load(GOOD + 'speed = { start = "1 rpm", stop = "2 rpm", num = 4 }\n')
    expected = [2 * math.pi / 60 * (1 + k / 3) for k in range(4)]
    assert study.space.designs(0, 4)["speed"] == pytest.approx(expected, rel=4e-16)


def test_hash_depends_on_the_unit_of_even_speeds(load):
    """Their last digits do."""
    plain, in_rpm = (
        load(GOOD + f"speed = {{ start = {start}, stop = {stop}, num = 41 }}\n")
        for start, stop in [(quantity("20 rpm", "rad/s"), quantity("60 rpm", "rad/s")), ('"20 rpm"', '"60 rpm"')]
    )
    assert plain.sha256 != in_rpm.sha256


def test_a_thousand_million_million_designs_are_a_study(load):
    text = re.sub(r"(crank|coupler|rocker) = \d+", r"\1 = { start = 1, stop = 2, num = 100000 }", GOOD)
    assert load(text).space.n_designs == 10**15


@pytest.mark.parametrize(("method", "most"), [("sobol", 2**30), ("latin-hypercube", 10**7), ("random", 2**63 - 1)])
def test_limits_of_the_drawing_methods(load, problems, method, most):
    section = f'[sampling]\nmethod = "{method}"\ncount = {most}\n'
    text = GOOD.replace("crank = 100", "crank = [100, 101]") + section
    space = load(text).space
    assert (space.method, space.n_designs, space.seed) == (method, most, 0)
    assert load(text.replace(str(most), "3")).space.n_designs == 3
    assert problems(GOOD + section) == [
        "study.toml:2: parameters: nothing to draw: every parameter is fixed; give one a list or { min, max }"
    ]


def test_the_hash_of_a_drawn_study_follows_method_count_and_seed(load):
    text = GOOD.replace("crank = 100", "crank = { min = 100, max = 101 }") + "[sampling]\n"
    sections = ['method = "sobol"\ncount = 9', 'method = "random"\ncount = 9', 'method = "latin-hypercube"\ncount = 9']
    sections += ['method = "random"\ncount = 8', 'method = "random"\ncount = 9\nseed = 1']
    hashes = [load(text + section).sha256 for section in sections]
    assert len(set(hashes)) == len(hashes)
    assert load(text + sections[0] + "\nseed = 0").sha256 == hashes[0]


# The hash


def test_hash_ignores_comments_order_units_and_rank(load):
    first = load(
        GOOD + 'speed = "60 rpm"\n[constraints]\ncv = { max = 1 }\nswing_angle = { min = 5, max = 9 }\n'
        '[rank]\nmetrics = ["cv"]\n'
    )
    second = load(
        "# other words\nconstraints.swing_angle = { max = 9.0, min = 5.0 }\nconstraints.cv.max = 1.0\n"
        f'parameters = {{ speed = {2 * math.pi!r}, ground = "70 cm", rocker = [500.0], coupler = 1e3, crank = 100 }}\n'
        'evaluate = { window = "drive", drive = "slow", tolerance = 1e-9 }\nmechanism = "crank-rocker"\n'
        "[sampling]\nmethod = 'grid'\n"
    )
    assert first.identity == second.identity
    assert first.sha256 == second.sha256
    assert first.request == second.request
    assert json.loads(first.identity)["parameters"]["speed"] == {"values": [2 * math.pi]}


@pytest.mark.parametrize(
    "change",
    [
        "phases = 4\n",
        "speed = 1\n",
        '[evaluate]\nwindow = "return"\n',
        "[evaluate]\nwindow = { from = 0, to = 90 }\n",
        '[evaluate]\ndrive = "fast"\n',
        '[evaluate]\nmetrics = ["cv"]\n',
        "[evaluate]\ntolerance = 1e-8\n",
        "[constraints]\ncv = { max = 1 }\n",
    ],
)
def test_hash_depends_on_what_determines_the_columns(load, change):
    assert load(GOOD + change).sha256 != load(GOOD).sha256


def test_hash_depends_on_log(load):
    section = '[sampling]\nmethod = "sobol"\ncount = 100\n'
    hashes = {
        load(with_parameter("crank", f"{{ min = 90, max = 110, log = {log} }}")[0] + section).sha256
        for log in ("false", "true")
    }
    assert len(hashes) == 2


@pytest.mark.parametrize(
    ("text", "change"),
    [
        ("[constraints]\ncv = { min = 0.1, max = 1 }\n", ("max = 1", "max = 2")),
        ("[constraints]\ncv = { min = 0.1, max = 1 }\n", ("min = 0.1", "min = 0.2")),
        ("[evaluate]\nwindow = { from = 0, to = 90 }\n", ("to = 90", "to = 91")),
        ("[evaluate]\nwindow = { from = 0, to = 90 }\n", ("from = 0", "from = 1")),
    ],
)
def test_hash_depends_on_both_ends(load, text, change):
    assert load(GOOD + text).sha256 != load(GOOD + text.replace(*change)).sha256


def test_hash_depends_on_the_kernel_version_and_the_block_size(load):
    content = json.loads(load(GOOD).identity)
    assert content["kernel_version"] == MECHANISMS["crank-rocker"].kernel_version
    assert content["block_size"] == BLOCK_SIZE
