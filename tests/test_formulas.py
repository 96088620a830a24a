"""Metrics of the user's own: mistakes in their formulas, their columns, and where their values go."""

import json
import pickle

import numpy as np
import pandas as pd
import pytest
from command_line import call, succeed
from hypothesis import given, settings
from hypothesis import strategies as st
from studies import FEW, GOOD, sweep_text, swept

import explore
from explore.model.status import Status
from explore.studies.request.formula_text import parse_formula

OWN = {
    "reach": {"formula": "coupler+ground", "unit": "mm"},
    "chord": {"formula": "2 * rocker * sin(swing_angle / 2)", "unit": "mm"},
    "slack": {"formula": "reach - chord", "unit": "mm"},
}
STUDY = (
    FEW
    + """
[metrics]
reach = { formula = "coupler+ground", unit = "mm" }
chord = { formula = "2 * rocker * sin(swing_angle / 2)", unit = "mm" }
slack = { formula = "reach - chord", unit = "mm" }
[evaluate]
metrics = ["cv"]
[constraints]
reach = { max = "1.78 m" }
[rank]
metrics = ["chord:max", "cv"]
"""
)
DESIGNS = {"crank": np.array([80.0, 100.0, 140.0, 160.0]), "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}


# --- mistakes ---------------------------------------------------------------------------------------------------------


def entry(formula, unit="mm"):
    return f'own = {{ formula = "{formula}", unit = "{unit}" }}'


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        (entry("couplr + ground"), "own.formula: at character 1: unknown name 'couplr'; did you mean 'coupler'?"),
        (entry("crank + swing_angel"), "own.formula: at character 9: unknown name 'swing_angel'; did you mean 'swing_"),
        (entry("crank + PI"), "own.formula: at character 9: unknown name 'PI'; did you mean 'pi'?"),
        (entry("sqr(crank)"), "own.formula: at character 1: unknown function 'sqr'; did you mean 'sqrt'?"),
        (entry("zzz(crank)"), "own.formula: at character 1: unknown function 'zzz'; available: abs, sqrt, min, max"),
        (entry("pi(crank)"), "own.formula: at character 1: unknown function 'pi'"),
        (entry("sqrt + crank"), "own.formula: at character 1: sqrt is a function; write its values in brackets"),
        (entry("atan2(crank)"), "own.formula: at character 1: atan2 takes 2 values, got 1"),
        (entry("min(crank)"), "own.formula: at character 1: min takes 2 or more values, got 1"),
        (entry("sqrt(crank, 2)"), "own.formula: at character 1: sqrt takes 1 value, got 2"),
        (entry("sqrt()"), "own.formula: at character 6: expected a number, a name or a function here"),
        (entry("crank +"), "own.formula: at the end: expected a number, a name or a function here"),
        (entry("+ crank"), "own.formula: at character 1: expected a number, a name or a function here"),
        (entry("(crank"), "own.formula: at the end: a closing bracket is missing"),
        (entry("crank)"), "own.formula: at character 6: this closing bracket has no opening one"),
        (entry("2 crank"), "own.formula: at character 3: expected an operator before 'crank': + - * / or **"),
        (entry("2 (crank)"), "own.formula: at character 3: expected an operator before '(': + - * / or **"),
        (entry("2crank"), "own.formula: at character 1: '2crank' is not a number; write a product with"),
        (entry("crank^2"), "own.formula: at character 6: '^' is not supported; write **"),
        (entry("0,5 * crank"), "own.formula: at character 2: a comma separates the values of a function; write 0.5, n"),
        (entry("crank < 3"), "own.formula: at character 7: unexpected '<'; a formula has names, numbers, functions, +"),
        (entry("crank.x"), "own.formula: at character 6: '.x' is not a number"),
        (entry("crank * 1e999"), "own.formula: at character 9: the number is too large"),
        (entry("(" * 51 + "crank" + ")" * 51), "own.formula: at character 52: brackets are nested more than 50 deep"),
        (entry("crank" + "+ crank" * 200), "own.formula: has 1,405 characters, but a formula has at most 1,000; split"),
        (entry(" "), 'own.formula: is empty; write a formula such as "coupler + ground"'),
        (entry("2 * pi"), "own.formula: names no parameter or metric, so it is the same in all designs"),
        (entry("sin(swing_angle * pi / 180)"), "own.formula: at character 1: sin takes degrees, as all angles of a s"),
        (entry("sin(swing_angle / (180 / pi))"), "own.formula: at character 1: sin takes degrees, as all angles of a"),
        (entry("sin(swing_angle / sqrt(2) * pi)"), "own.formula: at character 1: sin takes degrees, as all angles of"),
        (entry("atan2(crank, rocker)", "rad"), 'own.formula: atan2 gives degrees; write unit = "deg", or multiply'),
        (entry("linkage_class"), "own.formula: at character 1: linkage_class is a label, not a quantity, so a formul"),
        (
            entry("rocker_acceleration_cv"),
            "own.formula: at character 1: the mean of rocker_acceleration over a stroke is exactly 0",
        ),
        (entry("own + 1"), "own.formula: own is a function of itself: own -> own"),
        (entry("crank", "mmm"), "own.unit: unknown unit 'mmm'; did you mean 'mm'?"),
        (entry("crank", ""), "own.unit: '' is not a unit; write one such as \\\"mm\\\", or".replace("\\", "")),
        (entry("crank", "10**10**10 mm"), "own.unit: '10**10**10 mm' is not a unit"),
        ('own = { formula = "crank" }', "own: the key 'unit' is missing; a complete table is { formula = "),
        ('own = { formula = "crank", units = "mm" }', "own.units: unknown key; did you mean 'unit'?"),
        ('own = { formula = 3, unit = "mm" }', "own.formula: must be a string in quotes, got 3"),
        ('own = "crank"', "own: must be a table such as { formula = "),
        ('crank = { formula = "rocker", unit = "mm" }', "crank: this is the name of a parameter; choose another"),
        ('cv = { formula = "rocker", unit = "mm" }', "cv: this is the name of a metric or signal of crank-rocker;"),
        ('rocker_angle = { formula = "rocker", unit = "mm" }', "rocker_angle: this is the name of a metric or signal"),
        ('error = { formula = "rocker", unit = "mm" }', "error: this is the name of a column of all results; choose"),
        ('violation = { formula = "rocker", unit = "mm" }', "violation: this is the name of a column of all results"),
        ('piece = { formula = "rocker", unit = "mm" }', "piece: this is the name of a column of all results"),
        ('parent = { formula = "rocker", unit = "mm" }', "parent: this is the name of a column of all results"),
        ('yield = { formula = "rocker", unit = "mm" }', "yield: this is the name of a column of all results"),
        ('sqrt = { formula = "rocker", unit = "mm" }', "sqrt: this is the name of a function or a word of form"),
        ('not = { formula = "rocker", unit = "mm" }', "not: this is the name of a function or a word of form"),
        ('cv_margin = { formula = "rocker", unit = "mm" }', "cv_margin: names that end with _margin are of other"),
        ('reach_drive = { formula = "rocker", unit = "mm" }', "reach_drive: names that end with _drive are of other"),
        ('"a b" = { formula = "rocker", unit = "mm" }', '"a b": a name has letters, digits and _, at most 60, and'),
        ('2nd = { formula = "rocker", unit = "mm" }', "2nd: a name has letters, digits and _, at most 60, and begins"),
    ],
)
def test_each_mistake_has_its_line_its_key_and_what_to_write(problems, line, problem):
    (reported,) = problems(f"{GOOD}[metrics]\n{line}\n")
    assert reported.startswith(f"study.toml:8: metrics.{problem}")


def test_all_mistakes_are_reported_at_once_and_once(problems):
    """What uses a formula with a mistake has none of its own."""
    lines = [
        'a = { formula = "b + 1", unit = "mm" }',
        'b = { formula = "c + 1", unit = "mm" }',
        'c = { formula = "a + lost", unit = "mm" }',
        'lost = { formula = "crnk", unit = "mm" }',
        'unitless = { formula = "crank", unit = "mmm" }',
        'user = { formula = "a + lost", unit = "mm" }',
        "[constraints]",
        "a = { max = 3 }",
        "lost = { min = 3 }",
        'unitless = { max = "3 mm" }',
    ]
    assert problems(f"{GOOD}[metrics]\n" + "\n".join(lines)) == [
        "study.toml:8: metrics.a.formula: a is a function of itself: a -> b -> c -> a",
        "study.toml:11: metrics.lost.formula: at character 1: unknown name 'crnk'; did you mean 'crank'?",
        "study.toml:12: metrics.unitless.unit: unknown unit 'mmm'; did you mean 'mm'?",
    ]


def test_names_of_formulas_are_suggested(problems):
    text = f'{GOOD}[evaluate]\nmetrics = ["cv", "raech"]\n[metrics]\nreach = {{ formula = "crank", unit = "mm" }}\n'
    assert problems(text) == ["study.toml:8: evaluate.metrics: unknown metric 'raech'; did you mean 'reach'?"]
    text = text.replace("raech", "reach") + '[rank]\nmetrics = ["reach"]\n'
    assert problems(text) == ["study.toml:12: rank.metrics: reach has no default sense; write reach:min or reach:max"]


def test_formulas_that_use_each_other_often_are_refused_at_once(problems):
    """The hundredth would have more operations than there are atoms in the universe."""
    lines = ['f0 = { formula = "crank", unit = "mm" }', 'f1 = { formula = "crank", unit = "mm" }']
    lines += [f'f{k} = {{ formula = "f{k - 1} + f{k - 2}", unit = "mm" }}' for k in range(2, 100)]
    (reported, *_) = problems(f"{GOOD}[metrics]\n" + "\n".join(lines))
    assert "numbers, names and operators with the formulas it uses, above 1,000" in reported
    chain = ['f0 = { formula = "crank", unit = "mm" }']
    chain += [f'f{k} = {{ formula = "f{k - 1}", unit = "mm" }}' for k in range(1, 60)]
    (reported,) = problems(f"{GOOD}[metrics]\n" + "\n".join(chain))
    assert reported.startswith("study.toml:58: metrics.f50.formula: uses formulas that use formulas, more than 50 in a")


@settings(derandomize=True, deadline=None, max_examples=500)
@given(st.text(alphabet="ab minsqrtp()*+-/,.0123456789e^_\"'[]\n\0é²", max_size=40))
def test_any_text_is_read_or_refused_in_one_line(text):
    try:
        outcome = parse_formula(text).expression.text
    except explore.RequestError as error:
        outcome = str(error)
    assert outcome.isprintable()


def test_a_long_formula_needs_no_deep_stack():
    for text in ("-" * 999 + "a", "a" + "**2" * 333, "a" + "+a" * 499):
        assert parse_formula(text).names == {"a": text.index("a")}


@pytest.mark.parametrize(
    ("text", "even"),
    [
        ("coupler+ground", "coupler + ground"),
        (" - ( a*b )/-c ", "-(a * b) / -c"),
        ("min( a,-b ,2**-c)", "min(a, -b, 2**-c)"),
        ("a--b", "a - -b"),
    ],
)
def test_equal_formulas_have_equal_texts(text, even):
    assert parse_formula(text).expression.text == even
    assert parse_formula(even).expression == parse_formula(text).expression


# --- values -----------------------------------------------------------------------------------------------------------


def test_formulas_are_columns_after_the_metrics_unless_they_are_listed():
    frame = explore.evaluate("crank-rocker", DESIGNS, metrics=["chord", "cv"], formulas=OWN)
    assert list(frame)[4:8] == ["chord", "cv", "reach", "slack"]
    assert frame.attrs["units"]["chord"] == "mm"
    closed = explore.evaluate("crank-rocker", DESIGNS, metrics=["swing_angle"])
    chord = 2.0 * 541.7118 * np.sin(np.radians(closed["swing_angle"].to_numpy()) / 2.0)
    np.testing.assert_allclose(frame["chord"], chord, rtol=1e-15)  # the same operations but for the order of the angle
    np.testing.assert_array_equal(frame["reach"], 1083.4236 + 691.7118)
    np.testing.assert_array_equal(frame["slack"], frame["reach"] - frame["chord"])


@pytest.mark.parametrize(
    "text",
    ["cos(360 * crank / (2 * pi * rocker))", "cos(-(360*crank) / -(pi*(rocker+rocker)))", "cos(360*crank/2/pi/rocker)",
     "cos(180 * crank / sqrt((pi * rocker)**2))", "cos(180 / -pi * (crank / rocker))", "cos(rolled)"],
)  # fmt: skip
def test_degrees_may_be_computed_with_pi(text):
    """The angle that a roller turns while it rolls, its path over its circumference."""
    formulas = {"own": {"formula": text, "unit": "1"},
                "rolled": {"formula": "360 * crank * pi / (2 * pi**2 * rocker)", "unit": "deg"}}  # fmt: skip
    own = explore.evaluate("crank-rocker", DESIGNS, metrics=["swing_angle"], formulas=formulas)["own"]
    # a few roundings of an angle below 0.3 rad
    np.testing.assert_allclose(own, np.cos(DESIGNS["crank"] / 541.7118), rtol=4e-16)


def test_statistics_of_any_window_are_inputs():
    formulas = {"lag": {"formula": "rocker_velocity_mean_drive / rocker_velocity_mean_return", "unit": "1"}}
    frame = explore.evaluate("crank-rocker", DESIGNS, metrics=["time_ratio"], formulas=formulas)
    # both strokes have the same swing, so that the ratio of the mean speeds is that of the times
    np.testing.assert_allclose(np.abs(frame["lag"]) ** -1, frame["time_ratio"], rtol=1e-14)


def test_what_is_undefined_leaves_the_status_and_is_not_feasible():
    formulas = {
        "quotient": {"formula": "1 / (crank - 100)", "unit": "1/mm"},
        "swallowed": {"formula": "min(1 / (1 / (crank - 100)), 0)", "unit": "mm"},
        "root": {"formula": "sqrt(crank - 120)", "unit": "1"},
        "logarithm": {"formula": "log(crank - 100)", "unit": "1"},
        "half": {"formula": "(crank - 120)**0.5", "unit": "1"},
        "huge": {"formula": "exp(crank * 8)", "unit": "1"},
        "direction": {"formula": "atan2(crank - 100, crank - 100)", "unit": "deg"},
    }
    frame = explore.evaluate(
        "crank-rocker", DESIGNS, metrics=["swing_angle"], formulas=formulas, constraints={"root": {"min": -1}}
    )
    undefined = {name: np.flatnonzero(np.isnan(frame[name])).tolist() for name in formulas}
    assert undefined == {
        "quotient": [1], "swallowed": [1], "root": [0, 1], "logarithm": [0, 1], "half": [0, 1], "huge": [1, 2, 3],
        "direction": [1],
    }  # fmt: skip
    assert (frame["status"] == Status.OK).tolist() == [True, True, True, False]
    assert frame["feasible"].tolist() == [False, False, True, False]
    # half a unit in the last place of an exponent of 640 is 7.2e-14
    assert frame["error"].max() < 7.3e-14


def test_a_value_near_zero_misses_no_tolerance():
    """Its error is compared with the terms that cancel, as that of a mean is with the rms."""
    formulas = {"offset": {"formula": "rocker_velocity_mean - 0.2", "unit": "rad/s"}}
    frame = explore.evaluate("crank-rocker", DESIGNS, metrics=["rocker_velocity_mean"])
    speed = float(frame["rocker_velocity_mean"][0])
    formulas["difference"] = {"formula": f"rocker_velocity_mean - {speed!r}", "unit": "rad/s"}
    frame = explore.evaluate("crank-rocker", DESIGNS, metrics=["rocker_velocity_max"], formulas=formulas)
    assert frame["status"].tolist()[:3] == [Status.OK] * 3
    # the statistics are sampled with a fiftieth of the tolerance for formulas
    assert abs(frame["difference"][0]) <= 1e-9 * speed
    small = {"inverse": {"formula": "1 / difference", "unit": "s/rad"}}
    frame = explore.evaluate("crank-rocker", DESIGNS, metrics=["rocker_velocity_max"], formulas=formulas | small)
    assert frame["status"][0] == Status.TOLERANCE_NOT_MET


def test_a_formula_without_statistics_asks_for_no_more_nodes():
    plain = explore.evaluate("crank-rocker", DESIGNS, metrics=["rocker_acceleration_max"])
    frame = explore.evaluate("crank-rocker", DESIGNS, metrics=["rocker_acceleration_max"], formulas=OWN)
    pd.testing.assert_frame_equal(frame[plain.columns], plain)


def test_a_constraint_on_a_formula_screens_where_it_needs_no_samples():
    designs = DESIGNS | {"ground": np.array([691.7118, 720.0, 720.0, 720.0]), "crank": np.array([100, 100, 100, 900.0])}
    frame = explore.evaluate(
        "crank-rocker", designs, metrics=["rocker_acceleration_max"], formulas=OWN, constraints={"reach": {"max": 1800}}
    )
    assert frame["status"].tolist() == [Status.OK, Status.SCREENED, Status.SCREENED, frame["status"][3]]
    assert frame["status"][3] not in (Status.OK, Status.SCREENED), "it cannot move, whatever its reach"
    assert frame["nodes"].tolist()[1:] == [0, 0, 0]
    assert frame["reach"].notna().all()


def test_a_formula_needs_the_load_that_its_inputs_need():
    rig = {"crank": 37.0, "coupler": 1271.5, "rocker": 595.0, "ground": 751.0}
    formulas = {"double": {"formula": "2 * drive_torque_peak", "unit": "N m"}}
    with pytest.raises(explore.RequestError, match="double needs "):
        explore.evaluate("test-rig", rig, metrics=["swing_angle"], formulas=formulas)
    frame = explore.evaluate(
        "test-rig", rig | {"constant_torque": 25e3}, metrics=["drive_torque_peak"], formulas=formulas
    )
    assert frame["double"][0] == 2.0 * frame["drive_torque_peak"][0]


def test_python_reports_mistakes_by_argument():
    with pytest.raises(explore.RequestError) as caught:
        explore.evaluate("crank-rocker", DESIGNS, formulas={"reach": {"formula": "couplr", "unit": "mm"}})
    assert str(caught.value).startswith("formulas.reach.formula: at character 1: unknown name 'couplr'; did you mean")
    with pytest.raises(explore.ConfigError) as caught:
        explore.Study(mechanism="crank-rocker", parameters=DESIGNS, formulas={"reach": {"formula": "crank"}})
    assert str(caught.value).startswith("formulas.reach: the key 'unit' is missing")
    with pytest.raises(explore.RequestError, match="a name has letters"):
        explore.evaluate("crank-rocker", DESIGNS, formulas={1: {"formula": "crank", "unit": "mm"}})


# --- studies and files ------------------------------------------------------------------------------------------------


folder = swept(STUDY, "own", give=lambda results: results.path.parent)


def test_the_hash_of_a_study_covers_its_formulas(folder):
    study = explore.load_study(folder / "own.toml")
    arguments = {
        "mechanism": "crank-rocker",
        "parameters": {
            "crank": [80, 100, 150, 160],
            "coupler": 1083.4236,
            "rocker": 541.7118,
            "ground": [691.7118, 720],
        },
        "metrics": "cv",
        "constraints": {"reach": {"max": 1780}},
        "objectives": ["chord:max", "cv"],
    }
    own = explore.Study(**arguments, formulas=OWN)
    assert own == study
    assert pickle.loads(pickle.dumps(own)) == study
    (folder / "again.toml").write_text(own.to_toml())
    assert explore.load_study(folder / "again.toml") == study
    for key, text in (("formula", "coupler - ground"), ("unit", "cm")):
        changed = OWN | {"reach": OWN["reach"] | {key: text}}
        assert explore.Study(**arguments | {"formulas": changed}).sha256 != study.sha256
    assert "formulas" not in json.loads(explore.Study(**arguments | {"constraints": None, "objectives": "cv"}).identity)


def test_a_formula_is_a_column_of_the_file(folder):
    results = explore.open_results(folder / "own.h5")
    assert [(c.name, c.unit, c.long_name) for c in results.columns if c.name in OWN] == [
        ("reach", "mm", "coupler + ground"),
        ("chord", "mm", "2 * rocker * sin(swing_angle / 2)"),
        ("slack", "mm", "reach - chord"),
    ]
    frame = results.to_pandas()
    assert frame.attrs["units"]["slack"] == "mm"
    parameters = frame[["crank", "coupler", "rocker", "ground"]]
    computed = explore.evaluate(
        "crank-rocker", parameters, metrics="cv", formulas=OWN, constraints={"reach": {"max": 1780}}
    )
    pd.testing.assert_frame_equal(frame[computed.columns], computed, check_index_type=False, check_names=False)
    assert results.verify() == []
    assert frame["feasible"].sum() == (frame["status"] == Status.OK).sum() > 0
    ranked = explore.rank(results, objectives=["slack:max"], where="chord > 350")
    assert ranked.index[0] == frame["slack"].where(frame["feasible"] & (frame["chord"] > 350)).idxmax()


def test_a_changed_formula_is_another_study(folder):
    (folder / "changed.toml").write_text(STUDY.replace("coupler+ground", "coupler + 2 * ground"))
    code, _, err = call("sweep", folder / "changed.toml", "-o", folder / "own.h5")
    assert code == 1
    assert 'formulas.reach.formula: "coupler + ground" -> "coupler + 2 * ground"' in err
    code, _, err = call("sweep", folder / "own.toml", "-o", folder / "own.h5")
    assert (code, "is complete already: 8 designs" in err) == (0, True)


@pytest.mark.parametrize(
    "command",
    [
        ["show", "{}"],
        ["show", "{}", "--design", "2"],
        ["rank", "{}", "--metric", "slack:max", "--where", "reach < 1790", "--limit", "reach<=1779"],
        ["plot", "pareto", "{}", "--x", "reach", "--y", "chord", "-o", "{}.pareto.png"],
        ["plot", "motion", "{}", "-o", "{}.motion.png"],
        ["report", "{}", "-o", "{}.html"],
    ],
)
def test_commands_take_formulas_as_columns(folder, command):
    out, _ = succeed(*(word.format(folder / "own.h5") for word in command))
    if command[0] in ("show", "rank"):
        assert "slack" in out
    if command[0] == "report":
        page = (folder / "own.h5.html").read_text(encoding="utf-8")
        assert "2 * rocker * sin(swing_angle / 2)" in page


def test_results_are_exported(folder):
    out, _ = succeed("rank", folder / "own.h5", "--json", "-o", folder / "own.csv")
    assert json.loads(out)[0]["slack"] == pd.read_csv(folder / "own.csv")["slack"][0]
    dataset = pytest.importorskip("xarray") and explore.open_results(folder / "own.h5").to_xarray()
    assert (dataset["slack"].attrs["units"], dataset["slack"].attrs["long_name"]) == ("mm", "reach - chord")


def test_other_formulas_of_one_name_are_pointed_out(folder):
    sweep_text(folder, STUDY.replace("coupler+ground", "rocker + ground"), "other")
    with pytest.warns(RuntimeWarning, match=r"reach is the coupler \+ ground in .*, but the rocker \+ ground in "):
        explore.rank([folder / "own.h5", folder / "other.h5"], objectives=["reach:min", "cv"])


def test_processes_compute_the_same_bytes(folder):
    explore.sweep(explore.load_study(folder / "own.toml"), folder / "processes.h5", processes=True, workers=1)
    assert (folder / "processes.h5").read_bytes() == (folder / "own.h5").read_bytes()
