"""Derivatives from ball arithmetic against mpmath, and differences with their errors against these."""

import mpmath
import numpy as np
import pytest
from exact_linkage import slope_of
from linkage_cases import CASES, linkage_of, values_of

import explore
from explore.analysis.tolerancing import robustness
from explore.analysis.tolerancing.derivatives import differentiate
from explore.analysis.tolerancing.outcomes import TolerancedRequest
from explore.analysis.tolerancing.slopes import sharpen
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request
from explore.studies.request.tolerances import make_tolerances

PUBLISHED = {"crank": 50.0, "coupler": 940.62, "rocker": 211.79, "ground": 869.44}
#: Rounding of the exact value and of the derivative.
ROUNDED = 2.0**-52
METRICS = {
    "crank-rocker": ["swing_angle", "time_ratio", "mid_angle", "transmission_angle_min", "transmission_angle_max", "cv",
                     "mean", "footprint", "rocker_velocity_max"],
    "slider-crank": ["stroke", "time_ratio", "pressure_angle_max", "slider_velocity_cv", "slider_velocity_rms",
                     "slider_acceleration_max", "footprint"],
}  # fmt: skip
CLOSED = {
    "swing_angle": lambda linkage: mpmath.degrees(linkage.swing),
    "time_ratio": lambda linkage: linkage.time_ratio,
    "mid_angle": lambda linkage: mpmath.degrees(linkage.mid_angle),
    "transmission_angle_min": lambda linkage: mpmath.degrees(linkage.transmission_angle_min),
    "transmission_angle_max": lambda linkage: mpmath.degrees(linkage.transmission_angle_max),
}


def toleranced(kind, metrics, lengths):
    mechanism = find_mechanism(kind)
    request = make_request(mechanism, metrics=metrics)
    return TolerancedRequest.of(request, [], make_tolerances(mechanism, dict.fromkeys(lengths, 0.1)))


def complete(kind, lengths):
    return {p.name: p.default for p in find_mechanism(kind).parameters if p.default is not None} | lengths


def random_designs(kind, seed=1):
    """Designs that move, half of a box of lengths."""
    random = np.random.default_rng(seed)
    while True:
        if kind == "crank-rocker":
            yield dict(zip(PUBLISHED, [random.uniform(10, 100), *random.uniform(50, 400, 3)], strict=True))
        else:
            lengths = [random.uniform(10, 100), random.uniform(50, 400), random.uniform(-50, 50)]
            yield dict(zip(("crank", "rod", "offset"), lengths, strict=True))


def test_exact_slopes_are_those_of_mpmath():
    designs, checked = random_designs("crank-rocker", 2), 0
    request = toleranced("crank-rocker", list(CLOSED), PUBLISHED)
    while checked < 8:
        lengths = PUBLISHED if checked == 0 else next(designs)
        design = complete("crank-rocker", lengths)
        rough = differentiate(request, design)
        if np.isnan(rough.slopes["swing_angle"]).all():
            continue
        checked += 1
        sharp = sharpen(rough, request, design)
        for name in CLOSED:
            for k, length in enumerate(lengths):
                exact = float(slope_of(CLOSED[name], lengths, length, 18))
                assert sharp.slopes[name][k] == pytest.approx(exact, rel=2 * ROUNDED, abs=0)
                assert sharp.errors[name][k] <= ROUNDED * abs(exact)


@pytest.mark.parametrize("kind", METRICS)
@pytest.mark.parametrize("count", [25, pytest.param(1000, marks=pytest.mark.slow)])
def test_the_errors_of_differences_hold(kind, count):
    """The figures of docs/tolerance.md; a shorter run stays below those of the longer one."""
    designs = random_designs(kind)
    lengths = list(next(random_designs(kind)))
    request = toleranced(kind, METRICS[kind], lengths)
    relative = []
    while count:
        design = complete(kind, next(designs))
        rough = differentiate(request, design)
        if np.isnan(rough.slopes[METRICS[kind][0]]).all():
            continue
        count -= 1
        sharp = sharpen(rough, request, design)
        values = request.exact.outcomes(design, np.zeros((len(lengths), 1))).metrics
        sizes = np.array([abs(design[name]) for name in lengths])
        for name in METRICS[kind]:
            is_known = ~np.isnan(sharp.slopes[name])
            assert (is_known == ~np.isnan(rough.slopes[name])).all()
            error = np.abs(sharp.slopes[name] - rough.slopes[name])
            assert (error <= rough.errors[name])[is_known].all(), (name, design)
            natural = np.maximum(np.abs(sharp.slopes[name]), np.abs(values[name]) / sizes)
            assert (sharp.errors[name] <= ROUNDED * natural)[is_known].all()
            relative += (error / natural)[is_known].tolist()
    assert len(relative) > 2 * len(METRICS[kind])
    assert np.quantile(relative, 0.98) < 1e-12
    assert max(relative) < 1e-10


#: Crank-rockers beside change points of which differences agreed by chance, off by 2 to 7 of their errors.
BESIDE_CHANGE_POINTS = (
    ("transmission_angle_min", (96.94035102730442, 290.4681865593526, 233.17626887582762, 154.23305705837996)),
    ("transmission_angle_min", (205.5590701035143, 215.59486290835176, 275.0067690795871, 264.9990741495612)),
    ("transmission_angle_min", (206.8040117344441, 286.49691120996175, 291.9306888789401, 212.426895554721)),
    ("time_ratio", (266.33319411372577, 273.03405906842767, 279.6524396214327, 273.0357723148095)),
    ("time_ratio", (111.45437581734618, 284.6116936263694, 291.61015130272455, 118.46535261563477)),
    ("mean", (65.05416984930358, 262.615951445668, 155.83493589590435, 171.83583787271775)),
)


@pytest.mark.parametrize(("name", "lengths"), BESIDE_CHANGE_POINTS)
def test_the_errors_of_differences_hold_beside_change_points(name, lengths):
    request = toleranced("crank-rocker", [name], PUBLISHED)
    design = complete("crank-rocker", dict(zip(PUBLISHED, lengths, strict=True)))
    rough = differentiate(request, design)
    error = np.abs(sharpen(rough, request, design).slopes[name] - rough.slopes[name])
    assert (error <= rough.errors[name]).all()
    assert (rough.errors[name] <= 1e-5 * np.abs(rough.slopes[name])).all()


def test_folds_and_jumps_have_no_slope():
    """Without an offset both strokes last equally long: what is slow changes there, in steps far below its tie."""
    names = ["stroke", "time_ratio", "slider_velocity_cv", "slider_velocity_max", "slider_acceleration_max"]
    request = toleranced("slider-crank", names, ["crank", "offset"])
    design = complete("slider-crank", {"crank": 80.0, "rod": 300.0, "offset": 0.0})
    rough = differentiate(request, design)
    for found in (rough, sharpen(rough, request, design)):
        has_slope = {name: not np.isnan(found.slopes[name][1]) for name in names}
        assert has_slope == {name: name == "stroke" for name in names}
        assert found.slopes["stroke"] == pytest.approx([2.0, 0.0], abs=1e-12)


def test_a_slope_that_is_0_is_0():
    """The rise of the ram's line moves its stroke's ends alike, and its rod's length does: 4e-16 would be noise."""
    linkage = linkage_of(CASES["crank-shaper"])
    design = values_of(CASES["crank-shaper"]) | {"speed": 1.0}
    request = make_request(linkage.mechanism, metrics=["lever_angle_peak_to_peak", "ram_position_peak_to_peak"])
    tolerances = make_tolerances(linkage.mechanism, {"crank": 0.1, "link": 0.1, "rise": 0.1})
    found = differentiate(TolerancedRequest.of(request, [], tolerances), design)
    for name in found.slopes:
        assert (found.slopes[name] == 0.0).tolist() == [False, True, True]
        assert (found.errors[name][1:] < 1e-12).all()


@pytest.mark.parametrize("count", [robustness.MOST_INTEGRATED, robustness.MOST_INTEGRATED + 1])
def test_many_designs_have_exact_slopes_but_of_integrals(tmp_path, count):
    study = explore.Study(
        mechanism="slider-crank",
        parameters={"crank": {"start": 40, "stop": 60, "num": count}, "rod": 200.0, "offset": 10.0},
        metrics=["stroke", "slider_velocity_cv"],
        tolerances={"crank": 0.1, "rod": 0.2},
    )
    results = explore.sweep(study, tmp_path / "study.h5")
    found = explore.tolerance(results, designs=list(range(count)), draws=2).derivatives
    is_exact = (found["error"] <= ROUNDED * found["derivative"].abs()).groupby("metric").all()
    assert dict(is_exact) == {"stroke": True, "slider_velocity_cv": count <= robustness.MOST_INTEGRATED}
