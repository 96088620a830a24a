"""The reference against Freudenstein's equation with 60 digits, and against stored numbers."""

import json
import subprocess
import sys
import time
from pathlib import Path

import mpmath
import numpy as np
import pytest
from exact_linkage import ExactLinkage
from loop_cases import four_bars, rockers

from explore.comparison.reference import exact_motion
from explore.comparison.reference_statistics import STATISTICS, exact_statistics
from explore.comparison.scenes import bundled_scenes, load_scene
from explore.comparison.strokes import WINDOWS

CASES = json.loads((Path(__file__).parent / "reference" / "crank_rocker.json").read_text())["designs"]
#: Decimal lengths, one near a toggle, ones near the change point to the last double, ratios up to 1e9.
LENGTHS = np.array([
    [100.0, 1083.4236, 541.7118, 691.7118],
    [50.0, 940.62, 211.79, 869.44],
    [50.0, 999.5, 58.0, 999.5],
    [0.025, 1083.4236, 541.7118, 691.7118],
    [150.0, 1083.5, 541.75, 691.75 + 2.0**-20],
    [150.0, 1083.5, 541.75, 691.75 + 2.0**-39],
    [1e-3, 1e6, 3.0, 1e6],
])  # fmt: skip
#: Both computations are rounded once, and may round a number halfway between two doubles differently.
ONE_ULP = 2.3e-16
IMPOSSIBLE = np.array([
    [150.0, 1083.4236, 541.7118, 691.7118],
    [200.0, 1083.4236, 541.7118, 691.7118],
    [100.0, 2000.0, 541.7118, 691.7118],
    [np.nan, 1.0, 1.0, 1.0],
])  # fmt: skip


@pytest.mark.parametrize("branch", [1.0, -1.0])
def test_motion_is_that_of_freudensteins_equation(branch):
    # near the change point the last bits of an angle matter: 0, pi and their neighbours
    special = [0.0, 1e-9, -1e-9, 1e-17, 3e-5, np.pi, -np.pi, np.nextafter(np.pi, 4), 1.0, 7.0, -20.0]
    angles = np.tile(special, (len(LENGTHS), 1))
    motion = exact_motion(four_bars(LENGTHS, branch, angles))
    assert motion.shape == (6, len(LENGTHS), len(special))
    for i, lengths in enumerate(LENGTHS):
        linkage = ExactLinkage(*lengths, branch=int(branch))
        for j, angle in enumerate(special):
            theta = mpmath.mpf(angle)
            expected = [float(x) for x in (*linkage.angles(theta), *linkage.motion(theta))]
            # values that are 0 by symmetry are about 1e-60 in the other computation
            assert motion[:, i, j] == pytest.approx(expected, rel=ONE_ULP, abs=1e-40), (lengths, angle)


@pytest.mark.parametrize("branch", [1.0, -1.0])
@pytest.mark.parametrize("lengths", LENGTHS[[0, 1, 4, 6]], ids=lambda row: "-".join(f"{x:g}" for x in row))
def test_statistics_over_the_drive_stroke_are_those_of_freudensteins_equation(lengths, branch):
    linkage = ExactLinkage(*lengths, branch=int(branch))
    strokes = [linkage.stroke(through_zero) for through_zero in (True, False)]
    first, last = max(strokes, key=lambda stroke: stroke[1] - stroke[0])
    (_, expected_velocity, _, expected_acceleration) = linkage.moments(first, last)
    (statistics,) = np.moveaxis(exact_statistics(rockers(lengths[None], branch)), -1, 0)
    mean, variance = expected_velocity
    # the quadrature of the other computation is accurate to 1e-17 of the rms
    assert statistics[1, 0] == pytest.approx(float(mean), rel=ONE_ULP, abs=0.0)
    assert abs(statistics[1, 0]) == pytest.approx(float(linkage.swing / (last - first)), rel=ONE_ULP, abs=0.0)
    assert statistics[1, 1] == pytest.approx(float(variance), rel=1e-15, abs=0.0)
    assert statistics[1, 2] == pytest.approx(float(mpmath.sqrt(variance) / abs(mean)), rel=1e-15, abs=0.0)
    assert statistics[2, 0] == 0.0
    assert abs(expected_acceleration[0]) < 1e-15 * mpmath.sqrt(expected_acceleration[1])
    assert statistics[2, 1] == pytest.approx(float(expected_acceleration[1]), rel=1e-15, abs=0.0)
    # the angle goes from one limit position to the other, where the velocity is 0
    limits = sorted(float(linkage.angles(end)[1]) for end in (first, last))
    assert statistics[0, 3:] == pytest.approx(limits, rel=ONE_ULP)
    assert 0.0 in statistics[1, 3:]


@pytest.mark.parametrize("case", CASES, ids=["{crank}-{coupler}-{rocker}-{ground}".format(**case) for case in CASES])
def test_stored_statistics(case):
    lengths = np.array([[float(case[k]) for k in ("crank", "coupler", "rocker", "ground")]])
    through_zero = float(case["crank_angle_overlapped_to_extended"])
    drive = "overlapped_to_extended" if through_zero > np.pi else "extended_to_overlapped"
    for window, stored in (("drive", case[drive]), ("cycle", case["cycle"])):
        statistics = exact_statistics(rockers(lengths, float(case["branch"])), window)[:, :, 0]
        for k, signal in enumerate(("rocker_velocity", "rocker_acceleration"), start=1):
            expected = {name: float(text) for name, text in stored[signal].items() if text is not None}
            assert {"mean", "variance"} <= expected.keys()
            for name, value in expected.items():
                # decimal lengths were used exactly there and are rounded to doubles here
                assert statistics[k, STATISTICS.index(name)] == pytest.approx(value, rel=4e-15, abs=0.0), (
                    signal,
                    name,
                )


def test_extremes_are_those_of_dense_samples():
    """The largest of 2001 samples is below the maximum, by at most what the second difference allows."""
    lengths = LENGTHS[:1]
    angles = np.linspace(-np.pi, np.pi, 2001)
    samples = exact_motion(four_bars(lengths, 1.0, angles[None]))[[1, 3, 5], 0]
    exact = exact_statistics(rockers(lengths), "cycle")[:, :, 0]
    step = angles[1] - angles[0]
    curvature = np.abs(np.diff(samples, 2, axis=1)).max(axis=1) / step**2
    for k in range(3):
        for maximum, largest in ((exact[k, 4], samples[k].max()), (-exact[k, 3], -samples[k].min())):
            assert 0.0 <= maximum - largest <= curvature[k] * step**2 / 8.0


@pytest.mark.parametrize("window", WINDOWS)
def test_a_linkage_that_cannot_turn_has_no_statistics(window):
    mixed = np.vstack([LENGTHS[:1], IMPOSSIBLE, [[4.0, 5.0, 4.5, 2.0]]])  # the last is a double crank: it does not rock
    statistics = exact_statistics(rockers(mixed), window)
    assert np.isnan(statistics[:, :, 1:]).all()
    assert np.array_equal(statistics[:, :, :1], exact_statistics(rockers(LENGTHS[:1]), window), equal_nan=True)
    motion = exact_motion(four_bars(mixed, 1.0, np.zeros((len(mixed), 2))))
    assert np.isfinite(motion).all(axis=(0, 2)).tolist() == [True, False, False, False, False, True]


def test_undefined_statistics_are_nan():
    drive, cycle = (exact_statistics(rockers(LENGTHS[:1]), window)[:, 2, 0] for window in WINDOWS)
    assert np.isnan(drive).tolist() == [True, False, True]
    assert np.isnan(cycle).all()


def test_the_callers_precision_does_not_change():
    mpmath.mp.dps = 33
    exact_statistics(rockers(LENGTHS[:1]))
    assert mpmath.mp.dps == 33


def test_mpmath_is_imported_only_when_needed():
    check = "import sys, explore.comparison.reference; print('mpmath' in sys.modules)"
    process = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
    assert process.stdout == "False\n"


def test_the_reference_meets_its_time_limit():
    """An angle takes 0.5 ms and the slowest design 1.5 s; a busy machine takes less than ten times as long."""
    scene = load_scene(bundled_scenes()["almost_change_point"])
    begin = time.process_time()
    last = scene.designs.part(np.array([-1]))
    exact_motion(last.task(np.linspace(-3, 3, 100)[None]))
    middle = time.process_time()
    exact_statistics(last, "cycle")
    assert middle - begin < 100 * 5e-3
    assert time.process_time() - middle < 15
