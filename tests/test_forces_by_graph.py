"""Forces of the kernels that are written by hand, against those of the same linkage as a table, angle by angle."""

import math

import numpy as np
import pytest
from linkage_cases import CASES, FOUR_BAR, with_loads
from test_linkage_friction import LOADS

import explore
from explore import Linkage

ANGLES = (np.arange(0.0, 360.0, 7.5) + 0.37).tolist()
COIL = {"springs": {"coil": {"between": "guide", "rate": "stiffness", "rest": "middle"}}}
LOADED_FOUR_BAR = FOUR_BAR | {
    "loads": {
        "gravity": [0, "-gravity"],
        "masses": {
            "crank": {"mass": "crank_mass", "centroid": ["crank_centroid * r1", 0]},
            "coupler": {"mass": "coupler_mass", "centroid": ["coupler_centroid * r2", 0], "inertia": "coupler_inertia"},
            "rocker": {"mass": "rocker_mass", "centroid": ["rocker_centroid * r3", 0], "inertia": "own_inertia"},
        },
        "torques": {"rocker": "constant_torque"},
        "opposing": {"rocker": "opposing_torque"},
        "springs": {"coil": {"between": "rocker", "rate": "stiffness", "rest": "middle"}},
        "dampers": {"oil": {"between": "rocker", "rate": "damping"}},
    },
    "parameters": {"own_inertia": {"unit": "kg m^2"}},
}
#: Signals of the hand-written kernels by those of the tables; the mass of the slider is on the pin of its table.
SLIDER_FORCES = {
    "drive_torque": "drive_torque", "friction_power": "friction_power", "guide_normal_force": "guide_force",
    "O_force_on_frame": "crank_pivot_force", "A_force_on_rod": "crank_pin_force",
}  # fmt: skip
FOUR_BAR_FORCES = {
    "drive_torque": "drive_torque", "friction_power": "friction_power", "O_force_on_frame": "pin_force_a",
    "A_force_on_coupler": "pin_force_b", "B_force_on_coupler": "pin_force_c", "C_force_on_frame": "pin_force_d",
}  # fmt: skip


def slider_cranks(rng, gap):
    """A slider-crank under all loads, whose rod exceeds its least length by a share of it."""
    crank, offset = rng.uniform(20.0, 60.0), rng.uniform(-30.0, 30.0)
    rod = (crank + abs(offset)) * (1.0 + gap)
    loads = {
        "constant_force": rng.normal(0.0, 100.0), "opposing_force": 40.0, "stiffness": 500.0, "damping": 8.0,
        "mass": 2.0, "friction": min(0.15, 0.5 * math.sqrt(gap)), "gravity": 9.8, "crank_mass": 0.5,
        "rod_mass": 0.8, "rod_inertia": 2e-3, "speed": rng.uniform(3.0, 30.0),
    }  # fmt: skip
    outer, inner = (math.sqrt((rod + sign * crank) ** 2 - offset**2) for sign in (1.0, -1.0))
    middle = 0.5 * (outer + inner)
    hand = {"crank": crank, "rod": rod, "offset": offset, "crank_centroid": 0.5, "rod_centroid": 0.3} | loads
    return hand, {"r": crank, "l": rod, "e": offset, "middle": middle} | loads


def crank_rockers(rng, gap):
    """A crank-rocker under all loads, whose longest link is shorter than it may be by a share of the ground."""
    crank, rocker, ground = rng.uniform(30.0, 60.0), rng.uniform(100.0, 200.0), rng.uniform(150.0, 250.0)
    coupler = ground + rocker - crank - gap * ground
    loads = {
        "constant_torque": rng.normal(0.0, 20.0), "opposing_torque": 10.0, "stiffness": 40.0, "damping": 0.3,
        "gravity": 9.8, "crank_mass": 1.0, "coupler_mass": 2.0, "rocker_mass": 1.5, "crank_centroid": -0.2,
        "coupler_centroid": 0.3, "rocker_centroid": 0.6, "coupler_inertia": 0.01, "speed": rng.uniform(3.0, 30.0),
    }  # fmt: skip
    arm = 1e-3 * loads["rocker_centroid"] * rocker
    lines = [coupler + crank, coupler - crank]
    ends = [math.pi - math.acos((ground**2 + rocker**2 - d * d) / (2.0 * ground * rocker)) for d in lines]
    hand = {"crank": crank, "coupler": coupler, "rocker": rocker, "ground": ground, "inertia": 0.02} | loads
    hand["rocker_inertia"] = 0.03 + loads["rocker_mass"] * arm * arm
    table = {"r1": crank, "r2": coupler, "r3": rocker, "r4": ground, "own_inertia": 0.05} | loads
    return hand, table | {"middle": math.degrees(0.5 * sum(ends))}


MECHANISMS = {
    "slider-crank": (with_loads(CASES["slider-crank"], LOADS | COIL), SLIDER_FORCES, slider_cranks),
    "crank-rocker": (Linkage(LOADED_FOUR_BAR), FOUR_BAR_FORCES, crank_rockers),
}


@pytest.mark.parametrize("gap", [0.5, 1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("mechanism", MECHANISMS)
def test_the_graph_has_the_same_forces(mechanism, gap):
    """To some units in the last place of the peak; beside a change point sums of the hand-written ones are exact."""
    linkage, signals, draw = MECHANISMS[mechanism]
    rng = np.random.default_rng(6)
    tolerance = 3e-15 + (1e-15 / gap if mechanism == "slider-crank" else 1e-15 / math.sqrt(gap))
    for _ in range(12):
        hand, table = draw(rng, gap)
        motion = explore.simulate(mechanism, hand, angles=ANGLES)
        other = explore.simulate(linkage, table, angles=ANGLES)
        for name, same in signals.items():
            expected = other[name].to_numpy()
            assert motion[same].to_numpy() == pytest.approx(expected, abs=tolerance * np.abs(expected).max()), name
