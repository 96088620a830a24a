"""Solved lengths against the reference, a quadratic equation and dense scans, and in whole sweeps."""

import json
import pickle
from dataclasses import replace
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from command_line import call, succeed
from distributed import Client, LocalCluster
from hypothesis import given, settings
from hypothesis import strategies as st
from simple_slider import SIMPLE_SLIDER
from stopping import Stop, stop
from store_files import sha256

import explore
from explore.mechanisms.registry import MECHANISMS
from explore.studies.designs.smallest_roots import first_root
from explore.studies.designs.solved_lengths import SolvedSpace, solve
from explore.studies.designs.spaces import (
    BLOCK_SIZE,
    ContinuousAxis,
    Grid,
    ListedAxis,
    Sample,
    SolvedLength,
    Table,
    TableAxis,
)
from explore.studies.request.requests import make_request

REFERENCE = json.loads((Path(__file__).parent / "reference" / "test_rig_sizing.json").read_text())
FACTS = REFERENCE["design_facts"]
MECHANISM = MECHANISMS["crank-rocker"]
LOOP = MECHANISM.loop_lengths


def solved(name, metric, value, **others):
    """The length of one design or many, from the others in mm; bounds as `low` and `high`."""
    bounds = {key: others.pop(key) for key in ("low", "high") if key in others}
    arrays = np.broadcast_arrays(*[np.atleast_1d(np.asarray(v, float)) for v in others.values()])
    request = make_request(MECHANISM, metrics=[metric])
    return solve(SolvedLength(name, request, value, **bounds), dict(zip(others, arrays, strict=True)))


def metric_of(name, **lengths):
    return explore.evaluate("crank-rocker", lengths, metrics=[name], window="cycle")[name].to_numpy()


@pytest.mark.parametrize("design", REFERENCE["swing20_family_L0_751"], ids=lambda d: f"{d['L3_mm']}x{d['L2_mm']}")
def test_cranks_of_exactly_20_deg(design):
    others = {"coupler": float(design["L2_mm"]), "rocker": float(design["L3_mm"]), "ground": 751.0}
    (crank,) = solved("crank", "swing_angle", 20.0, **others)
    if not design["feasible"]:
        assert np.isnan(crank)
        return
    assert crank == pytest.approx(float(design["L1_mm"]), rel=1e-12, abs=0)
    assert metric_of("swing_angle", crank=crank, **others)[0] == pytest.approx(20.0, rel=1e-12, abs=0)
    (again,) = solved("coupler", "swing_angle", 20.0, crank=crank, rocker=others["rocker"], ground=751.0,
                      low=0.999 * others["coupler"])  # fmt: skip
    assert again == pytest.approx(others["coupler"], rel=1e-10)  # sensitive near the smallest swing


@pytest.mark.parametrize("ground", ["750", "751"])
def test_lengths_of_the_design_facts(ground):
    fixed = {"rocker": 595.0, "ground": float(ground)}
    (coupler,) = solved("coupler", "swing_angle", 20.0, crank=37.0, **fixed)
    (crank,) = solved("crank", "swing_angle", 20.0, coupler=1271.5, **fixed)
    assert coupler == pytest.approx(float(FACTS[f"L2_for_swing20_L1_37_L3_595_L0_{ground}"]), rel=1e-12, abs=0)
    assert crank == pytest.approx(float(FACTS[f"L1_for_swing20_L2_1271.5_L3_595_L0_{ground}"]), rel=1e-12, abs=0)


def test_other_metrics_of_the_design_facts():
    cranks = np.array([5.0, 13.58, 37.0])
    fixed = {"crank": cranks, "rocker": 595.0, "ground": 751.0}
    # The time ratio touches 1 in a corner where the design is centric, without crossing it.
    centric = solved("coupler", "time_ratio", 1.0, **fixed)
    longest = solved("coupler", "transmission_angle_min", 40.0, low=460.0, **fixed)
    for k, crank in enumerate(("5", "13.58", "37")):
        assert centric[k] == pytest.approx(float(FACTS[f"centric_L2_L1_{crank}"]["L2_mm"]), rel=1e-12, abs=0)
        assert longest[k] == pytest.approx(float(FACTS[f"L2_gamma40_L1_{crank}"]["L2_mm"]), rel=1e-12, abs=0)
    known = FACTS["min_crank_swing20_gamma40"]
    (crank,) = solved("crank", "swing_angle", 20.0, coupler=float(known["L2_mm"]), rocker=595.0, ground=751.0)
    assert crank == pytest.approx(float(known["L1_mm"]), rel=1e-12, abs=0)


def quadratic(name, swing, lengths):
    """Roots of the equation for a length squared that follows from the two limit triangles, shape (2, n).

    With the mid-angle m and the swing s: crank coupler = rocker ground sin m sin(s/2) and
    rocker^2 + ground^2 - crank^2 - coupler^2 = 2 rocker ground cos m cos(s/2); m is eliminated.
    """
    half = np.radians(swing) / 2.0
    cosine, cotangent = np.cos(half), 1.0 / np.tan(half)
    crank, coupler, rocker, ground = (lengths.get(each) for each in LOOP)
    if name in ("crank", "coupler"):
        other = coupler if name == "crank" else crank
        k = ground**2 + rocker**2 - other**2
        p, q = k - 2.0 * (other * cotangent) ** 2, k**2 - (2.0 * ground * rocker * cosine) ** 2
    else:
        other = ground if name == "rocker" else rocker
        k = crank**2 + coupler**2 - other**2
        p, q = k + 2.0 * (other * cosine) ** 2, k**2 + (2.0 * crank * coupler * cotangent) ** 2
    with np.errstate(invalid="ignore"):
        root = np.sqrt(p * p - q)
        return np.sqrt([p - root, p + root])


@pytest.mark.parametrize("name", LOOP)
def test_against_the_quadratic_equation(name):
    """Solved exactly where the equation has a root that makes a crank-rocker, by the smaller such root."""
    rng, n, swing = np.random.default_rng(20), 20_000, 20.0
    lengths = {each: rng.uniform(*((5, 300) if each == "crank" else (100, 1000)), n) for each in LOOP if each != name}
    solution = solved(name, "swing_angle", swing, **lengths)
    expected = np.full(n, np.nan)
    for roots in quadratic(name, swing, lengths)[::-1]:  # the smaller last
        designs = explore.evaluate("crank-rocker", lengths | {name: roots}, metrics=["swing_angle"], window="cycle")
        # The squared equation has roots of supplementary angles too.
        good = (designs["status"] == 1).to_numpy() & np.isclose(designs["swing_angle"], swing, rtol=1e-6)
        expected = np.where(good, roots, expected)
    np.testing.assert_array_equal(np.isnan(solution), np.isnan(expected))
    some = np.isfinite(solution)
    assert 0.1 < some.mean() < 0.9
    np.testing.assert_allclose(solution[some], expected[some], rtol=1e-8)  # the quadratic cancels
    error = np.abs(metric_of("swing_angle", **lengths, **{name: solution})[some] / swing - 1.0)
    assert np.quantile(error, 0.999) <= 1e-12
    # Next to a change point, and next to the smallest swing, one bit of a length is more than that.
    assert error.max() <= 1e-11


def formula_and_scan(mechanism, metric, name, value, lengths, **bounds):
    """The length by the formula of the metric, and by the scan between the flattened loops."""
    request = make_request(MECHANISMS[mechanism], metrics=[metric])
    without = replace(request, metrics=(replace(request.metrics[0], lengths=None),))
    others = {each: values for each, values in lengths.items() if each != name}
    return [solve(SolvedLength(name, each, value, **bounds), others) for each in (request, without)]


@pytest.mark.parametrize("draw", ["continuous", "integers", "kites", "change points"])
@pytest.mark.parametrize("swing", [20.0, 90.0, 180.0])
@pytest.mark.parametrize("name", LOOP)
def test_the_formula_of_a_swing_is_the_scan(name, swing, draw):
    rng, n = np.random.default_rng(5), 1000
    lengths = {each: rng.uniform(1.0, 10.0, n) for each in LOOP}
    if draw == "integers":
        lengths = {each: np.ceil(values) for each, values in lengths.items()}
    elif draw == "kites":
        lengths["rocker"] = lengths["ground"]
    elif draw == "change points":
        rest = lengths["crank"] + lengths["ground"] - lengths["coupler"]
        lengths["rocker"] = np.abs(rest * (1.0 + rng.choice([-1, 1], n) * 10.0 ** rng.uniform(-15, -1, n)))
    formula, scan = formula_and_scan("crank-rocker", "swing_angle", name, swing, lengths)
    np.testing.assert_array_equal(np.isnan(formula), np.isnan(scan))
    np.testing.assert_allclose(formula, scan, rtol=1e-7)  # half the digits where both roots nearly coincide


def test_the_formula_of_a_test_rig_is_that_of_its_four_bar():
    rng = np.random.default_rng(8)
    lengths = {each: rng.uniform(1.0, 10.0, 1000) for each in LOOP}
    formula, scan = formula_and_scan("test-rig", "swing_angle", "crank", 20.0, lengths)
    assert 0.1 < np.isfinite(formula).mean() < 0.9
    np.testing.assert_allclose(formula, scan, rtol=1e-12)
    assert formula_and_scan("crank-rocker", "swing_angle", "crank", 20.0, lengths)[0].tobytes() == formula.tobytes()


@pytest.mark.parametrize("name", ["crank", "rod", "offset"])
def test_the_formula_of_a_stroke_is_the_scan(name):
    rng, n = np.random.default_rng(6), 4000
    lengths = {"crank": rng.uniform(20, 60, n), "rod": rng.uniform(80, 200, n), "offset": rng.uniform(-40, 40, n)}
    lengths["offset"][:100], lengths["crank"][:50] = 0.0, 45.0  # a stroke of 90 has any rod
    low = {"low": -np.inf} if name == "offset" else {}
    formula, scan = formula_and_scan("slider-crank", "stroke", name, 90.0, lengths, **low)
    np.testing.assert_array_equal(np.isnan(formula), np.isnan(scan))
    assert 0.1 < np.isfinite(formula).mean() <= 1.0
    np.testing.assert_allclose(formula, scan, rtol=1e-9)  # the scan's error is that of the stroke, magnified


@pytest.mark.parametrize("gap", [1e-14, 1e-10, 1e-6])
def test_two_couplers_that_nearly_coincide(gap):
    """The swing is smallest at a coupler: just above this value both roots are found, just below none."""
    half = mp.radians(20) / 2
    rocker, ground = 500.0, 700.0
    crank = float(rocker * mp.sin(half) * (1 - gap))
    centric = (ground**2 - rocker**2 + crank**2) ** 0.5
    others = {"crank": crank, "rocker": rocker, "ground": ground}
    (coupler,) = solved("coupler", "swing_angle", 20.0, **others)
    assert metric_of("swing_angle", coupler=centric, **others)[0] <= 20.0
    assert coupler <= centric
    assert metric_of("swing_angle", coupler=coupler, **others)[0] == pytest.approx(20.0, rel=1e-12)
    assert np.isnan(solved("coupler", "swing_angle", 20.0, **others | {"crank": crank * (1 + 2 * max(gap, 1e-12))}))


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(LOOP),
    st.sampled_from([metric.name for metric in MECHANISM.metrics if not metric.labels]),
    st.tuples(st.floats(0.02, 0.5), st.floats(0.3, 3.0), st.floats(0.3, 3.0), st.floats(0.3, 3.0)),
    st.integers(0, 2**32),
)
def test_the_solution_has_the_value_and_is_the_smallest(name, metric, lengths, seed):
    design = dict(zip(LOOP, lengths, strict=True))
    (value,) = metric_of(metric, **design)
    status = explore.evaluate("crank-rocker", design, metrics=[metric], window="cycle")["status"][0]
    if status != 1 or not np.isfinite(value):
        return  # most random lengths do turn their crank
    others = {each: length for each, length in design.items() if each != name}
    (solution,) = solved(name, metric, value, **others)
    assert solution <= design[name] * (1 + 1e-7)
    (reached,) = metric_of(metric, **others, **{name: solution})
    assert reached == pytest.approx(value, abs=2e-9 * max(abs(value), 1.0))
    # None among many smaller lengths has the value, nor do two neighbours around it.
    tried = np.sort(np.random.default_rng(seed).uniform(0.0, solution * (1 - 1e-6), 2000))
    designs = explore.evaluate("crank-rocker", others | {name: tried}, metrics=[metric], window="cycle")
    gaps = np.where(designs["status"].isin([1, 5]), designs[metric] - value, np.nan)
    middle = explore.evaluate(
        "crank-rocker", others | {name: (tried[1:] + tried[:-1]) / 2}, metrics=[metric], window="cycle"
    )
    joined = np.isfinite(gaps[1:] * gaps[:-1]) & middle["status"].isin([1, 5]).to_numpy()
    assert not (joined & (gaps[1:] * gaps[:-1] < 0.0)).any()


def test_bounds_are_allowed_and_choose_the_branch():
    """A swing of 8 deg is had with a short coupler and with a long one."""
    fixed = {"crank": 37.0, "rocker": 595.0, "ground": 751.0}
    (short,) = solved("coupler", "swing_angle", 8.0, **fixed)
    (long,) = solved("coupler", "swing_angle", 8.0, low=460.0, **fixed)
    assert short < 459.72 < 460.0 < long
    for coupler in (short, long):
        assert metric_of("swing_angle", coupler=coupler, **fixed)[0] == pytest.approx(8.0, rel=1e-12)
    assert np.isnan(solved("coupler", "swing_angle", 8.0, low=short * (1 + 1e-9), high=long * (1 - 1e-9), **fixed))
    (at_bound,) = solved("coupler", "grashof_margin", 37.5, low=1271.5, **fixed)
    assert at_bound == pytest.approx(1271.5, abs=1e-12)
    # The swing is smallest at the centric coupler; just above it both lengths are close together.
    least = float(FACTS["swing_min_over_L2_L1_37"]["swing_deg"])
    (near,) = solved("coupler", "swing_angle", least * (1 + 1e-9), **fixed)
    assert near == pytest.approx(459.7227, abs=0.05)
    assert np.isnan(solved("coupler", "swing_angle", least * (1 - 1e-9), **fixed))


def test_designs_that_cannot_be_computed_have_no_solution_and_do_not_warn():
    odd = np.array([1e-320, 1e-30, 1.0, 1e30, 1e308, 500.0])
    others = {"coupler": odd, "rocker": odd[::-1].copy(), "ground": np.full(6, 700.0)}
    for name, metric, value in (("crank", "swing_angle", 20.0), ("crank", "grashof_margin", 1e308)):
        assert np.isnan(solved(name, metric, value, **others)).all()


def test_a_design_does_not_depend_on_its_neighbours():
    rng = np.random.default_rng(3)
    others = {"crank": rng.uniform(20, 60, 300), "rocker": rng.uniform(300, 700, 300), "ground": np.full(300, 751.0)}
    together = solved("coupler", "swing_angle", 12.0, **others)
    for k in range(0, 300, 17):
        (alone,) = solved("coupler", "swing_angle", 12.0, **{name: values[k] for name, values in others.items()})
        assert alone == together[k] or (np.isnan(alone) and np.isnan(together[k]))
    assert 0 < np.isnan(together).sum() < 300


def slider(name, metric, value, low=-np.inf, high=np.inf, **others):
    """A length of slider-cranks, from the others in mm; an offset that is not given is at its default, 0."""
    arrays = np.broadcast_arrays(*[np.atleast_1d(np.asarray(v, float)) for v in others.values()])
    solved_length = SolvedLength(name, make_request(SIMPLE_SLIDER, metrics=[metric]), value, low, high)
    return solve(solved_length, dict(zip(others, arrays, strict=True)))


def stroke(crank, rod, offset):
    """Difference of the legs of the two triangles with the offset as the other leg."""
    return np.sqrt((rod + crank) ** 2 - offset**2) - np.sqrt((rod - crank) ** 2 - offset**2)


def test_lengths_may_be_negative():
    """The smallest offset is the negative one of the two; bounds choose the other."""
    rng = np.random.default_rng(8)
    crank = rng.uniform(10.0, 100.0, 500)
    rod = crank * rng.uniform(1.1, 4.0, 500)
    for ratio in (0.05, 0.5, 0.9, 0.999):
        offset = ratio * (rod - crank)
        for k in range(0, 500, 25):
            design = {"crank": crank[k], "rod": rod[k]}
            (least,) = slider("offset", "stroke", stroke(crank[k], rod[k], offset[k]), **design)
            (largest,) = slider("offset", "stroke", stroke(crank[k], rod[k], offset[k]), low=0.0, **design)
            # the stroke changes with the square of the offset, in relation to the square of the rod
            allowed = 1e-13 * (rod[k] / offset[k]) ** 2
            assert least == pytest.approx(-offset[k], rel=allowed)
            assert largest == pytest.approx(offset[k], rel=allowed)
        margin = slider("offset", "margin", 0.25, crank=crank, rod=rod)
        expected = rod - crank - 0.25
        np.testing.assert_allclose(margin[expected > 0.0], -expected[expected > 0.0], rtol=1e-12)
    assert slider("offset", "stroke", 100.0, crank=50.0, rod=120.0) == 0.0  # touched there, at a corner
    assert np.isnan(slider("offset", "stroke", 99.0, crank=50.0, rod=120.0))
    assert np.isnan(slider("offset", "margin", 10.0, low=-59.0, high=59.0, crank=50.0, rod=120.0))


def test_lengths_beyond_the_sum_of_the_others():
    """A rod may be as long as one likes: with its length the stroke decreases to twice the crank."""
    for rod in (60.1, 75.0, 200.0, 3e4):
        value = stroke(50.0, rod, -10.0)
        (found,) = slider("rod", "stroke", value, crank=50.0, offset=-10.0)
        # at 3e4 mm the stroke is 1e-5 mm from its limit, in which 14 digits of it are nine
        assert found == pytest.approx(rod, rel=1e-5 if rod > 1e3 else 1e-11)
        assert stroke(50.0, found, -10.0) == pytest.approx(value, rel=1e-12)
    assert np.isnan(slider("rod", "stroke", 99.9, crank=50.0, offset=-10.0))


def test_lengths_that_are_not_given_have_their_default():
    (rod,) = slider("rod", "margin", 12.5, crank=50.0)
    assert rod == pytest.approx(62.5, rel=1e-13)
    (rod,) = slider("rod", "margin", 12.5, crank=50.0, offset=-20.0)
    assert rod == pytest.approx(82.5, rel=1e-13)


SWING = SolvedLength("crank", make_request(MECHANISM, metrics=["swing_angle"]), 20.0)
ROCKER, GROUND = ListedAxis("rocker", (595.0,)), ListedAxis("ground", (751.0,))
SPACES = [
    Grid.over((ListedAxis("coupler", (460.0, 600.0)), ListedAxis("rocker", (300.0, 500.0)), GROUND)),
    Sample((ContinuousAxis("coupler", 460, 1271), ROCKER, GROUND), 500, "sobol", 1),
    Table(
        (TableAxis("coupler", np.linspace(400, 900, BLOCK_SIZE + 5)), ROCKER, GROUND, ListedAxis("speed", (2.0,))),
        BLOCK_SIZE + 5,
    ),
]


@pytest.mark.parametrize("free", SPACES, ids=lambda space: space.method)
def test_spaces_of_all_kinds(free):
    space = SolvedSpace.over(free, SWING)
    assert (space.n_designs, space.method, space.seed, space.swept_parameters) == (
        free.n_designs,
        free.method,
        free.seed,
        free.swept_parameters,
    )
    assert [axis.name for axis in space.axes][:2] == ["crank", "coupler"]
    for number in range(space.n_blocks):
        part = pickle.loads(pickle.dumps(space.space_for_block(number)))
        block, whole = part.block(number).columns, space.block(number).columns
        assert list(block) == [axis.name for axis in space.axes]
        for name, values in whole.items():
            np.testing.assert_array_equal(block[name], values)
        np.testing.assert_array_equal(whole["crank"], solve(SWING, free.block(number).columns))
    np.testing.assert_array_equal(space.designs(1, 3)["crank"], space.designs(0, 4)["crank"][1:3])
    assert np.isfinite(space.designs(0, 4)["crank"]).any()


STUDY = """\
mechanism = "crank-rocker"
[parameters]
crank = { solve = "swing_angle", value = 20 }
coupler = { start = 460, stop = 1271.5, num = 180 }
rocker = { start = 300, stop = 700, num = 200 }
ground = 751
speed = [1, 2]
[evaluate]
metrics = ["swing_angle", "transmission_angle_min", "cv"]
[rank]
metrics = ["cv", "transmission_angle_min:max"]
"""


def test_a_sweep_walks_designs_of_the_same_swing(load, tmp_path):
    """Two blocks: threads, processes over TCP and a resumed sweep give the same bytes; the kept front is the front."""
    study = load(STUDY)
    assert study.space.n_blocks == 2
    results = explore.sweep(study, tmp_path / "a.h5")
    frame = results.to_pandas()
    reached = frame["status"] == 1
    assert set(frame["status"]) == {1, 11}
    np.testing.assert_allclose(frame["swing_angle"][reached], 20.0, rtol=1e-12)
    assert frame.loc[~reached, ["crank", "swing_angle", "cv"]].isna().all(axis=None)
    assert not frame["feasible"][~reached].any()
    # Designs that differ only in speed have the very same crank.
    assert frame["crank"][::2].equals(frame["crank"][1::2].set_axis(frame.index[::2]))

    with pytest.raises(Stop):
        explore.sweep(study, tmp_path / "b.h5", report_progress=stop)
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster) as client,
    ):
        explore.sweep(study, tmp_path / "b.h5", client=client)
        front = explore.sweep(study, tmp_path / "front.h5", client=client, keep="front").to_pandas()
    assert sha256(tmp_path / "a.h5") == sha256(tmp_path / "b.h5")
    best = explore.rank(results)
    assert sorted(front.index) == sorted(best.index)


#: Rocker and coupler of the designs of 20 deg that none beats in pin force, distortion and size.
NON_DOMINATED = {(300, 600), (400, 460), (400, 600), (500, 460), (500, 600), (595, 460), (595, 600), (595, 750),
                 (700, 460), (700, 600)}  # fmt: skip


def test_designs_of_20_deg_and_the_best_of_them(load):
    """The thirty pairs of the rig: pin force by statics, distortion by a Fourier transform of the velocity."""
    study = load("""
mechanism = "crank-rocker"
[parameters]
crank = { solve = "swing_angle", value = 20 }
coupler = [460, 600, 750, 900, 1050, 1271.5]
rocker = [300, 400, 500, 595, 700]
ground = 751
""")
    designs = study.space.designs(0, 30)
    good = np.isfinite(designs["crank"])
    assert good.sum() == 25
    assert solve(study.space.solved_length, designs).tobytes() == designs["crank"].tobytes()
    found = {}
    for k in np.flatnonzero(good):
        lengths = {name: float(values[k]) for name, values in designs.items()}
        motion = explore.simulate("crank-rocker", lengths, angles=256)
        harmonics = np.abs(np.fft.rfft(motion["rocker_velocity"]))
        # The force is largest where the coupler is steepest to the rocker, which crank angles 0 and 180 deg include.
        force = 25e6 / (lengths["rocker"] * np.sin(np.radians(motion["transmission_angle"])).min())
        distortion = np.sqrt(np.sum(harmonics[2:] ** 2)) / harmonics[1]
        found[lengths["rocker"], lengths["coupler"]] = (force, distortion, lengths["coupler"] + lengths["rocker"])
    best = {
        pair for pair, own in found.items()
        if not any(other != own and all(a <= b for a, b in zip(other, own, strict=True)) for other in found.values())
    }  # fmt: skip
    assert best == NON_DOMINATED
    force, distortion, size = found[500, 600]  # the source's point and the better one that the study names
    assert (force, distortion, size) == (pytest.approx(52.1e3, abs=50), pytest.approx(0.0796, abs=5e-5), 1100.0)
    force, distortion, size = found[595, 1271.5]
    assert (force, distortion, size) == (pytest.approx(161.4e3, abs=50), pytest.approx(0.1643, abs=5e-5), 1866.5)


def test_the_command_line_reports_unreachable_designs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("rig.toml").write_text(
        STUDY.replace("num = 180", "num = 4").replace("num = 200", "num = 3").replace("[1, 2]", "1")
    )
    out, _ = succeed("sweep", "rig.toml", "--dry-run")
    assert out.splitlines()[-5].split() == ["0", "–", "460", "300", "751", "1"]
    code, out, err = call("sweep", "rig.toml", "-q")
    assert (code, out, err) == (0, "", "")
    _, err = succeed("rank")
    assert "left out: 3 unreachable: nothing within its bounds gives the value to solve for" in err
    code, out, _ = call("show", "--design", "0")
    assert "unreachable: nothing within its bounds gives the value to solve for" in out
    code, out, err = call("simulate", "rig.toml", "--design", "0")
    assert (code, out) == (1, "")
    assert err.endswith(
        "error: design 0 of rig.toml has no crank: nothing within its bounds gives the value to solve for\n"
    )
    succeed("simulate", "rig.toml", "--design", "0", "--set", "crank=5", "--angles", "3")
    # The parameters that every design has come first; the one solved for can be asked for.
    for options in ([], ["--x", "crank"]):
        succeed("plot", "map", *options, "-o", "map.svg")


@pytest.mark.parametrize("share", [0.5, 1e-2, 1e-5, 1e-9])
def test_between_bounds_up_to_the_border_of_the_motion(share):
    """Cranks whose stroke is that of one shorter than the longest that turns by a share, where no loop is declared."""
    rods, offsets = np.array([120.0, 150.0, 90.0]), np.array([10.0, -40.0, 25.0])
    longest = rods - np.abs(offsets)
    known = (1.0 - share) * longest
    columns = {"crank": known, "rod": rods, "offset": offsets}
    with MECHANISMS.including(SIMPLE_SLIDER):
        strokes = explore.evaluate("simple-slider", columns, metrics=["stroke"], window="cycle")["stroke"]
    request = make_request(replace(SIMPLE_SLIDER, loop_lengths=()), metrics=["stroke"])
    for k, stroke in enumerate(strokes):
        design = {name: values[k : k + 1] for name, values in columns.items() if name != "crank"}
        (crank,) = solve(SolvedLength("crank", request, stroke, 1.0, 300.0), design)
        assert crank == pytest.approx(known[k], rel=1e-12)
        assert np.isnan(solve(SolvedLength("crank", request, 2.0 * rods[k], 1.0, 300.0), design)).all()


@pytest.mark.parametrize(
    ("function", "root"),
    [
        (lambda x: np.where(x < 2.3, 1.0, x - 5.2), 5.2),  # a jump to the other sign
        (lambda x: np.minimum((x - 2.1) ** 2 + 0.01, (x - 6.1) ** 2 - 0.01), 6.0),  # two dips
        (lambda x: np.where(x < 4.0, np.nan, 7.7 - x), 7.7),
        (lambda x: np.where(x < 4.0, 1.0, -1.0), np.nan),
        (lambda x: np.abs(x - 4.25), 4.25),  # it touches 0 between two lengths with the same difference
    ],
)
def test_the_next_candidate_is_tried_where_one_is_no_root(function, root):
    lengths = np.linspace(0.0, 10.0, 21)[:, None]
    found = first_root(lambda x, _: function(x), lengths, function(lengths), np.arange(1), 1.0)
    assert found == pytest.approx(root, rel=1e-12, nan_ok=True)
