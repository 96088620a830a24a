"""The slider-crank: reference values, closed forms and motion with 60 digits, statuses, bad input."""

import json
import math
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest
from command_line import call, run
from exact_slider_crank import SIGNALS, ExactSliderCrank
from mpmath import mpf
from studies import sweep_text

import explore
from explore.studies.request.names import find_mechanism

FIXED = json.loads((Path(__file__).parent / "reference" / "slider_crank.json").read_text())["cases"]
#: Ordinary designs, then some with margins of 2^-40, tiny cranks, offsets nearly as long as the rod.
DESIGNS = (
    (50.0, 150.0, 40.0),
    (50.0, 150.0, -40.0),
    (1.0, 1.0 + 2.0**-40, 0.0),
    (1.0, 1.5 + 2.0**-40, 0.5),
    (1.0, 1.5 + 2.0**-40, -0.5),
    (1.0, 1.0 + 2.0**-10 + 2.0**-45, 2.0**-10),
    (1e-6, 1.0, 0.3),
    (1e-6, 1.0, -0.9999989),
    (1.0, 1e6, 1.0),
)
CLOSED = ("stroke", "time_ratio", "pressure_angle_max", "transmission_angle_min", "turning_margin")
DEGREES = 180.0 / math.pi
RANDOM = np.random.default_rng(0)
DRAWN = {
    "crank": RANDOM.uniform(10.0, 100.0, 300),
    "rod": RANDOM.uniform(150.0, 500.0, 300),
    "offset": RANDOM.uniform(0.0, 49.0, 300),
}


def columns(design):
    return dict(zip(("crank", "rod", "offset"), design, strict=True))


def evaluate(designs, metrics, **options):
    return explore.evaluate("slider-crank", designs, metrics=list(metrics), **options)


@pytest.mark.parametrize("case", FIXED, ids=lambda case: case["id"])
def test_fixed_cranks_of_the_reference(case):
    inputs, outputs = case["inputs"], case["outputs"]
    names = {
        "stroke_mm": "stroke",
        "v_max_mm_s": "slider_velocity_peak",
        "v_rms_mm_s": "slider_velocity_rms",
        "a_max_mm_s2": "slider_acceleration_peak",
        "a_rms_mm_s2": "slider_acceleration_rms",
    }
    design = {"crank": float(inputs["r_mm"]), "rod": inputs["L2_mm"], "speed": f"{inputs['rpm']} rpm"}
    row = evaluate(design, names.values(), window="cycle", tolerance=1e-12).iloc[0]
    assert row["error"] <= 1e-12
    for key, name in names.items():
        # the speed in rad/s is rounded; the nodes of a turn are as many as 1e-12 needs, and their error is less
        assert row[name] == pytest.approx(float(outputs[key]), rel=2e-14), name
    samples = case["samples"]
    motion = explore.simulate("slider-crank", design, angles=[sample["phi_deg"] for sample in samples])
    for key, name in (("X_mm", "position"), ("v_mm_s", "velocity"), ("a_mm_s2", "acceleration")):
        values = np.array([float(sample[key]) for sample in samples])
        # a few roundings of the largest value; angles such as 210 degrees are rounded too
        assert motion[f"slider_{name}"].to_numpy() == pytest.approx(values, rel=0, abs=1e-15 * np.abs(values).max())


@pytest.mark.parametrize("design", DESIGNS)
def test_closed_forms_with_60_digits(design):
    exact = ExactSliderCrank(*design)
    row = evaluate(columns(design), (*CLOSED, "outer_angle", "inner_angle")).iloc[0]
    assert row["status"] == 1
    for name in CLOSED:
        value = getattr(exact, name) * (180 / mpmath.pi if "angle" in name else 1)
        # arctangents are good to two ulp, the rest is a few roundings
        assert abs(mpf(row[name]) / value - 1) <= 5e-16, name
    assert abs(mpf(row["outer_angle"]) - exact.outer * 180 / mpmath.pi) <= 5e-16 * abs(exact.outer * 180 / mpmath.pi)
    # beyond 180 degrees one ulp is 2.8e-14
    assert abs(mpf(row["inner_angle"]) - exact.inner * 180 / mpmath.pi) <= 5.7e-14


@pytest.mark.parametrize("design", DESIGNS)
def test_the_motion_with_60_digits(design):
    """At any angle and as near to +-90 degrees as doubles are, to ten ulp of the value or to 1e-16 of the largest."""
    exact = ExactSliderCrank(*design)
    near = 10.0 ** -np.arange(14.0)
    angles = np.concatenate(
        [np.linspace(-90.0, 270.0, 37), *(a + s * near for a in (-90.0, 90.0) for s in (-1.0, 1.0))]
    )
    motion = explore.simulate("slider-crank", columns(design), angles=angles)
    true = [exact.motion(mpf(angle) * mpmath.pi / 180) for angle in angles.tolist()]
    for s, name in enumerate(SIGNALS):
        values = np.array([float(sample[s]) for sample in true]) * (DEGREES if name == "rod_angle" else 1.0)
        largest = np.abs(values).max()
        assert motion[name].to_numpy() == pytest.approx(values, rel=2.5e-15, abs=1e-15 * largest), name


def test_without_offset_both_strokes_are_equal():
    names = ("stroke", "time_ratio", "outer_angle", "inner_angle", "pressure_angle_max")
    table = evaluate(DRAWN | {"offset": np.zeros(300)}, names)
    assert (table["time_ratio"] == 1.0).all()
    assert (table["outer_angle"] == 0.0).all()
    assert (table["inner_angle"] == 180.0).all()
    np.testing.assert_allclose(table["stroke"], 2.0 * DRAWN["crank"], rtol=3e-16)
    np.testing.assert_allclose(
        np.sin(np.deg2rad(table["pressure_angle_max"])), DRAWN["crank"] / DRAWN["rod"], rtol=1e-15
    )


def test_the_slow_stroke_is_the_longer_one():
    """With an offset the slider moves inwards slowly where the offset is on the side that the crank goes to first."""
    design = {"crank": 50.0, "rod": 150.0, "offset": [40.0, -40.0]}
    means = {
        drive: evaluate(design, ["slider_velocity_mean"], drive=drive)["slider_velocity_mean"].to_numpy()
        for drive in ("slow", "fast", "outer_to_inner", "inner_to_outer")
    }
    assert (np.sign(means["slow"]) == [-1.0, 1.0]).all()
    assert means["slow"].tolist() == [means["outer_to_inner"][0], means["inner_to_outer"][1]]
    assert means["fast"].tolist() == [means["inner_to_outer"][0], means["outer_to_inner"][1]]
    ratio = evaluate(design, ["time_ratio"])["time_ratio"]
    assert -means["fast"] / means["slow"] == pytest.approx(ratio.to_numpy(), rel=1e-14)


@pytest.mark.parametrize(
    ("design", "label"),
    [
        ((50.0, 150.0, 99.0), "ok"),
        ((50.0, 150.0, 101.0), "crank_blocked"),
        ((50.0, 150.0, -101.0), "crank_blocked"),
        ((50.0, 40.0, 0.0), "crank_blocked"),
        ((50.0, 150.0, 199.0), "crank_blocked"),
        ((50.0, 150.0, 201.0), "cannot_assemble"),
        ((50.0, 150.0, -201.0), "cannot_assemble"),
        ((50.0, 150.0, 100.0), "change_point"),
        ((50.0, 150.0, -100.0), "change_point"),
        ((50.0, 50.0, 0.0), "change_point"),
        # in decimals, whose doubles do not add up: 0.1 + 0.2 > 0.3
        ((0.1, 0.3, 0.2), "change_point"),
        ((50.0, math.inf, 0.0), "not_finite"),
        ((-50.0, 150.0, 0.0), "not_finite"),
    ],
)
def test_statuses(design, label):
    row = evaluate(columns(design), (*CLOSED, "outer_angle", "slider_velocity_peak")).iloc[0]
    labels = {status: word for word, status in explore_labels().items()}
    assert labels[row["status"]] == label
    is_ok = label == "ok"
    assert row["feasible"] == is_ok
    for name in ("stroke", "time_ratio", "pressure_angle_max", "outer_angle", "slider_velocity_peak"):
        assert np.isfinite(row[name]) == is_ok, name


def explore_labels():
    """Codes of the statuses by their words."""
    from explore.mechanisms.registry import MECHANISMS

    return {label: code for code, label in MECHANISMS["slider-crank"].status_labels.items()}


@pytest.mark.parametrize(
    ("setting", "line"),
    [
        ("ofset=5", "error: --set ofset=5: unknown parameter; did you mean 'offset'?"),
        (
            "rod=55",
            "error: no full turn to simulate: the crank cannot turn fully: the rod is shorter than crank plus offset",
        ),
    ],
)
def test_bad_input_is_one_line(setting, line):
    values = dict(text.split("=") for text in ("crank=50", "rod=150", "offset=20", setting))
    settings = [word for name, value in values.items() for word in ("--set", f"{name}={value}")]
    code, out, err = call("simulate", "--mechanism", "slider-crank", *settings)
    assert (code > 0, out, err.count("\n")) == (True, "", 1), err
    assert err.startswith(line)


STUDY = """mechanism = "slider-crank"
[parameters]
crank = {crank}
rod = [150, 400]
offset = [-30, 0, 30]
[evaluate]
{evaluate}
"""


def test_mistakes_in_a_study_are_one_line_each(tmp_path):
    text = STUDY.format(crank="{ start = 0, stop = 50, num = 3 }", evaluate='drive = "forwards"\nmetrics = ["strok"]')
    (tmp_path / "study.toml").write_text(text)
    lines = run("sweep", "study.toml", cwd=tmp_path, code=2).stderr.splitlines()
    assert lines == [
        "error: study.toml:3: parameters.crank.start: must be greater than 0 mm, got 0",
        "study.toml:7: evaluate.drive: unknown drive 'forwards'; available: slow, fast, outer_to_inner, inner_to_outer",
        "study.toml:8: evaluate.metrics: unknown metric 'strok'; did you mean 'stroke'?",
    ]


def test_a_crank_is_solved_for_the_stroke(tmp_path):
    text = STUDY.format(crank='{ solve = "stroke", value = "120 mm" }', evaluate='metrics = ["stroke", "cv"]')
    results = sweep_text(tmp_path, text)
    table = results.to_pandas()
    assert len(table) == 6
    np.testing.assert_allclose(table["stroke"], 120.0, rtol=1e-12)
    np.testing.assert_allclose(table["crank"][table["offset"] == 0.0], 60.0, rtol=1e-12)


def test_statuses_on_their_limits_follow_from_exact_sums():
    """Offsets within a few units in the last place of crank + rod and of rod - crank, against exact arithmetic."""
    rng, count = np.random.default_rng(0), 4_000
    crank, rod = rng.uniform(0.01, 1.0, count), rng.uniform(0.2, 3.0, count)
    limit = np.where(np.arange(count) % 2 == 0, crank + rod, np.abs(rod - crank))
    offset = limit + rng.integers(-3, 4, count) * np.spacing(limit)
    offset = np.append(np.where(rng.random(count) < 0.5, offset, -offset), -1.0700982867435505)
    crank, rod = np.append(crank, 0.11490150844035482), np.append(rod, 0.9551967783031956)
    table = explore.evaluate("slider-crank", {"crank": crank, "rod": rod, "offset": offset}, metrics=["stroke"])
    expected = []
    for design in zip(crank, rod, offset, strict=True):
        r, length, e = map(Fraction, map(abs, design))
        margin = length - r - e
        status = 3 if margin < 0 else 1
        status = 4 if abs(margin) <= 4 * Fraction(math.ulp(float(length))) else status
        expected.append(2 if e > r + length else status)
    assert table["status"].tolist() == expected
    assert set(expected) >= {2, 3, 4}


def test_the_least_transmission_angle_comes_near_its_declared_limit():
    (metric,) = (each for each in find_mechanism("slider-crank").metrics if each.name == "transmission_angle_min")
    found = explore.evaluate("slider-crank", {"crank": [1e-3, 50.0], "rod": 100.0}, metrics=[metric.name], table=False)
    assert found[metric.name] == pytest.approx([metric.upper, 60.0], rel=1e-4)
    assert (found[metric.name] < metric.upper).all()
