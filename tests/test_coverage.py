"""Swing ranges of exchangeable cranks: the reference, dense scans over the coupler, and the command."""

import json
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from command_line import assert_refused, call, succeed
from hypothesis import example, given, settings
from hypothesis import strategies as st
from studies import crank_rockers

import explore
from explore.analysis.covering import Coverage, _overlaps
from explore.base.errors import RequestError
from explore.figures.charts.coverage import coverage_chart

REFERENCE = json.loads((Path(__file__).parent / "reference" / "test_rig_sizing.json").read_text())
FACTS = REFERENCE["design_facts"]
CRANKS = (5.0, 13.58, 37.0)
RIG = {"rocker": 595.0, "ground": 751.0, "coupler": (460.0, 1271.5)}
# Overlaps are differences of swings: their error is that of 20 deg.
SWING_ERROR = 1e-14


def test_the_swings_of_the_three_eccentrics():
    table = explore.coverage(CRANKS, **RIG).table
    sweep = {(x["L1_mm"], x["L2_mm"]): float(x["swing_deg"]) for x in REFERENCE["config_sweep_L3_595_L0_751"]
             if x["feasible"]}  # fmt: skip
    for row, crank in zip(table.itertuples(), ("5", "13.58", "37"), strict=True):
        assert (row.crank, row.coupler_min, row.coupler_max) == (float(crank), 460.0, 1271.5)
        assert row.swing_min == pytest.approx(sweep[crank, "460"], rel=1e-12, abs=0)
    assert table["swing_max"].to_numpy() == pytest.approx(
        [2.6161637563, 7.1309324873, 20.0084547984948751], rel=1e-10, abs=0
    )


@pytest.mark.parametrize("ground", ["751", "750"])
def test_overlaps_of_the_three_eccentrics(ground):
    coverage = explore.coverage(CRANKS, **RIG | {"ground": float(ground)})
    known = FACTS[f"coverage_overlap_L0_{ground}"]
    overlaps = coverage.table["overlap"].to_numpy()
    assert np.isnan(overlaps[0])
    assert overlaps[1] == pytest.approx(float(known["small_to_mid_deg"]), abs=SWING_ERROR)
    assert overlaps[2] == pytest.approx(float(known["mid_to_large_deg"]), abs=SWING_ERROR)
    assert coverage.gaps == ()
    assert coverage.total == (coverage.table["swing_min"][0], coverage.table["swing_max"][2])


@pytest.mark.parametrize("ground", ["751", "750"])
def test_the_window_of_the_middle_eccentric(ground):
    key = "gapless_middle_crank_window_mm" + ("_L0_750" if ground == "750" else "")
    low, high = (float(end) for end in REFERENCE["extra_facts"][key])
    rig = RIG | {"ground": float(ground)}
    # At the window's ends an overlap is 0; 1 nm beyond there is a gap.
    assert explore.coverage((5, low, 37), **rig).table["overlap"][2] == pytest.approx(0.0, abs=SWING_ERROR)
    assert explore.coverage((5, high, 37), **rig).table["overlap"][1] == pytest.approx(0.0, abs=SWING_ERROR)
    for middle, which in ((low - 1e-6, 2), (high + 1e-6, 1)):
        coverage = explore.coverage((5, middle, 37), **rig)
        ((start, end),) = coverage.gaps
        assert (start, end) == (
            pytest.approx(coverage.table["swing_max"][which - 1]),
            coverage.table["swing_min"][which],
        )
        assert 0.0 < end - start < 1e-5
    assert explore.coverage((5, low + 1e-6, 37), **rig).gaps == ()
    assert explore.coverage((5, high - 1e-6, 37), **rig).gaps == ()


def test_the_rule_for_the_transmission_angle():
    coverage = explore.coverage(CRANKS, **RIG, transmission_angle=(40, 140)).table
    for row, crank in zip(coverage.itertuples(), ("5", "13.58", "37"), strict=True):
        assert row.coupler_max == pytest.approx(float(FACTS[f"L2_gamma40_L1_{crank}"]["L2_mm"]), rel=1e-14, abs=0)
        assert row.swing_max == pytest.approx(float(FACTS[f"L2_gamma40_L1_{crank}"]["swing_deg"]), rel=1e-12, abs=0)
    assert len(explore.coverage(CRANKS, **RIG, transmission_angle=(40, 140)).gaps) == 2


def test_the_swing_is_smallest_with_the_centric_coupler():
    coverage = explore.coverage(CRANKS, **RIG | {"coupler": (400.0, 1271.5)}).table
    for row, crank in zip(coverage.itertuples(), ("5", "13.58", "37"), strict=True):
        known = FACTS[f"swing_min_over_L2_L1_{crank}"]
        assert row.swing_min == pytest.approx(float(known["swing_deg"]), rel=1e-13, abs=0)


# the largest, then the smallest transmission angle bounds the shortest coupler
@example(crank=0.3, rocker=1.0, start=0.2, length=1.0, least=0.0, most=120.0)
@example(crank=0.3, rocker=1.0, start=0.2, length=1.0, least=40.0, most=180.0)
@settings(max_examples=80, deadline=None)
@given(
    st.floats(0.01, 1.2), st.floats(0.3, 1.5), st.floats(0.05, 1.5), st.floats(0.1, 2.0), st.floats(0.0, 90.0),
    st.floats(90.0, 180.0),
)  # fmt: skip
def test_ranges_against_a_scan_of_the_coupler(crank, rocker, start, length, least, most):
    """The part of the travel that can be used, and the swings over it, by evaluating 3,001 couplers."""
    travel = (start, start + length)
    row = explore.coverage([crank], rocker=rocker, ground=1.0, coupler=travel, transmission_angle=(least, most)).table
    row = row.iloc[0]
    couplers = np.linspace(*travel, 3001)
    designs = explore.evaluate(
        "crank-rocker",
        {"crank": crank, "coupler": couplers, "rocker": rocker, "ground": 1.0},
        metrics=["swing_angle"],
        constraints={"transmission_angle_min": {"min": least}, "transmission_angle_max": {"max": most}},
    )
    good = designs["feasible"].to_numpy()
    step = length / 3000
    if not good.any():
        assert np.isnan(row["swing_min"]) or row["coupler_max"] - row["coupler_min"] < step
        return
    usable = couplers[good]
    assert good[np.flatnonzero(good)[0] : np.flatnonzero(good)[-1] + 1].all()  # one interval
    assert row["coupler_min"] == pytest.approx(usable[0], abs=1.001 * step)
    assert row["coupler_max"] == pytest.approx(usable[-1], abs=1.001 * step)
    assert row["coupler_min"] <= usable[0] + 1e-12
    assert row["coupler_max"] >= usable[-1] - 1e-12
    swings = designs["swing_angle"].to_numpy()[good]
    assert row["swing_min"] <= swings.min() + 1e-9
    assert row["swing_max"] >= swings.max() - 1e-9
    # Both are reached: closer and closer towards the ends, where the swing may move like a square root.
    couplers = row["coupler_min"] + np.sin(np.linspace(0.0, np.pi / 2.0, 3001)) ** 2 * (
        row["coupler_max"] - row["coupler_min"]
    )
    couplers[-1] = row["coupler_max"]
    lengths = {"crank": crank, "coupler": couplers, "rocker": rocker, "ground": 1.0}
    swings = explore.evaluate("crank-rocker", lengths, metrics=["swing_angle"])["swing_angle"]
    assert swings.max() == pytest.approx(row["swing_max"], abs=1e-9)
    assert row["swing_min"] <= swings.min() + 1e-9
    assert swings.min() == pytest.approx(row["swing_min"], abs=1e-3)


def test_curves_run_over_the_usable_travel():
    coverage = explore.coverage([37.0, 200.0, 600.0], rocker=595.0, ground=751.0, coupler=(100.0, 2000.0))
    curves = coverage.curves(11)
    assert sorted(set(curves["crank"])) == [37.0, 200.0]  # longer than the rocker, the third never turns
    for row in coverage.table.dropna(subset=["swing_min"]).itertuples():
        curve = curves[curves["crank"] == row.crank]
        assert (curve["coupler"].iloc[0], curve["coupler"].iloc[-1]) == (row.coupler_min, row.coupler_max)
        assert curve["swing_angle"].max() == row.swing_max
    assert np.isnan(coverage.table["swing_min"][2])


def test_a_range_may_contain_another():
    coverage = explore.coverage([5.0, 5.1, 37.0], **RIG).table
    low, high = coverage["swing_min"][1], coverage["swing_max"][0]
    assert coverage["overlap"][1] == high - low
    nested = explore.coverage([37.0, 38.0], **RIG | {"coupler": (460.0, 1400.0)}, transmission_angle=(60, 180)).table
    assert nested["overlap"][1] == min(nested["swing_max"]) - nested["swing_min"][1]


def test_the_text_of_a_coverage():
    text = repr(explore.coverage(CRANKS, **RIG))
    assert text.splitlines()[-1] == "0.96297 to 20.0085 deg, without a gap"
    text = repr(explore.coverage(CRANKS, **RIG, transmission_angle=(40, 140)))
    assert text.splitlines()[-1] == "0.96297 to 10.3351 deg, but not 1.48253 to 2.61562, 3.95813 to 7.13046 deg"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"cranks": []}, "cranks: give at least one length"),
        ({"cranks": [5.0, -1.0]}, "cranks: lengths must be positive and finite"),
        ({"rocker": 0.0}, "rocker: lengths must be positive and finite, got 0.0"),
        ({"coupler": (9.0, 8.0)}, "coupler: must be two numbers, the smaller first, got (9.0, 8.0)"),
        ({"transmission_angle": (140.0, 40.0)}, "transmission_angle: must be two numbers, the smaller first"),
        ({"cranks": ["5 mm"]}, "cranks: must be numbers, got ['5 mm']"),
        ({"coupler": 460.0}, "coupler: must be two numbers, the smaller first, got 460.0"),
        ({"rocker": [500.0, 595.0]}, "rocker: must be one length, got"),
        ({"transmission_angle": (40.0, 80.0)}, "transmission_angle: bounds must lie on both sides of 90 deg"),
    ],
)
def test_bad_arguments(change, message):
    arguments = {"cranks": [5.0], **RIG} | change
    with pytest.raises(RequestError) as caught:
        explore.coverage(arguments.pop("cranks"), **arguments)
    assert str(caught.value).startswith(message)


STUDY = crank_rockers([5, 13.58, 37], (460, 1271.5, 20), 595, 751)


@pytest.fixture
def study(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = Path("rig.toml")
    path.write_text(STUDY)
    return path


def test_the_command_prints_ranges_overlaps_and_gaps(study):
    code, out, err = call("coverage", study)
    assert (code, err) == (0, "")
    assert out.splitlines()[-1] == "0.962969721 to 20.0084548 deg, without a gap"
    assert "13.58       460   1271.5    2.61561999   7.13093249   0.000543761329" in out
    study.write_text(STUDY + "[constraints]\ntransmission_angle_min = { min = 40 }\nswing_angle = { min = 1 }\n")
    out, err = succeed("coverage", study)
    assert err == "coverage ignores the constraint on swing_angle\n"
    assert out.splitlines()[-3:] == [
        "gap: 1.48253273 to 2.61561999 deg", "gap: 3.95813008 to 7.13046302 deg",
        "0.962969721 to 10.3351085 deg, with gaps",
    ]  # fmt: skip
    study.write_text(STUDY.replace("rocker = 595", "rocker = 4"))
    code, out, _ = call("coverage", study)
    assert out.splitlines()[-1] == "no crank turns with any of these couplers"


def test_the_command_gives_json_and_takes_ranges_drawn_from(study):
    study.write_text(
        STUDY.replace("{ start = 460, stop = 1271.5, num = 20 }", "{ min = 460, max = 1271.5 }")
        + '[sampling]\nmethod = "sobol"\ncount = 8\n[constraints]\ntransmission_angle_max = { max = 140 }\n'
    )
    code, out, err = call("coverage", study, "--json")
    assert (code, err) == (0, "")
    coverage = json.loads(out)
    assert [row["crank"] for row in coverage["cranks"]] == list(CRANKS)
    expected = explore.coverage(CRANKS, **RIG, transmission_angle=(0, 140))
    assert coverage["total"] == list(expected.total)
    assert coverage["gaps"] == []
    assert coverage["cranks"][0]["overlap"] is None
    assert coverage["cranks"][2]["swing_max"] == expected.table["swing_max"][2]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("coupler = { start = 460, stop = 1271.5, num = 20 }", "coupler = 460", "coverage needs the travel"),
        ("rocker = 595", "rocker = [595, 600]", "coverage takes one rig: give one rocker, not 2"),
        ("rocker = 595", 'rocker = { solve = "time_ratio", value = 1 }', "coverage needs crank, coupler"),
    ],
)  # fmt: skip
def test_studies_without_a_coverage(study, old, new, message):
    study.write_text(STUDY.replace(old, new))
    assert_refused(call("coverage", study), 2, f"error: rig.toml: {message}")


def test_coverage_of_another_mechanism_says_what_there_is_instead(study):
    study.write_text('mechanism = "slider-crank"\n[parameters]\ncrank = [40, 50]\nrod = 200\n')
    message = "coverage is of linkages with crank, coupler, rocker and ground, not of slider-crank; "
    hint = "`explore sweep` and then `explore plot map` show what its ranges reach\n"
    assert_refused(call("coverage", study), 2, f"error: rig.toml: {message}{hint}")


def test_the_command_draws(study):
    code, out, err = call("coverage", study, "-o", "coverage.svg")
    assert (code, err) == (0, "")
    assert out.splitlines()[-1] == "coverage.svg"
    assert Path("coverage.svg").read_text().startswith("<?xml")
    reply = call("coverage", study, "-o", "coverage.txt")
    assert_refused(reply, 2, "error: -o coverage.txt: the name must end in .png, .svg or .pdf\n")


def test_the_chart_shows_the_ranges_and_the_gaps():
    coverage = explore.coverage((*CRANKS, 600.0), **RIG, transmission_angle=(40, 140))
    figure = coverage_chart(coverage)
    lines, bars = figure.axes
    assert [(bar.get_y(), bar.get_y() + bar.get_height()) for bar in bars.patches if bar.get_width() < 1.0] == [
        (pytest.approx(row.swing_min), pytest.approx(row.swing_max)) for row in coverage.table.iloc[:3].itertuples()
    ]
    hatched = [patch.get_extents().transformed(lines.transData.inverted()) for patch in lines.patches]
    assert [(box.y0, box.y1) for box in hatched] == [pytest.approx(gap) for gap in coverage.gaps]
    labels = [text.get_text() for text in bars.texts]
    assert labels == ["0.963 to 1.483", "2.616 to 3.958", "gap 1.13", "7.13 to 10.34", "gap 3.17"]
    assert "but not" in figure.get_suptitle()
    assert len(lines.lines) == 4
    assert mpl.get_backend()  # drawn without a window


def test_cranks_that_do_not_turn_are_told():
    coverage = explore.coverage([900, 950], rocker=100, ground=100, coupler=(100, 200))
    assert coverage_chart(coverage).get_suptitle().startswith("No crank turns with any of these couplers\n")
    assert repr(coverage).endswith("\nno crank turns with any of these couplers")


def test_a_range_overlaps_with_the_farthest_reaching_of_the_smaller_cranks():
    assert _overlaps(np.array([0.0, 1.0, 4.0]), np.array([5.0, 2.0, 6.0])).tolist()[1:] == [1.0, 1.0]


def test_ranges_that_touch_have_no_gap_between_them():
    table = pd.DataFrame(
        {"crank": [1.0, 2.0], "swing_min": [3.0, 5.0], "swing_max": [5.0, 7.0], "overlap": [np.nan, 0]}
    )
    assert Coverage(table, 10.0, 20.0).gaps == ()
