"""Functions as targets: errors of the output's angle, and what is said of bad ones."""

import json
import pickle

import numpy as np
import pytest
from command_line import run

import explore
from explore.base.errors import ConfigError, RequestError
from explore.studies.request.names import find_mechanism
from explore.synthesis.functions import output_angles, wrapped

METRICS = ["output_error_rms", "output_error_max"]
TABLE = [[0, 0], [20, 41], [40, 70], [60, 90]]
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


def study(**changes):
    arguments = {
        "mechanism": "crank-rocker",
        "target": {"kind": "function", "table": TABLE},
        "parameters": {
            "crank": {"min": 20, "max": 90}, "coupler": {"min": 20, "max": 150}, "rocker": {"min": 20, "max": 120},
            "ground": 100, "branch": [1, -1], "input_start": {"min": 0, "max": 360},
            "output_start": {"min": -180, "max": 180},
        },
        "sampling": {"method": "sobol", "count": 1024, "seed": 1},
        "constraints": {"transmission_angle_min": {"min": 20}},
    }  # fmt: skip
    return explore.Study(**arguments | changes)


def test_a_function_travels(tmp_path):
    """To workers, into results, into a refinement, a tolerance, a report, and out again as a study."""
    own = study()
    assert pickle.loads(pickle.dumps(own)).request.mechanism.target == own.request.mechanism.target
    assert [f"{o.metric}:{o.sense}" for o in own.objectives] == ["output_error_max:min", "transmission_angle_min:max"]
    results = explore.sweep(own, tmp_path / "f.h5", workers=1)
    assert results.target == own.request.mechanism.target
    assert results.units["output_error_rms"] == "deg"
    best = explore.rank(results).iloc[0]
    refined = explore.refine(results, tmp_path / "g.h5", evaluations=2048)
    assert explore.rank(refined)["output_error_max"].min() < best["output_error_max"]
    explore.export(results, tmp_path / "best.toml", design=int(best.name))
    once = explore.sweep(explore.load_study(tmp_path / "best.toml"), tmp_path / "once.h5", workers=1)
    assert once.design(0)["output_error_rms"] == best["output_error_rms"]
    tolerances = ("--tolerance", "crank=0.1", "--tolerance", "input_start=0.5")
    run("tolerance", "f.h5", "--design", str(best.name), *tolerances, "--draws", "256", cwd=tmp_path)
    run("report", "f.h5", "-o", "f.html", cwd=tmp_path)
    assert "output_error_max" in (tmp_path / "f.html").read_text(encoding="utf-8")
    for chart in ("mechanism", "motion", "pareto"):
        run("plot", chart, "f.h5", "-o", f"{chart}.png", cwd=tmp_path)


def test_figures_of_a_path_are_refused_in_words(tmp_path):
    explore.sweep(study(), tmp_path / "f.h5", workers=1)
    for chart, reason in (("path", "no path in [target]"), ("burmester", "no path in [target]")):
        assert reason in run("plot", chart, "f.h5", "-o", "p.png", cwd=tmp_path, code=2).stderr


@pytest.mark.parametrize(
    ("target", "reason"),
    [
        ({"kind": "function"}, "the key 'table' is missing"),
        ({"kind": "function", "table": 3}, "must be a list of pairs"),
        ({"kind": "function", "table": TABLE[:2]}, "2 pairs; give 3 or more"),
        ({"kind": "function", "table": [[0, 0]] * 10**6}, "1,000,000 pairs; at most 500 are possible"),
        ({"kind": "function", "table": [[0, 0], [1, 1], [2]]}, r"table.2: pair 3 must be \[input, output\], got \[2\]"),
        ({"kind": "function", "table": [[0, 0], [1, float("nan")], [2, 3]]}, r"table.1: pair 2: .*finite"),
        ({"kind": "function", "table": [[0, 0], [1, "3 mm"], [2, 3]]}, "table.1: pair 2: 'mm' cannot be converted"),
        ({"kind": "function", "table": [[0, 0], [1, 1], [1, 3]]}, "must ascend, or descend"),
        ({"kind": "function", "table": TABLE, "tabel": 3}, "unknown key; did you mean 'table'"),
        ({"kind": "function", "table": TABLE, "points": []}, "target.points: unknown key"),
        ({"kind": "functions", "table": TABLE}, "did you mean 'function'"),
        ({"kind": 7}, "available: path, function"),
    ],
)  # fmt: skip
def test_a_bad_function_is_one_clear_line(target, reason):
    with pytest.raises(RequestError, match=reason) as caught:
        find_mechanism("crank-rocker", (), target)
    assert len(str(caught.value).splitlines()) == 1


def test_mistakes_have_their_line(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text(
        'mechanism = "slider-crank"\n[parameters]\ncrank = 1\nrod = 3\n[target]\nkind = "function"\n'
        "table = [[0, 0], [1, 1], [2, 2]]\n"
    )
    with pytest.raises(ConfigError, match=r"bad.toml:6: target.kind: .* unknown; available: path"):
        explore.load_study(file)


def test_mechanisms_say_that_their_output_can_follow_a_function(tmp_path):
    printed = run("mechanisms", "crank-rocker", cwd=tmp_path).stdout
    assert 'the output can have a target, [target] kind = "function" in a study' in printed
    described = json.loads(run("mechanisms", "crank-rocker", "--json", cwd=tmp_path).stdout)
    assert described["targets"]["function"]["output_error_max"]["sense"] == "min"
