"""Studies built in Python are the same as those read from files."""

import dataclasses
import os
import pickle
import re
import tomllib
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from studies import FEW, GOOD

import explore
from explore.studies.request.names import find_mechanism

CONFIGS = sorted((Path(__file__).parent.parent / "configs").rglob("*.toml"))
LINKS = {"crank": 100.0, "coupler": 1000.0, "rocker": 500.0, "ground": 700.0}


def arguments(text):
    """The arguments of `explore.Study` for the text of a study file."""
    sections = tomllib.loads(text)
    sections.pop("scene", None)
    rank = sections.pop("rank", {})
    evaluate = sections.pop("evaluate", {})
    formulas = sections.pop("metrics", None)
    return {**sections, **evaluate, "formulas": formulas, "objectives": rank.get("metrics")}


@pytest.fixture
def reread(tmp_path):
    """Write a study as TOML and read it again."""

    def write(study):
        (tmp_path / "study.toml").write_text(study.to_toml(), encoding="utf-8")
        return explore.load_study(tmp_path / "study.toml")

    return write


@pytest.mark.parametrize("config", CONFIGS, ids=lambda path: path.stem)
def test_every_study_file_as_a_study_in_python(config, reread):
    from_file = explore.load_study(config)
    built = explore.Study(**arguments(config.read_text(encoding="utf-8")))
    assert built == from_file
    assert (built.identity, built.sha256) == (from_file.identity, from_file.sha256)
    assert built.objectives == from_file.objectives
    assert reread(built) == built == reread(from_file)
    assert from_file.to_toml() == config.read_text(encoding="utf-8")


lengths = st.floats(1e-3, 1e6)


@st.composite
def entries(draw, drawing):
    """The entry of a length: a value, several, or a range."""
    kind = draw(st.sampled_from(["value", "text", "list", "array", "spaced", *(["range"] if drawing else [])]))
    low, high = sorted(draw(st.lists(lengths, min_size=2, max_size=2, unique=True)))
    if kind == "value":
        return low
    if kind == "text":
        return f"{low!r} mm"
    if kind in ("list", "array"):
        values = draw(st.lists(lengths, min_size=1, max_size=5, unique=True))
        return np.array(values) if kind == "array" else values
    if kind == "spaced":
        return {"start": low, "stop": high, "num": draw(st.integers(2, 50_000))}  # of four lengths at most 2^63 designs
    return {"min": low, "max": high, "log": draw(st.booleans())}


@st.composite
def studies(draw):
    """Arguments of a valid study."""
    drawing = draw(st.booleans())
    parameters = {name: draw(entries(drawing)) for name in LINKS}
    if drawing:
        parameters["coupler"] = {"min": 1, "max": 1e9}
    start = draw(st.floats(-720, 720))
    bounds = sorted(draw(st.lists(st.floats(0, 180), min_size=2, max_size=2)))
    method = st.sampled_from(["sobol", "latin-hypercube", "random"])
    seed = st.none() | st.integers(0, 2**63 - 1)
    sampling = {"method": draw(method), "count": draw(st.integers(1, 10**6)), "seed": draw(seed)}
    interval = {"from": start, "to": start + draw(st.floats(1e-3, 360))}
    optional = {
        "sampling": sampling if drawing else draw(st.sampled_from([None, {}, {"method": "grid"}])),
        "window": draw(st.sampled_from([None, "drive", "cycle", interval])),
        "drive": draw(st.sampled_from([None, "slow", "fast"])),
        "metrics": draw(st.sampled_from([None, ["rocker_velocity_std", "swing_angle"], ("swing_angle",)])),
        "constraints": draw(st.sampled_from([None, {}, {"swing_angle": {"min": bounds[0], "max": bounds[1]}}])),
        "objectives": draw(st.sampled_from([None, ["swing_angle:max"], ("swing_angle:min",)])),
        "tolerance": draw(st.sampled_from([1e-9, 3e-7])),
    }
    chosen = {name: value for name, value in optional.items() if draw(st.booleans()) or name == "sampling"}
    if chosen.get("metrics") is None and chosen.get("window") in ("cycle", interval):
        chosen.pop("objectives", None)  # the swing needs strokes, which these windows do without by default
    return {"mechanism": "crank-rocker", "parameters": parameters, **chosen}


@given(studies())
@settings(deadline=None)  # the first example imports the readers
def test_round_trip(tmp_path_factory, arguments):
    study = explore.Study(**arguments)
    path = tmp_path_factory.mktemp("study") / "study.toml"
    path.write_text(study.to_toml(), encoding="utf-8")
    again = explore.load_study(path)
    assert again == study
    assert again.identity == study.identity
    assert hash(again) == hash(study)
    assert again.to_toml() == study.to_toml()


def test_a_table_of_designs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = pd.DataFrame({"crank": np.linspace(80, 120, 7) / 3.0, "ground": 700.0})
    table.to_csv("designs.csv", index=False)
    study = explore.Study(
        mechanism="crank-rocker",
        parameters={"coupler": 1000, "rocker": 500},
        sampling={"method": "table", "file": Path("designs.csv")},
    )
    Path("study.toml").write_text(study.to_toml(), encoding="utf-8")
    assert explore.load_study("study.toml") == study
    assert study.space.designs(0, 7)["crank"].tolist() == table["crank"].tolist()


@pytest.mark.parametrize("name", ["a\udcff.csv", "\ud800.csv"])
def test_a_table_whose_name_is_not_valid_unicode_is_refused(tmp_path, monkeypatch, name):
    """TOML cannot hold such a name, although Linux allows the first."""
    monkeypatch.chdir(tmp_path)
    if os.fsdecode(b"a\xff.csv") == name:
        Path(name).write_text("crank\n100\n")
    parameters = {length: LINKS[length] for length in ("coupler", "rocker", "ground")}
    with pytest.raises(explore.ConfigError) as caught:
        explore.Study(mechanism="crank-rocker", parameters=parameters, sampling={"method": "table", "file": name})
    assert caught.value.problems == ["sampling.file: the name is not valid Unicode; rename the file"]


@pytest.mark.parametrize(
    "values",
    [
        np.array([80.0, 100.0]), np.array([80, 100], dtype=np.int16), np.array([80, 100], dtype=np.float32),
        (80, 100), range(80, 101, 20), pd.Series([80, 100]), pd.Index([80, 100]), [np.float64(80), np.int64(100)],
        [Fraction(80), Decimal(100)], ["8 cm", "0.1 m"],
    ],
)  # fmt: skip
def test_lists_of_any_kind(values, reread):
    study = explore.Study(mechanism="crank-rocker", parameters={**LINKS, "crank": values})
    assert study == explore.Study(mechanism="crank-rocker", parameters={**LINKS, "crank": [80, 100]})
    assert reread(study) == study


@pytest.mark.parametrize("value", [100, np.float64(100), np.array(100), "10 cm", Fraction(100), 100.0])
def test_numbers_of_any_kind(value, reread):
    study = explore.Study(mechanism="crank-rocker", parameters={**LINKS, "crank": value}, tolerance=np.float64(1e-9))
    assert study == explore.Study(mechanism="crank-rocker", parameters=LINKS)
    assert reread(study) == study


def test_none_is_not_given():
    plain = explore.Study(mechanism="crank-rocker", parameters=LINKS)
    assert plain == explore.Study(
        mechanism="crank-rocker",
        parameters={**LINKS, "phases": None},
        sampling={"method": "grid", "seed": None},
        window=None,
        constraints=None,
    )


WRONG = """\
mechanism = "crank-rocker"
parameters = { crank = 0, couplr = 2, ground = [1, 1], rocker = { start = 1, stop = 2, nmu = 3 }, speed = "4 mm" }
sampling = { method = "gird", sed = 1 }
evaluate = { window = "driv", drive = "sloww", metrics = ["cv", 3, "cvv"], tolerance = 2 }
constraints = { swing_angle = { mn = 3 }, cv = {} }
rank = { metrics = ["cv:down", "cv", "cv"] }
"""


def test_the_same_problems_as_in_a_file(tmp_path):
    (tmp_path / "study.toml").write_text(WRONG)
    with pytest.raises(explore.ConfigError) as of_file:
        explore.load_study(tmp_path / "study.toml")
    with pytest.raises(explore.ConfigError) as built:
        explore.Study(**arguments(WRONG))
    expected = [re.sub(r"^.*?study\.toml:\d+: (evaluate\.)?", "", line) for line in of_file.value.problems]
    expected = [re.sub(r"^rank\.metrics", "objectives", line) for line in expected]
    assert sorted(built.value.problems) == sorted(expected)
    assert len(expected) > 12


def test_twenty_problems_at_most():
    with pytest.raises(explore.ConfigError) as caught:
        explore.Study(mechanism="crank-rocker", parameters={**LINKS, "crank": [-1.0] * 30})
    assert len(caught.value.problems) == 1  # of the same text
    with pytest.raises(explore.ConfigError) as caught:
        explore.Study(mechanism="crank-rocker", parameters={**LINKS, "crank": range(-30, 0)})
    assert len(caught.value.problems) == 21
    assert caught.value.problems[-1] == "and 10 more"


def test_arguments_are_keywords():
    with pytest.raises(TypeError):
        explore.Study("crank-rocker", LINKS)
    with pytest.raises(TypeError, match="unexpected keyword argument 'metric'"):
        explore.Study(mechanism="crank-rocker", parameters=LINKS, metric=["cv"])


def test_results_are_those_of_the_file(tmp_path):
    (tmp_path / "study.toml").write_text(FEW)
    studies = {"file": explore.load_study(tmp_path / "study.toml"), "python": explore.Study(**arguments(FEW))}
    attributes, columns = {}, {}
    for name, study in studies.items():
        explore.sweep(study, tmp_path / f"{name}.h5")
        with h5py.File(tmp_path / f"{name}.h5") as file:
            attributes[name] = {key: np.asarray(value).tobytes() for key, value in file.attrs.items()}
        columns[name] = explore.read_results(tmp_path / f"{name}.h5")
    assert attributes["file"].keys() == attributes["python"].keys()
    assert [key for key in attributes["file"] if attributes["file"][key] != attributes["python"][key]] == [
        "checked",  # the checksum of all of them
        "config",
    ]
    pd.testing.assert_frame_equal(columns["file"], columns["python"], check_exact=True)


def test_a_study_is_a_value():
    study = explore.Study(mechanism="crank-rocker", parameters=LINKS)
    assert pickle.loads(pickle.dumps(study)) == study
    assert len({study, explore.Study(mechanism="crank-rocker", parameters=LINKS)}) == 1
    assert study != explore.Study(mechanism="crank-rocker", parameters={**LINKS, "crank": 101})
    assert study != explore.Study(mechanism="crank-rocker", parameters=LINKS, objectives=["cv:max"])
    assert study != GOOD
    with pytest.raises(dataclasses.FrozenInstanceError):
        study.objectives = ()


def test_repr_names_what_is_swept():
    study = explore.Study(
        mechanism="crank-rocker",
        parameters={**LINKS, "crank": {"min": 60, "max": 120}},
        sampling={"method": "sobol", "count": 8},
        metrics=["swing_angle", "cv"],
        constraints={"swing_angle": {"min": 10}},
    )
    assert repr(study) == (
        "Study(mechanism='crank-rocker', designs=8, method='sobol', swept=['crank'], metrics=['swing_angle', 'cv'], "
        "constraints=['swing_angle'], objectives=['cv:min', 'swing_angle:max'])"
    )


def test_every_mechanism_has_a_study_in_python():
    for name in ("crank-rocker", "test-rig"):
        required = [p.name for p in find_mechanism(name).parameters if p.default is None]
        assert explore.Study(mechanism=name, parameters=dict.fromkeys(required, 1)).space.n_designs == 1


def test_a_single_name_need_not_be_in_a_list():
    lengths = {"crank": [80, 100], "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}
    single = explore.Study(mechanism="crank-rocker", parameters=lengths, metrics="cv", objectives="cv")
    assert single == explore.Study(mechanism="crank-rocker", parameters=lengths, metrics=["cv"], objectives=["cv"])


@pytest.mark.parametrize("window", [{"from": 30, "to": 100}, {"from": -7.3, "to": "1 rad"}, "drive"])
def test_the_window_of_results_is_one_that_evaluate_takes(tmp_path, window):
    lengths = {"crank": 100, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}
    study = explore.Study(mechanism="crank-rocker", parameters=lengths, window=window, metrics="rocker_angle_mean")
    results = explore.sweep(study, tmp_path / "one.h5", workers=1)
    again = explore.evaluate("crank-rocker", lengths, window=results.window, metrics="rocker_angle_mean")
    assert again["rocker_angle_mean"].tolist() == results.to_pandas()["rocker_angle_mean"].tolist()
    if window != "drive":
        assert results.window["from"] == window["from"]


def cranks(constraints):
    """A study of crank lengths of which 90 can turn, none with a transmission angle above 30 deg."""
    links = {"coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}
    crank = {"start": 60, "stop": 180, "num": 121}
    return explore.Study(mechanism="crank-rocker", parameters={**links, "crank": crank}, constraints=constraints)


def test_a_sweep_without_objectives_and_feasible_designs_is_returned(tmp_path):
    """With the reasons in a warning, as with objectives."""
    links = {"crank": 100, "coupler": 150, "rocker": 120, "ground": 200}
    study = explore.Study(mechanism="crank-rocker", parameters=links, metrics=["time_ratio"])
    with pytest.warns(explore.NothingFeasibleWarning, match="left out: 1 crank_blocked"):
        results = explore.sweep(study, tmp_path / "blocked.h5")
    assert results.is_complete
    for ask in (lambda: explore.tolerance(results, {"crank": 0.1}), lambda: explore.charts.motion_chart(results)):
        with pytest.raises(
            explore.RequestError, match=r"has no objective, so no design is the best: choose one with .design"
        ):
            ask()


def test_sweep_and_rank_say_why_nothing_is_feasible(tmp_path):
    path = tmp_path / "none.h5"
    begins = re.escape(f"no design of {path} is feasible, so there is nothing to rank; ")
    reasons = re.escape(
        "left out: 90 miss the constraint on transmission_angle_min; "
        "left out: 30 crank_blocked: the crank cannot turn fully: the linkage locks before a full turn; "
        "left out: 1 change_point: "
    )
    with pytest.warns(explore.NothingFeasibleWarning, match=begins + reasons):
        results = explore.sweep(cranks({"transmission_angle_min": {"min": "30 deg"}}), path)
    with pytest.warns(explore.NothingFeasibleWarning, match=begins + reasons):
        assert explore.rank(results).empty
    feasible = explore.sweep(cranks({}), tmp_path / "some.h5")
    with pytest.warns(
        RuntimeWarning, match="no feasible design of .* meets the request, .*; left out: 90 feasible ones"
    ):
        assert explore.rank(feasible, where="crank > 900").empty
