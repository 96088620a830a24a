"""The section [points] of a study: mistakes, sweeps over coordinates, tables, reopening, the command line."""

import json
import pickle

import pytest
from command_line import run
from studies import GOOD, crank_rockers

import explore
from explore.figures.charts.mechanism import mechanism_chart

STUDY = (
    crank_rockers([80, 100, 120], 250, 250, 200, speed=[1, 2])
    + """\
[points]
knife = { along = { start = 400, stop = 500, num = 3 }, across = ["0 cm", 30] }
tip = { along = 100, across = -20 }
[evaluate]
window = { from = 90, to = 270 }
metrics = ["knife_x_peak_to_peak", "knife_velocity_max", "tip_curvature_max"]
[metrics]
straightness = { formula = "knife_y_peak_to_peak / knife_x_peak_to_peak", unit = "1" }
[constraints]
straightness = { max = 0.05 }
tip_velocity_max = { max = 500 }
[rank]
metrics = ["straightness:min", "knife_x_peak_to_peak:max"]
"""
)


@pytest.mark.parametrize(
    ("section", "problem"),
    [
        (
            "knife = { along = 1 }",
            "knife: the key 'across' is missing; a complete table is { along = 120, across = 40 }",
        ),
        ("knife = { along = 1, acros = 2 }", "knife.acros: unknown key; did you mean 'across'?"),
        ("knife = 3", "knife: must be a table such as { along = 120, across = 40 }, got 3"),
        (
            "knife = { along = { min = 1, max = 2 }, across = 0 }",
            "knife.along: a range { min, max } needs the sampling",
        ),
        (
            "knife = { along = { solve = 'swing_angle', value = 20 }, across = 0 }",
            "knife.along: cannot be solved for; a",
        ),
        ("crank = { along = 1, across = 0 }", "crank: this is the name of a parameter; choose another"),
        (
            "output = { along = 1, across = 0 }",
            "output: its 'output_velocity' would have the name of another column or signal; choose another name",
        ),
        (
            "a = { along = 1, across = 0 }\na_velocity = { along = 1, across = 0 }",
            "a_velocity: this is the name of a metric or signal of crank-rocker; choose another",
        ),
        ("\n".join(f"p{k} = {{ along = 1, across = 0 }}" for k in range(5)), "5 points are named; at most 4 are poss"),
    ],
)
def test_bad_points(problems, section, problem):
    (line,) = problems(f"{GOOD}[points]\n{section}\n")
    place, _, reason = line.partition(": ")
    assert place == f"study.toml:{7 if problem.startswith('5') else 8 + section.count(chr(10))}"
    assert reason.removeprefix("points.").removeprefix("points: ").startswith(problem)


def test_a_coordinate_is_not_a_parameter(problems):
    text = GOOD + "knife_along = 3\n[points]\nknife = { along = 1, across = 0 }\n"
    assert problems(text) == [
        "study.toml:7: parameters.knife_along: is a coordinate of a point; write it in [points] as along of knife"
    ]


def test_a_name_of_a_point_is_taken(problems):
    text = (
        GOOD + '[points]\nknife = { along = 1, across = 0 }\n[metrics]\nknife_x = { formula = "crank", unit = "mm" }\n'
    )
    (line,) = problems(text)
    assert line.endswith("metrics.knife_x: this is the name of a metric or signal of crank-rocker; choose another")


def test_gears_have_no_floating_link(problems):
    text = explore.studies.config.study_file.starter(explore.mechanisms.registry.MECHANISMS["gears"])
    (line,) = problems(text + "\n[points]\nknife = { along = 1, across = 0 }\n")
    assert line.endswith("points: gears has no floating link, so it has no points to name; leave them out")


def test_an_unknown_signal_of_a_point_has_a_suggestion(problems):
    text = GOOD + '[points]\nknife = { along = 1, across = 0 }\n[evaluate]\nmetrics = ["knife_curvture_max"]\n'
    (line,) = problems(text)
    assert "did you mean 'knife_curvature_max'?" in line


def test_coordinates_are_parameters(load):
    study = load(STUDY)
    assert study.request.mechanism.points == ("knife", "tip")
    assert study.space.n_designs == 3 * 3 * 2 * 2
    designs = study.space.designs(0, study.space.n_designs)
    assert set(designs["knife_across"]) == {0.0, 30.0}
    assert study.space.swept_parameters == ("crank", "knife_along", "knife_across", "speed")
    assert json.loads(study.identity)["points"] == ["knife", "tip"]
    assert "points" not in json.loads(load(GOOD).identity)


def test_a_study_in_python_is_that_of_the_file(load):
    study = load(STUDY)
    parameters = {"crank": [80, 100, 120], "coupler": 250, "rocker": 250, "ground": 200, "speed": [1, 2]}
    made = explore.Study(
        mechanism="crank-rocker",
        parameters=parameters,
        points={
            "knife": {"along": {"start": 400, "stop": 500, "num": 3}, "across": ["0 cm", 30]},
            "tip": {"along": 100, "across": -20},
        },
        window={"from": 90, "to": 270},
        metrics=["knife_x_peak_to_peak", "knife_velocity_max", "tip_curvature_max"],
        formulas={"straightness": {"formula": "knife_y_peak_to_peak / knife_x_peak_to_peak", "unit": "1"}},
        constraints={"straightness": {"max": 0.05}, "tip_velocity_max": {"max": 500}},
        objectives=["straightness:min", "knife_x_peak_to_peak:max"],
    )
    assert made == study
    assert load(made.to_toml()) == study
    assert pickle.loads(pickle.dumps(study.request)).mechanism.points == ("knife", "tip")
    with pytest.raises(explore.ConfigError, match=r"^points\.knife\.across: 'x' is not a number with a unit"):
        explore.Study(mechanism="crank-rocker", parameters=parameters, points={"knife": {"along": 1, "across": "x"}})


def test_a_sweep_of_points_is_stored_and_opened_again(tmp_path, load):
    study = load(STUDY)
    one = explore.sweep(study, "one.h5", workers=1)
    two = explore.sweep(study, "two.h5", workers=2, processes=True)
    first, second = one.to_pandas(), two.to_pandas()
    assert first.equals(second)
    assert one.points == ("knife", "tip")
    assert (first["feasible"] & (first["straightness"] < 0.01)).any()
    ranked = explore.rank("one.h5")
    best = ranked.iloc[0]
    assert best["straightness"] == first.loc[first["feasible"], "straightness"].min()
    own = ["crank", "coupler", "rocker", "ground", "speed", *(f"{p}_{c}" for p in study.request.mechanism.points
                                                              for c in ("along", "across"))]  # fmt: skip
    again = explore.evaluate(
        "crank-rocker", study.space.designs(0, len(first)), points=["knife", "tip"], window={"from": 90, "to": 270},
        metrics=["knife_x_peak_to_peak", "knife_velocity_max", "tip_curvature_max"],
    )  # fmt: skip
    assert set(own) <= {*first, *again}
    for name in ("knife_x_peak_to_peak", "knife_velocity_max", "tip_curvature_max"):
        # the formulas of the study ask for more nodes
        assert again[name].to_numpy() == pytest.approx(first[name].to_numpy(), rel=2e-9)
    for arguments in (
        ("rank", "one.h5"),
        ("show", "one.h5"),
        ("show", "one.h5", "--design", "0"),
        ("simulate", "study.toml", "--design", "3", "-o", "motion.csv"),
        ("plot", "mechanism", "one.h5", "-o", "mechanism.svg"),
        ("plot", "motion", "one.h5", "-o", "motion.svg"),
        ("report", "one.h5", "-o", "report.html"),
        ("verify", "one.h5"),
        ("sweep", "study.toml", "-o", "front.h5", "--keep", "front"),
        ("plot", "mechanism", "front.h5", "-o", "front.svg"),
    ):
        run(*arguments, cwd=tmp_path)
    assert explore.open_results("front.h5").points == ("knife", "tip")
    assert "knife_acceleration" in (tmp_path / "motion.csv").read_text().splitlines()[0]
    page = (tmp_path / "report.html").read_text()
    assert '"path of knife"' in page
    assert "path of the middle" not in page
    (panel,) = mechanism_chart("one.h5", design=0).axes
    lines = {line.get_linestyle() for line in panel.lines if line.get_label() in ("path of knife", "path of tip")}
    assert len(lines) == 2, "paths of points look alike"


def test_a_table_has_coordinates_as_columns(load, tmp_path):
    rows = ["crank,coupler,rocker,ground,knife_along,knife_across", "100,250,250,200,500,0", "100,250,250,200,480,5 cm"]
    (tmp_path / "designs.csv").write_text("\n".join(rows))
    text = """mechanism = "crank-rocker"
[sampling]
method = "table"
file = "designs.csv"
[points]
knife = {}
[evaluate]
metrics = ["knife_x_max"]
"""
    study = load(text)
    assert list(study.space.designs(0, 2)["knife_across"]) == [0.0, 50.0]
    with pytest.raises(explore.ConfigError, match="knife_across"):
        load(text.replace("{}", "{ across = 7 }"))


def test_the_command_line_simulates_points(tmp_path):
    lengths = [word for name, value in (("crank", 100), ("coupler", 250), ("rocker", 250), ("ground", 200))
               for word in ("--set", f"{name}={value}")]  # fmt: skip
    base = ("simulate", "--mechanism", "crank-rocker", *lengths, "--angles", "4")
    output = run(*base, "--point", "knife=500,0", "--point", "tip=1 cm,-2 cm", "--json", cwd=tmp_path)
    columns = json.loads(output.stdout)
    expected = explore.simulate(
        "crank-rocker", {"crank": 100, "coupler": 250, "rocker": 250, "ground": 200},
        points={"knife": (500, 0), "tip": ("1 cm", "-2 cm")}, angles=4,
    )  # fmt: skip
    assert columns["tip_curvature"] == expected["tip_curvature"].tolist()
    for point, words in (
        ("knife", "--point knife: write NAME=ALONG,ACROSS, such as knife=120,40"),
        ("knife=1", "--point knife=1: write NAME=ALONG,ACROSS, such as knife=120,40"),
        ("crank=1,2", "the point 'crank': this is the name of a parameter; choose another"),
    ):
        assert words in run(*base, "--point", point, cwd=tmp_path, code=2).stderr
    assert (
        "points have only the closed form"
        in run(*base, "--point", "knife=1,2", "--method", "newton", cwd=tmp_path, code=2).stderr
    )


def test_python_says_what_is_wrong_with_points():
    design = {"crank": 100, "coupler": 250, "rocker": 250, "ground": 200}
    with pytest.raises(explore.RequestError, match="needs knife_along, knife_across"):
        explore.evaluate("crank-rocker", design, points=["knife"], metrics=["knife_x_max"])
    with pytest.raises(explore.RequestError, match="5 points are named; at most 4 are possible"):
        explore.evaluate("crank-rocker", design, points=list("abcde"))
    with pytest.raises(explore.RequestError, match="points: must be a list of names, .* got {'a': \\[1, 2\\]}$"):
        explore.evaluate("crank-rocker", design, points={"a": [1, 2]})
    with pytest.raises(explore.RequestError, match="the point 'a': two points have this name"):
        explore.evaluate("crank-rocker", design, points=["a", "a"])
    with pytest.raises(explore.RequestError, match="the point knife needs along and across"):
        explore.simulate("crank-rocker", design, points={"knife": (1, 2, 3)})
    with pytest.raises(explore.RequestError, match="has no floating link"):
        explore.simulate("gears", {}, points={"knife": (1, 2)})


def test_the_list_of_a_mechanism_says_that_points_exist(tmp_path):
    shown = run("mechanisms", "slider-crank", cwd=tmp_path).stdout
    assert "points of the rod, up to 4: [points] NAME = { along = 120, across = 40 } in a study" in shown
    assert "NAME_acceleration, NAME_curvature" in shown
    described = json.loads(run("mechanisms", "crank-rocker", "--json", cwd=tmp_path).stdout)["points"]
    assert described["signals"]["knife_curvature"]["unit"] == "1/mm"
    assert json.loads(run("mechanisms", "gears", "--json", cwd=tmp_path).stdout)["points"] is None
