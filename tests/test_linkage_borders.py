"""Whether cranks turn, of random designs and of those beside the border, against interval arithmetic."""

import numpy as np
import pytest
from intervals import turns_for_certain
from linkage_cases import CASES, FOUR_BAR, columns, find_limits, linkage_of, scattered, trace

from explore import Linkage

LENGTHS = {"r1": 30.0, "r2": 90.0, "r3": 70.0, "r4": 100.0}
#: Share by which parameters are scattered, and designs of the long form.
LINKAGES = {"four-bar": (0.4, 10_000), "slider-crank": (0.6, 10_000), "watt-2": (0.3, 10_000),
            "crank-shaper": (0.4, 10_000), "stephenson-3": (0.2, 6_000), "jansen": (0.12, 4_000)}  # fmt: skip


def beside_the_border(kernel, designs, count, rng):
    """Designs at 1e-11 to 0.03 of the way from where a crank begins to turn, on both sides of it."""
    between, last = find_limits(kernel, designs, count, rng)
    return between(last + rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-11.0, -1.5, count))


def labels_of(kernel, designs):
    """Statuses without the names of joints."""
    words = {code: label.split("_at_")[0] for code, label in kernel.status_labels.items()}
    return np.array([words[code] for code in kernel.evaluate_closed_form(columns(kernel, designs)).status])


def _forms():
    for name, (_, count) in LINKAGES.items():
        if name in ("slider-crank", "watt-2"):
            yield pytest.param(name, 200, id=f"{name}-short")
        yield pytest.param(name, count, id=name, marks=pytest.mark.slow)


@pytest.mark.parametrize(("name", "count"), list(_forms()))
def test_no_status_contradicts_interval_arithmetic(name, count):
    """50,000 designs in the long form, half of them beside the border, none wrong."""
    rng, share = np.random.default_rng(11), LINKAGES[name][0]
    if name == "four-bar":
        linkage = Linkage(FOUR_BAR)
        random = {p: r * (1.0 + share * rng.uniform(-1.0, 1.0, count // 2)) for p, r in LENGTHS.items()}
    else:
        linkage, random = linkage_of(CASES[name]), scattered(CASES[name], count // 2, rng, share)
    kernel = linkage.mechanism.for_signals(())
    labels = labels_of(kernel, random)
    assert 0.02 < np.mean(labels == "ok") < 0.98
    beside = beside_the_border(kernel, random, count - count // 2, rng)
    designs = {name: np.concatenate([random[name], beside[name]]) for name in random}
    labels, certain = labels_of(kernel, designs), turns_for_certain(trace(linkage), designs)
    assert np.mean(certain != 0) > 0.97
    wrong = ((labels == "ok") & (certain < 0)) | (np.isin(labels, ["crank_blocked", "cannot_assemble"]) & (certain > 0))
    assert not wrong.any(), {key: column[wrong][:3] for key, column in designs.items()}
    # What is not told either way is a small part, beside the border.
    assert np.mean(~np.isin(labels, ["ok", "crank_blocked", "cannot_assemble"])) < 0.2
    assert not np.isin(labels[: count // 2], ["turn_not_decided"]).any()
