"""Each mechanism's functions in the page, translated from Python, against `explore.simulate`."""

import numpy as np
import pytest

import explore
from browser.chromium import silent_page
from browser.conftest import report_of
from explore.mechanisms.registry import MECHANISMS
from explore.studies.config.study_file import load_study, starter
from explore.testing.contract import draw_designs

COUNT = 48
ANGLES = np.concatenate([np.arange(0.0, 360.0, 15.0), [1e-7, 89.9999999, 179.9999999, 180.0000001, 725.0, -33.3]])
MOTIONS = """([designs, angles]) => designs.map(values => {
    const motion = exploreReport.motionOf(exploreReport.page.model.study.motion, values, "none");
    return motion && {signals: angles.map(angle => motion.at(angle)), marks: motion.marks};
})"""
#: Loads of four-bars, so that every part of their functions is compared.
LOADS = {
    "constant_torque": -20e3, "opposing_torque": 5e3, "stiffness": 143e3, "damping": 100.0, "inertia": 8.0,
    "crank_mass": 40.0, "coupler_mass": 25.0, "rocker_mass": 60.0, "coupler_inertia": 2.0, "rocker_inertia": 5.0,
}  # fmt: skip


@pytest.mark.parametrize("name", MECHANISMS)
def test_the_translated_functions_agree_with_simulate(browser, tmp_path, name):
    mechanism = MECHANISMS[name]
    study = tmp_path / f"{name}.toml"
    text, names = starter(mechanism), {p.name for p in mechanism.parameters}
    given = [f"{load} = {value}\n" for load, value in LOADS.items() if load in names and f"\n{load} " not in text]
    study.write_text(text.replace("[parameters]\n", f"[parameters]\n{''.join(given)}"), encoding="utf-8")
    drawn = draw_designs(load_study(study), COUNT, 1)
    drawn = {p.name: drawn.get(p.name, np.full(COUNT, p.default)) for p in mechanism.parameters}
    drawn |= {load: np.full(COUNT, value) for load, value in LOADS.items() if load in drawn}
    designs = [{key: float(column[k]) for key, column in drawn.items()} for k in range(COUNT)]
    results = explore.sweep(load_study(study), tmp_path / f"{name}.h5")
    with silent_page(browser, report_of(results.path)) as page:
        motions = page.evaluate(MOTIONS, [designs, list(map(float, ANGLES))])
    assert sum(motion is not None for motion in motions) >= 8
    for design, motion in zip(designs, motions, strict=True):
        try:
            exact, turn = explore.simulate(name, design, angles=ANGLES), explore.simulate(name, design, angles=720)
        except explore.MotionError:
            assert motion is None
            continue
        for signal in exact:
            values = np.array([state[signal] for state in motion["signals"]])
            difference, scale = values - exact[signal].to_numpy(), np.abs(turn[signal]).max()
            if mechanism.signal(signal).unit == "deg":
                difference, scale = np.remainder(difference + 180.0, 360.0) - 180.0, 1.0
            # Of the largest value in a turn. Both use the same formulas; sine, arctangent and the order of operations
            # differ, and signals that are small differences lose digits.
            assert np.abs(difference).max() <= 1e-9 * scale + 1e-300, (signal, design)
