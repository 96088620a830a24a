"""Comparison with every number of reference/crank_rocker.json: closed form, strokes, cycle, clutch."""

import json
import math
from decimal import Decimal
from pathlib import Path

import norms
import numpy as np
import pytest

import explore

CASES = json.loads((Path(__file__).parent / "reference" / "crank_rocker.json").read_text())["designs"]
NAMES = ["{crank}-{coupler}-{rocker}-{ground}".format(**case) for case in CASES]
TOLERANCES = (1e-6, 1e-9, 1e-12)
STROKES = ("overlapped_to_extended", "extended_to_overlapped")
SIGNALS = ("coupler_velocity", "rocker_velocity", "coupler_acceleration", "rocker_acceleration")
CLUTCHED = [(case, sense, z) for case in CASES for sense in case.get("clutch", ()) for z in case["clutch"][sense]]
OK, TOLERANCE_NOT_MET = 1, 7


def lengths(case):
    return {k: float(case[k]) for k in ("crank", "coupler", "rocker", "ground", "branch")}


def evaluate(case, metrics, tolerance, **more):
    row = explore.evaluate(
        "crank-rocker", lengths(case) | more.pop("extra", {}), metrics=metrics, tolerance=tolerance, **more
    )
    row = row.iloc[0]
    if tolerance == 1e-12 and any(name.endswith("cv") for name in metrics):
        # std or mean may be a thousandth of the rms, which multiplies the rounding error, 4e-15 of the rms; nodes are
        # not added where the quadrature's part is as small as that by rounding
        assert row["error"] <= 3e-11
        assert row["status"] == (OK if row["error"] <= tolerance else TOLERANCE_NOT_MET)
    else:
        assert row["status"] == OK
        assert row["error"] <= tolerance
    assert row["nodes"] <= 1_000
    return row


def check(row, name, statistic, expected, tolerance):
    """Compare one statistic with its reference of 25 digits, within the bound of the row."""
    true = {k: float(v) for k, v in expected.items() if v is not None}
    if statistic == "cv" and abs(true["mean"]) < 1e3 * tolerance * math.hypot(
        true["mean"], math.sqrt(true["variance"])
    ):
        assert math.isnan(row[name])  # the mean is tiny, but not 0 for every design
        return
    extremes = (true["min"], true["max"]) if statistic in ("min", "max") else None
    error = norms.worst(statistic, np.float64(row[name]), true["mean"], true["variance"], extremes)
    # decimal lengths were used exactly in the reference and rounded here: half an ulp, amplified by at most ten
    assert error <= row["error"] + 2e-15, (name, error, row["error"])


@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_closed_form(case):
    names = [
        "swing_angle",
        "mid_angle",
        "time_ratio",
        "mean_output_ratio",
        "transmission_angle_min",
        "transmission_angle_max",
    ]
    row = explore.evaluate("crank-rocker", lengths(case), metrics=["linkage_class", "grashof_margin", *names]).iloc[0]
    assert row["linkage_class"] == 0
    assert row["status"] == OK
    assert row["nodes"] == 0
    assert row["error"] == 0.0
    limits = case["limit_positions"]
    expected = {
        "swing_angle": math.degrees(float(case["swing_angle"])),
        "mid_angle": math.degrees(
            0.5 * (float(limits["rocker_angle_overlapped"]) + float(limits["rocker_angle_extended"]))
        ),
        "time_ratio": float(case["time_ratio"]),
        "mean_output_ratio": float(case["mean_transmission_ratio"]),
        "transmission_angle_min": math.degrees(float(case["transmission_angle_min"])),
        "transmission_angle_max": math.degrees(float(case["transmission_angle_max"])),
    }
    # 1e-12 holds for the exact values of the doubles, which are those of the reference only for dyadic lengths
    for name in names:
        assert row[name] == pytest.approx(expected[name], rel=1e-12, abs=0.0), name
    # decimal lengths are rounded by up to half an ulp each, 2e-13 mm at 1000 mm, and so is the margin
    assert row["grashof_margin"] == pytest.approx(
        float(case["grashof_margin"]), rel=1e-15, abs=0.0 if is_dyadic(case) else 5e-13
    )


def is_dyadic(case):
    """Whether all lengths are doubles exactly."""
    return all(Decimal(float(case[k])) == Decimal(case[k]) for k in ("crank", "coupler", "rocker", "ground"))


def test_near_singular_designs_are_dyadic():
    near = [case for case in CASES if float(case["grashof_margin"]) < 0.01]
    assert len(near) >= 5
    assert all(is_dyadic(case) for case in near)
    assert min(float(case["grashof_margin"]) for case in near) == 2.0**-34


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("window", [*STROKES, "cycle"])
@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_statistics(case, window, tolerance):
    for signal in SIGNALS:
        expected = case[window][signal]
        statistics = [s for s in ("mean", "variance", "cv", "min", "max") if expected.get(s) is not None]
        assert {"mean", "variance"} <= set(statistics)
        # each alone, so that its own bound is tested, then all at once
        for group in (*([s] for s in statistics), statistics):
            row = evaluate(case, [f"{signal}_{s}" for s in group], tolerance, window=window)
            for statistic in group:
                check(row, f"{signal}_{statistic}", statistic, expected, tolerance)


@pytest.mark.parametrize("case", CASES, ids=NAMES)
@pytest.mark.parametrize("window", [*STROKES, "cycle"])
def test_undefined_cv_is_refused(case, window):
    undefined = [signal for signal in SIGNALS if case[window][signal]["cv"] is None]
    assert undefined
    for signal in undefined:
        assert float(case[window][signal]["mean"]) == 0.0
        with pytest.raises(explore.RequestError, match="exactly 0"):
            explore.evaluate("crank-rocker", lengths(case), metrics=[f"{signal}_cv"], window=window)


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_drive_and_return_are_the_slow_and_the_fast_stroke(case, tolerance):
    through_zero = float(case["crank_angle_overlapped_to_extended"])
    slow, fast = STROKES if through_zero > math.pi else STROKES[::-1]
    metrics = [f"{signal}_{s}_{w}" for signal in SIGNALS for s in ("mean", "variance") for w in ("drive", "return")]
    for drive, strokes in (("slow", (slow, fast)), ("fast", (fast, slow))):
        row = evaluate(case, metrics, tolerance, drive=drive)
        for name in metrics:
            signal, statistic, window = name.rsplit("_", 2)
            check(row, name, statistic, case[strokes[window == "return"]][signal], tolerance)


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize(
    ("case", "sense", "z"), CLUTCHED, ids=[f"{c['crank']}-{c['coupler']}-{s}-{z}" for c, s, z in CLUTCHED]
)
def test_clutch(case, sense, z, tolerance):
    expected = case["clutch"][sense][z]
    metrics = [f"output_velocity_{s}" for s in expected]
    row = evaluate(case, metrics, tolerance, window="clutch", drive=sense, extra={"phases": int(z)})
    for statistic in expected:
        check(row, f"output_velocity_{statistic}", statistic, expected, tolerance)
    alone = evaluate(
        case, ["mean", "variance", "cv"], tolerance, window="clutch", drive=sense, extra={"phases": int(z)}
    )
    for statistic in ("mean", "variance", "cv"):
        check(alone, statistic, statistic, expected, tolerance)


def test_the_clutch_reference_is_complete():
    assert {z for _, _, z in CLUTCHED} == {"1", "2", "3", "4", "6"}
    assert {sense for _, sense, _ in CLUTCHED} == set(STROKES)
