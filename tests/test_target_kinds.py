"""What all kinds of targets share: they travel with their study, and mistakes in them are told in a line."""

import json
import pickle

import numpy as np
import pytest
from command_line import run
from target_studies import POSES, SQUARE, TABLE, study_of

import explore
from explore.base.errors import ConfigError, RequestError
from explore.model.targets import target_from_content
from explore.studies.request.names import find_mechanism

#: Of each kind the objectives, the error that comes back, the unit of that, and figures.
KINDS = {
    "path": (["path_error_rms:min", "transmission_angle_min:max"], "path_error_rms", "mm", ("path", "cognates")),
    "poses": (
        ["position_error_max:min", "angle_error_max:min", "transmission_angle_min:max"], "pose_error_rms", "mm",
        ("path", "cognates"),
    ),
    "function": (["output_error_max:min", "transmission_angle_min:max"], "output_error_rms", "deg", ()),
    "dwell": (["dwell_error:min", "swing_angle:max", "transmission_angle_min:max"], "dwell_error", "deg", ()),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_a_target_travels(kind, tmp_path):
    """To workers, into results, into a refinement, a tolerance, figures, a report, and out again as a study."""
    own, (objectives, error, unit, figures) = study_of(kind), KINDS[kind]
    assert pickle.loads(pickle.dumps(own)).request.mechanism.target == own.request.mechanism.target
    assert [f"{o.metric}:{o.sense}" for o in own.objectives] == objectives
    results = explore.sweep(own, tmp_path / "t.h5", workers=1)
    assert results.target == own.request.mechanism.target
    assert results.units[error] == unit
    best = explore.rank(results, objectives=[error]).iloc[0]
    given = {column.name: best[column.name] for column in results.columns if column.role == "parameter"}
    points = {"points": ["M"]} if "M_along" in given else {}
    again = explore.evaluate("crank-rocker", given, target=results.target, metrics=[error], **points)
    assert again[error][0] == best[error]
    refined = explore.refine(results, tmp_path / "refined.h5", evaluations=4096)
    assert explore.rank(refined, objectives=[error])[error].min() < best[error]
    explore.export(results, tmp_path / "best.toml", design=int(best.name))
    exported = explore.load_study(tmp_path / "best.toml")
    assert exported.request.mechanism.target == results.target
    assert explore.sweep(exported, tmp_path / "once.h5", workers=1).design(0)[error] == best[error]
    design = ("--design", str(best.name))
    run("tolerance", "t.h5", *design, "--tolerance", "crank=0.1", "--draws", "256", cwd=tmp_path)
    run("report", "t.h5", "-o", "t.html", cwd=tmp_path)
    assert objectives[0].partition(":")[0] in (tmp_path / "t.html").read_text(encoding="utf-8")
    for chart in ("mechanism", "motion", *figures):
        run("plot", chart, "t.h5", *design, "-o", f"{chart}.png", cwd=tmp_path)
    run("plot", "pareto", "t.h5", "-o", "pareto.png", cwd=tmp_path)
    run("export", "t.h5", *design, "-o", "t.dxf", "-o", "t.csv", cwd=tmp_path)


WRONG = {
    "path": [
        ({"points": SQUARE[:2]}, "2 points; give 3 or more"),
        ({"points": [[1, 2]] * 5}, "all points are the same place"),
        ({"points": [[k, k * k] for k in range(1000)]}, "at most 500 are possible"),
        ({"points": SQUARE, "weights": [np.inf, 1, 1, 1]}, "weights.0: inf is not a finite number"),
        ({"points": SQUARE, "angles_from": "frame"},
         "target.angles_from: has no effect without crank_angles; remove it"),
        ({}, "the key 'points' is missing"),
        ({"kind": "paths", "points": SQUARE}, "did you mean 'path'"),
    ],
    "poses": [
        ({}, "the key 'poses' is missing"),
        ({"poses": 3}, "must be a list of poses"),
        ({"poses": POSES[:1]}, "1 pose; give 2 or more"),
        ({"poses": [[0, 0, 0]] * 10**6}, "1,000,000 poses; at most 500 are possible"),
        ({"poses": [*POSES, [1, 2]]}, r"poses.6: pose 7 must be \[x, y, angle\], got \[1, 2\]"),
        ({"poses": [*POSES, [1, 2, float("inf")]]}, "poses.6: pose 7: .*finite"),
        ({"poses": [*POSES, [1, 2, "3 mm"]]}, "poses.6: pose 7: 'mm' cannot be converted to 'deg'"),
        ({"poses": [[1, 2, 3], [1, 2, 9]]}, "all poses have the same place; give the length"),
        ({"poses": POSES, "lever": -1}, "target.lever: must be above 0, got -1"),
        ({"poses": POSES, "lever": "long"}, "target.lever: "),
        ({"poses": POSES, "order": "some"}, "target.order: must be \"given\" or \"any\", got 'some'"),
        ({"poses": POSES, "points": []}, "target.points: unknown key"),
        ({"poses": POSES, "point": "N"}, "unknown point 'N'"),
    ],
    "function": [
        ({}, "the key 'table' is missing"),
        ({"table": 3}, "must be a list of pairs"),
        ({"table": TABLE[:2]}, "2 pairs; give 3 or more"),
        ({"table": [[0, 0]] * 10**6}, "1,000,000 pairs; at most 500 are possible"),
        ({"table": [[0, 0], [1, 1], [2]]}, r"table.2: pair 3 must be \[input, output\], got \[2\]"),
        ({"table": [[0, 0], [1, float("nan")], [2, 3]]}, r"table.1: pair 2: .*finite"),
        ({"table": [[0, 0], [1, "3 mm"], [2, 3]]}, "table.1: pair 2: 'mm' cannot be converted"),
        ({"table": [[0, 0], [1, 1], [1, 3]]}, "must ascend, or descend"),
        ({"table": TABLE, "tabel": 3}, "unknown key; did you mean 'table'"),
        ({"kind": 7}, "available: path, function"),
    ],
    "dwell": [
        ({}, "target: write an angle or a travel"),
        ({"angle": 60, "travel": 1}, "'angle' and 'travel' are given; leave out one of the two"),
        ({"angle": 0}, "target.angle: must be between 0 and 360 deg, got 0"),
        ({"angle": 360}, "target.angle: must be between 0 and 360 deg, got 360"),
        ({"angle": float("nan")}, "target.angle: .*finite"),
        ({"angle": "60 mm"}, "target.angle: 'mm' cannot be converted"),
        ({"angle": [60]}, r"target.angle: \[60\] is not a number or a string with a unit"),
        ({"travel": -1}, "target.travel: must be above 0, got -1"),
        ({"travel": "1 mm"}, "target.travel: 'mm' cannot be converted"),
        ({"angel": 60}, "did you mean 'angle'"),
    ],
}  # fmt: skip
ENTRIES = [({"kind": kind} | entries, reason) for kind, cases in WRONG.items() for entries, reason in cases]


@pytest.mark.parametrize(("target", "reason"), [*ENTRIES, ({"points": SQUARE}, 'kind = "path"'), (7, "be a table")])
def test_a_bad_target_is_one_clear_line(target, reason):
    with pytest.raises(RequestError, match=reason) as caught:
        find_mechanism("crank-rocker", ("M",), target)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("entries", "problem"),
    [
        ('kind = "dwell"\nangle = -1\n', "7: target.angle: must be between 0 and 360 deg, got -1"),
        ('kind = "function"\ntable = [[0, 0], [1, 1], [2, 2]]\n', "6: target.kind: .* unknown; available: path"),
    ],
)
def test_mistakes_have_their_line(tmp_path, entries, problem):
    file = tmp_path / "bad.toml"
    file.write_text(f'mechanism = "slider-crank"\n[parameters]\ncrank = 1\nrod = 3\n[target]\n{entries}')
    with pytest.raises(ConfigError, match=f"bad.toml:{problem}"):
        explore.load_study(file)


@pytest.mark.parametrize(
    "content",
    [
        {"kind": "paths"}, {"kind": ["path"]}, [1], {"kind": "path", "point": "M"}, {"kind": "dwell"},
        *({"kind": "dwell", **wrong} for wrong in (
            {"angle": 0}, {"angle": 360}, {"angle": 1, "travel": 1}, {"travel": "x"}, {"travel": [1]}
        )),
    ],
)  # fmt: skip
def test_a_damaged_record_of_a_target_is_refused(content):
    with pytest.raises(ValueError, match="dwell|target|convert"):
        target_from_content(content)


def test_mechanisms_say_which_targets_they_meet(tmp_path):
    printed = run("mechanisms", "crank-rocker", cwd=tmp_path).stdout
    described = json.loads(run("mechanisms", "crank-rocker", "--json", cwd=tmp_path).stdout)["targets"]
    for kind, doer, metrics in (
        ("path", "a point", {"path_error_rms": "min"}),
        ("poses", "the link with a point", {"position_error_max": "min"}),
        ("function", "the output", {"output_error_max": "min"}),
        ("dwell", "the output", {"dwell_error": "min", "dwell_start": None, "dwell_angle": "max"}),
    ):
        assert f'{doer} can have a target, [target] kind = "{kind}" in a study' in printed
        assert {name: described[kind][name]["sense"] for name in metrics} == metrics
    assert set(json.loads(run("mechanisms", "slider-crank", "--json", cwd=tmp_path).stdout)["targets"]) > {"path"}
    assert json.loads(run("mechanisms", "gears", "--json", cwd=tmp_path).stdout)["targets"] == {}
