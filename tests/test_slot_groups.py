"""Groups of links that slots tie: statuses and statistics, against all joints together."""

import numpy as np
import pytest
from slot_groups import GROUPED, Poses

import explore

#: Steps of a turn.
STEPS = 1024
WHOLE = [name for name, table in GROUPED.items() if "range" not in table]
COUNTS = [pytest.param(3, id="fast"), pytest.param(60, marks=pytest.mark.slow, id="slow")]


def designs_of(name, count):
    """Lengths of the crank of a table: one that turns, and others up to those that are blocked."""
    return np.append(4.0, np.random.default_rng(len(name)).uniform(2.0, 60.0, count - 1))


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", WHOLE)
def test_statuses_and_statistics_are_those_of_all_joints(name, count):
    table, lengths = GROUPED[name], designs_of(name, count)
    link, linkage = list(table["links"])[2], explore.Linkage(table)
    metrics, ends = [f"{link}_velocity_{each}" for each in ("variance", "max", "min")], ("from", "to")
    asked = [*metrics, *(f"assembles_{end}_1" for end in ends)]
    found, met = explore.evaluate(linkage, {"r": lengths, "speed": np.ones(count)}, metrics=asked), set()
    labels = [linkage.mechanism.status_labels[code] for code in found["status"]]
    for k, r in enumerate(lengths):
        met.add(labels[k][:13])
        if labels[k] == "no_assembly_at_sketch":
            continue
        poses = Poses(table, r)
        start = poses.start(explore.simulate(linkage, {"r": r, "speed": 1.0}, angles=[0.0]).iloc[0])
        path = poses.follow(start, 1.0, STEPS)
        is_whole = len(path) == STEPS + 1
        assert (labels[k] == "ok") == is_whole, r
        if not is_whole:
            assert labels[k].startswith("crank_blocked_at_")
            steps = -len(poses.follow(start, -1.0, STEPS)), len(path)
            # the fold is within the next step
            low, high = (found.loc[k, f"assembles_{end}_1"] * STEPS / 360 for end in ends)
            assert steps[0] <= low - STEPS <= steps[0] + 1
            assert steps[1] - 1 <= high - STEPS <= steps[1]
        else:
            angles = path[:-1, 3 * poses.moving.index(link) + 2]
            # the derivative by Fourier's series, of which a turn of steps has all that counts
            rates = np.fft.irfft(1j * np.arange(STEPS // 2 + 1) * np.fft.rfft(angles), STEPS)
            exact = np.array([rates.var(), rates.max(), rates.min()])
            assert found.loc[k, metrics].to_numpy(float) == pytest.approx(exact, rel=1e-4, abs=1e-4 * rates.std())
            assert found.loc[k, metrics[0]] == pytest.approx(exact[0], rel=1e-8)
    assert met >= {"ok", "crank_blocked"}
