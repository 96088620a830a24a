"""The reference cases of the test rig, in the parameters of the package."""

import json
from pathlib import Path

import pytest

REFERENCE = json.loads((Path(__file__).parent / "reference" / "test_rig.json").read_text())
LINKS = {"crank": "L1", "coupler": "L2", "rocker": "L3", "ground": "L0"}


def lengths(case):
    """Lengths of a reference case, mm."""
    case = case.get("inputs", case)
    return {link: float(case[f"{key}_mm"]) for link, key in LINKS.items()}


def load_of(inputs):
    """The load of a reference case, and its speed."""
    names = {"k": "stiffness", "c": "damping", "J": "inertia"}
    load = {ours: float(inputs[theirs]) for theirs, ours in names.items() if theirs in inputs}
    if "M0" in inputs:
        load[f"{inputs['load_law']}_torque"] = float(inputs["M0"])
    return load | {"speed": float(inputs["omega1_rad_s"])}


def parametrize_cases(cases):
    """Run a test for each of these cases, named by its id."""
    return pytest.mark.parametrize("case", cases, ids=[case["id"] for case in cases])
