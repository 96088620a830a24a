"""Functions as targets: errors of the output's angle, against simulations and by another formula."""

import numpy as np
import pytest
from command_line import run
from target_studies import study_of

import explore
from explore.synthesis.functions import output_angles, wrapped

METRICS = ["output_error_rms", "output_error_max"]
LENGTHS = {"crank": 30, "coupler": 100, "rocker": 80, "ground": 110}


def errors(design, table):
    frame = explore.evaluate("crank-rocker", design, target={"kind": "function", "table": table}, metrics=METRICS)
    return frame[METRICS].to_numpy()


def test_errors_are_those_of_the_simulated_rocker():
    """Random linkages, both branches, double-cranks too: the rocker's angle of the motion less the function."""
    rng = np.random.default_rng(1)
    turning = 0
    while turning < 40:
        lengths = rng.uniform(20, 120, 4)
        design = dict(zip(LENGTHS, lengths, strict=True)) | {"branch": int(rng.choice([1, -1]))}
        inputs = np.cumsum(rng.uniform(1, 30, 9))
        outputs, start, first = rng.uniform(-300, 300, 9), rng.uniform(-400, 400), rng.uniform(-400, 400)
        try:
            motion = explore.simulate("crank-rocker", design, angles=np.mod(start + inputs, 360))
        except explore.base.errors.MotionError:
            continue
        turning += 1
        missed = np.degrees(wrapped(np.radians(motion["rocker_angle"].to_numpy() - first - outputs)))
        expected = [np.sqrt(np.mean(missed**2)), np.abs(missed).max()]
        found = errors(
            design | {"input_start": start, "output_start": first}, np.column_stack([inputs, outputs]).tolist()
        )
        # roundings of angles up to 700 deg, amplified near the limits of assembly
        assert found[0] == pytest.approx(expected, abs=1e-9)


def test_errors_are_those_of_the_generator_also_where_the_crank_does_not_turn():
    """By the other formula, of a triangle's angle: arcs of random linkages, NaN where one cannot be assembled."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        crank, coupler, rocker = rng.uniform(0.2, 3, 3)
        branch = int(rng.choice([1, -1]))
        inputs = np.cumsum(rng.uniform(1, 30, 7))
        outputs, start, first = rng.uniform(-300, 300, 7), rng.uniform(0, 360), rng.uniform(0, 360)
        own = output_angles(np.array([crank, coupler, rocker]), np.radians(start + inputs), -branch)
        missed = np.degrees(wrapped(own - np.radians(first + outputs)))
        expected = [np.sqrt(np.mean(missed**2)), np.abs(missed).max()]
        design = {"crank": crank, "coupler": coupler, "rocker": rocker, "ground": 1, "branch": branch}
        found = errors(
            design | {"input_start": start, "output_start": first}, np.column_stack([inputs, outputs]).tolist()
        )
        # an arc cosine near 1 has half of the digits
        assert found[0] == pytest.approx(expected, abs=1e-6, nan_ok=True)


def test_a_function_of_the_linkage_itself_has_no_error():
    angles = np.arange(10, 350, 20.0)
    motion = explore.simulate("crank-rocker", LENGTHS, angles=angles)["rocker_angle"].to_numpy()
    table = np.column_stack([angles, motion])
    assert errors(LENGTHS, table.tolist()) == pytest.approx(0.0, abs=1e-12)
    assert errors(LENGTHS, table[::-1].tolist()) == pytest.approx(0.0, abs=1e-12)
    moved = LENGTHS | {"input_start": angles[0], "output_start": motion[0] - 360.0}
    assert errors(moved, (table - table[0]).tolist()) == pytest.approx(0.0, abs=1e-12)


def test_figures_of_a_path_are_refused_in_words(tmp_path):
    explore.sweep(study_of("function"), tmp_path / "f.h5", workers=1)
    for chart, reason in (("path", "no path in [target]"), ("burmester", "no path in [target]")):
        assert reason in run("plot", chart, "f.h5", "-o", "p.png", cwd=tmp_path, code=2).stderr
