"""Friction in slots: the built-in slider-crank, the torque by balances and by power, where it locks, and its bounds."""

import numpy as np
import pytest
from linkage_cases import CASES, values_of, with_loads

import explore
from explore.base.errors import ConfigError
from explore.model.status import Status

SLIDER, SHAPER = CASES["slider-crank"], CASES["crank-shaper"]
#: Loads of the slider-crank as a table, with the names of the built-in parameters.
LOADS = {
    "gravity": [0, "-gravity"],
    "masses": {
        "crank": {"mass": "crank_mass", "centroid": ["r / 2", 0]},
        "rod": {"mass": "rod_mass", "centroid": ["0.3 * l", 0], "inertia": "rod_inertia"},
        "B": "mass",
    },
    "forces": {"B": ["constant_force", 0]},
    "opposing": {"guide": "opposing_force"},
    "friction": {"guide": "friction"},
    "dampers": {"oil": {"between": "guide", "rate": "damping"}},
}
AMOUNTS = {
    "gravity": 9.81, "crank_mass": 0.4, "rod_mass": 0.7, "rod_inertia": 8e-4, "mass": 1.3, "constant_force": -25.0,
    "opposing_force": 12.0, "friction": 0.15, "damping": 6.0, "speed": 11.0,
}  # fmt: skip
#: Signals of the built-in mechanism by those of the table.
SAME = {
    "drive_torque": "drive_torque", "drive_power": "drive_power", "friction_power": "friction_power",
    "guide_normal_force": "guide_force", "O_force_on_frame": "crank_pivot_force", "A_force_on_rod": "crank_pin_force",
    "B_force_on_rod": "slider_pin_force",
}  # fmt: skip


def built_in(values, **changes):
    """The built-in design of the same slider-crank."""
    lengths = {"crank": values["r"], "rod": values["l"], "offset": values["e"]}
    return lengths | AMOUNTS | {"crank_centroid": 0.5, "rod_centroid": 0.3} | changes


@pytest.mark.parametrize("change", [{}, {"friction": 0.7}, {"speed": 60.0}, {"constant_force": 400.0}])
def test_the_slider_crank_is_the_built_in_one(change):
    """Torque, powers and forces at single angles and over the turn, with corners where the guide is left."""
    linkage = with_loads(SLIDER, LOADS)
    values, design = values_of(SLIDER) | AMOUNTS | change, built_in(values_of(SLIDER), **change)
    angles = (np.arange(0.0, 360.0, 5.0) + 0.3).tolist()
    own, other = (
        explore.simulate(linkage, values, angles=angles),
        explore.simulate("slider-crank", design, angles=angles),
    )
    for name, same in SAME.items():
        if not name.startswith("B_"):  # the table has the mass of the slider on the pin
            expected = other[same].to_numpy()
            assert own[name].to_numpy() == pytest.approx(expected, abs=2e-13 * np.abs(expected).max()), name
    metrics = [name for name in SAME if name != "B_force_on_rod"]
    row = explore.evaluate(
        linkage, values, metrics=[f"{name}_{'max' if 'force_on' in name else 'rms'}" for name in metrics],
        window="cycle", tolerance=1e-9,
    ).iloc[0]  # fmt: skip
    expected = explore.evaluate(
        "slider-crank", design, metrics=[f"{SAME[name]}_{'max' if 'force_on' in name else 'rms'}" for name in metrics],
        window="cycle", tolerance=1e-9,
    ).iloc[0]  # fmt: skip
    assert row["status"] == expected["status"] == Status.OK
    for name in metrics:
        statistic = "max" if "force_on" in name else "rms"
        assert row[f"{name}_{statistic}"] == pytest.approx(expected[f"{SAME[name]}_{statistic}"], rel=3e-9), name


def test_friction_that_locks_has_no_force():
    """Both mechanisms; the ratio tells how near it is, 1 - e-6 and a region of 0.01 deg included."""
    values = values_of(SLIDER) | AMOUNTS
    plain = values | {"friction": 1e-3}
    ratio = "guide_lock_ratio"
    linkage = with_loads(SLIDER, LOADS)
    row = explore.evaluate(linkage, plain, metrics=[f"{ratio}_min", f"{ratio}_max"], window="cycle").iloc[0]
    limit = 1e-3 / max(-row[f"{ratio}_min"], row[f"{ratio}_max"])
    sine = (values["r"] + values["e"]) / values["l"]
    assert limit == pytest.approx(np.sqrt(1.0 - sine**2) / sine, rel=1e-9)
    for share, is_locked in ((1.0 - 1e-3, False), (1.0 + 1e-7, True), (1.2, True)):
        row = explore.evaluate(
            linkage, values | {"friction": share * limit}, metrics=["drive_torque_max"], window="cycle", tolerance=1e-6
        ).iloc[0]  # fmt: skip
        assert (row["status"] == Status.NOT_FINITE) == is_locked, share


@pytest.mark.parametrize(
    ("friction", "problem"),
    [
        ({"rim": 0.1}, "rim: unknown slot, slide or pin 'rim'; did you mean 'ram'?"),
        ({"ram": -0.1}, "ram: must not be negative, got -0.1"),
    ],
)
def test_friction_with_mistakes_is_refused(friction, problem):
    with pytest.raises(ConfigError, match=f"^linkage.loads.friction.{problem.replace('?', '.')}$"):
        with_loads(SHAPER, {"forces": {"S": [1, 2]}, "friction": friction})
