"""Arguments of the wrong kind: each public function says which one, and no number is cut off in silence."""

import numpy as np
import pytest
from studies import crank_rockers, swept

import explore

STUDY = (
    crank_rockers((40, 60), (250, 320), 160, 280)
    + """\
[sampling]
method = "sobol"
count = 128
[evaluate]
metrics = ["swing_angle", "transmission_angle_min"]
[constraints]
transmission_angle_min = { min = 20 }
[rank]
metrics = ["swing_angle:max", "transmission_angle_min:max"]
"""
)
LINKS = {"crank": 50.0, "coupler": 300.0, "rocker": 160.0, "ground": 280.0}
results = swept(STUDY, give=lambda results: str(results.path))


WRONG = {
    "whole designs of a refinement": (lambda r: explore.refine(r, "z.h5", evaluations=1e3), "evaluations = 1000.0: "),
    "a seed of a refinement": (lambda r: explore.refine(r, "z.h5", evaluations=200, seed=1.5), "seed = 1.5: must be"),
    "whole designs of indices": (lambda r: explore.sensitivity(r, evaluations=1e4), "evaluations = 10000.0: must be a"),
    "whole parts": (lambda r: explore.tolerance(r, {"crank": 0.1}, 0, draws=1e3), "draws = 1000.0: must be a whole"),
    "a number of parts as text": (lambda r: explore.tolerance(r, {"crank": 0.1}, 0, draws="9"), "draws = '9': must be"),
    "a seed of parts": (lambda r: explore.tolerance(r, {"crank": 0.1}, 0, seed=0.5), "seed = 0.5: must be a whole"),
    "whole fronts": (lambda r: explore.rank(r, fronts=2.0), "fronts = 2.0: must be a whole number"),
    "whole designs nearby": (lambda r: explore.nearest(r, 2.0), "nearest = 2.0: must be a whole number"),
    "a design between two": (lambda r: explore.certify(r, 1.5), "designs: must be whole numbers, got 1.5"),
    "a polished design between two": (lambda r: explore.polish(r, [1.5]), r"must be whole numbers, got \[1.5\]"),
    "a drawn design between two": (lambda r: explore.charts.pareto_chart(r, design=1.5), "whole numbers, got 1.5"),
    "a truth value for a design": (lambda r: explore.charts.motion_chart(r, design=True), "whole numbers, got true"),
    "several drawn designs": (lambda r: explore.charts.map_chart(r, design=[1, 2]), r"whole numbers, got \[\[1, 2\]\]"),
    "rows between two": (lambda r: explore.open_results(r).designs([1.7]), r"whole numbers, got \[1.7\]"),
    "a row beyond 64 bits": (lambda r: explore.open_results(r).design(2**64), "no design 18446744073709551616"),
    "rows beyond 63 bits": (lambda r: explore.certify(r, [1, 2**63]), "has no design 9223372036854775808: they are"),
    "a design by a word": (lambda r: explore.tolerance(r, {"crank": 0.1}, "x"), "must be whole numbers, got 'x'"),
    "a design twice": (lambda r: explore.tolerance(r, {"crank": 0.1}, [3, 0, 3]), "design 3 is named twice; name each"),
    "a certified design twice": (lambda r: explore.certify(r, [0, 0]), "design 0 is named twice"),
    "both senses of a metric": (
        lambda r: explore.rank(r, objectives=["swing_angle", "swing_angle:min"]),
        "swing_angle is an objective in both senses; remove one",
    ),
    "a tolerance of nothing": (lambda r: explore.tolerance(r, 0.1), r"tolerances: must be a dict such as .*, got 0.1"),
    "a file in place of a study": (lambda r: explore.sweep("my.toml", "z.h5"), "study: must be a Study, .*'my.toml'"),
    "whole workers": (
        lambda r: explore.sweep(explore.Study(mechanism="crank-rocker", parameters=LINKS), "z.h5", workers=1.5),
        "workers = 1.5: must be a whole number",
    ),
    "words for angles": (lambda r: explore.simulate("crank-rocker", LINKS, angles="all"), "angles must be a positive"),
    "units of angles": (lambda r: explore.simulate("crank-rocker", LINKS, angles=[0, "9 deg"]), "angles must be a"),
    "a point without a place": (
        lambda r: explore.simulate("crank-rocker", LINKS, points={"M": 40}),
        r"the point M needs along and across, such as \(120, 40\), got 40",
    ),
    "a name of a point": (lambda r: explore.simulate("crank-rocker", LINKS, points="M"), "points: must be a dict"),
    "a place in space": (
        lambda r: explore.export("crank-rocker", "z.svg", parameters=LINKS, points={"M": (1, 2, 3)}),
        "the point M needs along and across",
    ),
    "several designs to export": (
        lambda r: explore.export("crank-rocker", "z.svg", parameters=LINKS | {"crank": [40, 50]}),
        "export takes one design",
    ),
    "a mechanism without a design": (
        lambda r: explore.export("crank-rocker", "z.svg"),
        "a mechanism alone is no design; give its parameters",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_an_argument_of_the_wrong_kind_is_named(results, case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    call, message = WRONG[case]
    with pytest.raises(explore.ExploreError, match=message):
        call(results)
    assert not list(tmp_path.iterdir())


def test_whole_numbers_of_numpy_and_single_names_are_taken(results):
    assert explore.tolerance(results, {"crank": 0.1}, np.int64(3), draws=np.int32(64)).designs.index.tolist() == [3]
    assert list(explore.read_results(results, columns="crank")) == ["crank"]
    tuning = explore.tune(
        "crank-rocker", LINKS, parameter="crank", metric="swing_angle", low=20, high=30, also="time_ratio"
    )
    assert "time_ratio" in tuning.curve


def test_figures_are_found_beside_the_other_names():
    assert callable(explore.charts.pareto_chart)


def test_one_file_is_drawn_as_a_list_of_it_is(results):
    (alone,), (listed,) = (explore.charts.joint_pareto_chart(each).axes for each in (results, [results]))
    assert alone.get_xlabel() == listed.get_xlabel()
    assert len(alone.collections) == len(listed.collections)
