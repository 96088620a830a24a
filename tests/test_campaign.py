"""The error bound over random crank-rockers, against references of quadruple precision by an independent method."""

from pathlib import Path

import mpmath
import norms
import numpy as np
import pytest
from bounds import REFERENCE_ERROR
from exact_linkage import SIGNALS, ExactLinkage

import explore

PHASES = (1, 2, 3, 4, 6)
WINDOWS = ("overlapped_to_extended", "extended_to_overlapped", "cycle")
TOLERANCES = (1e-6, 1e-9, 1e-12)
OK, TOLERANCE_NOT_MET = 1, 7
# Each request alone, so that the bound of one signal or statistic cannot hide behind a looser one.
MOMENTS = [((signal,), ("mean", "variance", "std", "rms")) for signal in SIGNALS]
MOMENTS += [((signal,), ("cv",)) for signal in SIGNALS[:3]]
MOMENTS += [((signal,), ("mean",)) for signal in SIGNALS] + [((signal,), ("variance",)) for signal in SIGNALS]


class Campaign:
    """The references, row i belonging to design i."""

    def __init__(self, path):
        with np.load(path) as stored:
            self.__dict__.update(stored)
        self.size = len(self.lengths)

    def parameters(self, count, phases=3):
        names = ("crank", "coupler", "rocker", "ground")
        columns = {name: self.lengths[:count, k] for k, name in enumerate(names)}
        return columns | {"branch": self.branch[:count].astype(float), "phases": np.full(count, float(phases))}


@pytest.fixture(scope="module")
def campaign():
    return Campaign(Path(__file__).parent / "reference" / "campaign.npz")


@pytest.fixture(scope="module")
def count(campaign):
    return campaign.size


def check_bound(true, table, tolerance, what):
    """The bound holds in 99.9 % of designs and is never wrong by more than 10 times; ok means the tolerance is met."""
    status, bound = table["status"].to_numpy(), table["error"].to_numpy()
    assert np.isin(status, (OK, TOLERANCE_NOT_MET)).all(), what
    assert (bound[status == OK] <= tolerance).all(), what
    assert (bound[status == TOLERANCE_NOT_MET] > tolerance).all(), what
    # A mean of 0 is exact; a difference below the error of the references is none.
    true = np.where(true <= REFERENCE_ERROR, 0.0, true)
    is_exact = (bound == 0.0) & (true == 0.0)
    assert (is_exact | (bound > 0.0)).all(), what
    ratio = true / np.where(is_exact, 1.0, bound)
    worst = int(np.argmax(ratio))
    assert ratio[worst] <= 10.0, f"{what}: design {worst} errs {ratio[worst]:.3g} times its bound"
    # At least one exception is allowed in any number of designs, else 999 designs could not have the rate 99.9 %.
    assert np.count_nonzero(ratio > 1.0) <= max(1, len(true) // 1000), what


def test_the_campaign_covers_all_margins_and_kinds(campaign):
    assert campaign.size == 10_000
    lengths = campaign.lengths
    crank, others = lengths[:, 0], lengths[:, 1:]
    assert (crank < others.min(axis=1)).all()
    # Plain sums are good to 2e-16 of the longest link: enough to see margins from 1e-12 to 1.
    relative = (others.sum(axis=1) - 2 * others.max(axis=1) - crank) / others.max(axis=1)
    assert relative.min() > 0.99e-12
    decades = np.histogram(np.log10(relative), np.arange(-12, 1))[0]
    assert (decades > 300).all()
    assert set(np.unique(campaign.branch)) == {-1, 1}
    assert (np.bincount(campaign.kind) > 900).all()


def test_one_clutch_hands_over_once(campaign):
    """The clutch window assumes this: the rocker velocity has one peak on each stroke, so the output has one kink."""
    assert (campaign.peaks == 2).all()
    assert set(np.unique(campaign.switches)) == {0, 1}


@pytest.mark.parametrize("design", range(0, 10_000, 1250))
def test_the_references_agree_with_60_digits(campaign, design):
    linkage = ExactLinkage(*campaign.lengths[design], branch=int(campaign.branch[design]))
    through_zero = (0, 1) if campaign.branch[design] > 0 else (1, 0)
    for window in (0, 1):
        moments = linkage.moments(*linkage.stroke(window == through_zero[0]))
        for s, (mean, variance) in enumerate(moments):
            rms = mpmath.sqrt(mean**2 + variance)
            # Both are good to 1e-20; what remains is the rounding of the stored doubles, 1.1e-16 of each value.
            assert abs(campaign.mean[design, window, s] - mean) <= 1.2e-16 * rms
            assert abs(campaign.variance[design, window, s] - variance) <= 1.2e-16 * rms**2


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("window", range(3), ids=WINDOWS)
def test_bound_of_moments(campaign, count, window, tolerance):
    for signals, statistics in MOMENTS:
        if "cv" in statistics and WINDOWS[window] == "cycle":
            continue
        names = [f"{signal}_{statistic}" for signal in signals for statistic in statistics]
        table = explore.evaluate(
            "crank-rocker", campaign.parameters(count), metrics=names, window=WINDOWS[window], tolerance=tolerance
        )
        assert table["nodes"].max() <= 1_000
        true = np.zeros(count)
        for signal in signals:
            s = SIGNALS.index(signal)
            mean, variance = campaign.mean[:count, window, s], campaign.variance[:count, window, s]
            for statistic in statistics:
                error = norms.worst(statistic, table[f"{signal}_{statistic}"].to_numpy(), mean, variance)
                if statistic == "cv":
                    # undefined where the mean is tiny; close to the threshold either result is right
                    share = np.abs(mean) / np.sqrt(mean**2 + variance) / (1e3 * tolerance)
                    assert np.isfinite(error[share > 1.001]).all()
                    assert np.isnan(error[share < 0.999]).all()
                    error = np.nan_to_num(error)
                true = np.fmax(true, error)
        check_bound(true, table, tolerance, f"{names} over {WINDOWS[window]}")


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_bound_of_the_named_drive(campaign, count, tolerance):
    """`drive` is the slow stroke, `return` the other: values are those of the stroke with the larger interval."""
    names = [f"{signal}_{s}_{w}" for w in ("drive", "return") for signal in SIGNALS for s in ("mean", "variance")]
    table = explore.evaluate("crank-rocker", campaign.parameters(count), metrics=names, tolerance=tolerance)
    assert table["nodes"].max() <= 1_000
    # Where the intervals agree to 1e-9 the last digits of the lengths decide.
    interval = campaign.interval[:count]
    is_clear = np.abs(interval[:, 0] - interval[:, 1]) > 1e-9
    assert is_clear.mean() > 0.8
    slow = np.argmax(interval[:, :2], axis=1)
    true, rows = np.zeros(count), np.arange(count)
    for name in names:
        signal, statistic, window = name.rsplit("_", 2)
        stroke, s = (slow if window == "drive" else 1 - slow), SIGNALS.index(signal)
        mean, variance = campaign.mean[rows, stroke, s], campaign.variance[rows, stroke, s]
        true = np.fmax(true, norms.worst(statistic, table[name].to_numpy(), mean, variance))
    check_bound(true[is_clear], table[is_clear], tolerance, "all signals over drive and return")


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("signal", ["rocker_velocity", "rocker_acceleration"])
@pytest.mark.parametrize("window", range(3), ids=WINDOWS)
def test_bound_of_extremes(campaign, count, window, signal, tolerance):
    names = [f"{signal}_{statistic}" for statistic in ("min", "max", "peak_to_peak")]
    table = explore.evaluate(
        "crank-rocker", campaign.parameters(count), metrics=names, window=WINDOWS[window], tolerance=tolerance
    )
    assert table["nodes"].max() <= 1_000
    extremes = campaign.extremes[:count, window, ("rocker_velocity", "rocker_acceleration").index(signal)]
    true = np.zeros(count)
    for name in names:
        statistic = name.removeprefix(signal + "_")
        # peak-to-peak adds the errors of two extremes, each bounded
        error = norms.worst(statistic, table[name].to_numpy(), 0.0, 1.0, (extremes[:, 0], extremes[:, 1]))
        true = np.fmax(true, error * (0.5 if statistic == "peak_to_peak" else 1.0))
    check_bound(true, table, tolerance, f"extremes of {signal} over {WINDOWS[window]}")


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("drive", [0, 1], ids=WINDOWS[:2])
@pytest.mark.parametrize("phases", PHASES)
def test_bound_of_the_clutch(campaign, count, phases, drive, tolerance):
    count = min(count, len(campaign.clutch))
    names = [f"output_velocity_{statistic}" for statistic in ("mean", "variance", "cv", "min", "max")]
    table = explore.evaluate(
        "crank-rocker", campaign.parameters(count, phases),
        metrics=names, window="clutch", drive=WINDOWS[drive], tolerance=tolerance,
    )  # fmt: skip
    assert table["nodes"].max() <= 1_000
    mean, variance, low, high = campaign.clutch[:count, PHASES.index(phases), drive].T
    true = np.zeros(count)
    for name in names:
        error = norms.worst(name.removeprefix("output_velocity_"), table[name].to_numpy(), mean, variance, (low, high))
        if name.endswith("cv"):
            share = np.abs(mean) / np.sqrt(mean**2 + variance) / (1e3 * tolerance)
            assert np.isfinite(error[share > 1.001]).all()
            error = np.nan_to_num(error)
        true = np.fmax(true, error)
    check_bound(true, table, tolerance, f"{phases} phases, {WINDOWS[drive]}")
