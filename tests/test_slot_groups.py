"""Groups of links that slots tie: statuses and statistics, against all joints together."""

import numpy as np
import pytest
from slot_groups import GROUPED, Poses

import explore
from explore.base.errors import ConfigError

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
    assert met >= ({"ok"} if name == "two slots from the hinge" else {"ok", "crank_blocked"})


def test_the_driver_may_have_no_point_but_its_pivot():
    table = GROUPED["a slot of the driver"]
    links = table["links"] | {"crank": {"O": 0}}
    slots = {"rail": {"pin": "D", "link": "crank", "along": [[0, 0], [30, "r / 6"]]}}
    values = {"r": 6.0, "speed": 1.0}
    one, other = (
        explore.simulate(explore.Linkage(each), values, angles=[3.0])
        for each in (table, table | {"links": links, "slots": slots})
    )
    assert one["D_x"].iloc[0] == pytest.approx(other["D_x"].iloc[0], rel=1e-14)


RIGID = {"M": {"A": 0, "C": 60, "P": [20, 30]}, "N": {"C": 0, "Q": [10, 40], "R": [30, -5]}}
FIRST_SLOT = {"pin": "P", "link": "N", "along": ["C", "R"]}


def rigid(bar=None, **slots):
    """A table of two links M and N that are pinned to each other, M to the crank."""
    links = {"crank": {"O": 0, "A": "r"}, **RIGID} | ({"bar": bar} if bar else {})
    sketch = {"crank_angle": 0, "C": [60, 9], "P": [22, 33], "Q": [75, 45], "R": [90, 0], "H": [120, 40]}
    return {"driver": "crank", "frame": {"O": [0, 0], "H": [120, 40]}, "links": links, "slots": slots,
            "parameters": {"r": {"default": 6.0}}, "sketch": sketch}  # fmt: skip


@pytest.mark.parametrize(
    "table",
    [rigid(s=FIRST_SLOT, t={"pin": "Q", "link": "M", "along": ["A", "P"]}), rigid({"A": 0, "R": 70}, s=FIRST_SLOT)],
)
def test_links_that_are_held_to_each_other_twice_are_no_group(table):
    with pytest.raises(ConfigError, match="M.* form a group that no dyad solves"):
        explore.Linkage(table)


def test_a_slot_whose_pin_rests_has_no_friction():
    table = rigid({"H": 0, "R": 45}, s=FIRST_SLOT)
    assert explore.Linkage(table)
    with pytest.raises(ConfigError, match="friction.s: the pin of s rests, as M and N are of one rigid part"):
        explore.Linkage(table | {"loads": {"forces": {"R": [0, 5]}, "friction": {"s": 0.1}}})
