"""Studies of linkages: their text, their identity, and results that another process understands."""

import json
import pickle
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command_line import run
from studies import sweep_text

import explore
from explore.base.errors import ConfigError, RequestError, ResultsError
from explore.figures.charts.mechanism import mechanism_chart
from explore.results.store.recorded_study import RecordedStudy
from explore.service.inlined_points import with_points
from explore.service.job_files import read_job_file
from explore.studies.config.linkage import mechanism_of
from explore.studies.config.study_file import linkage_starter, linkage_starters

TABLE = """\
[linkage]
driver = "crank"
output = "guide"

[linkage.frame]
O = [0, 0]

[linkage.links]
crank = { O = 0, A = "r" }
rod = { A = 0, B = "l" }

[linkage.slots]
guide = { pin = "B", link = "frame", along = [[0, "e"], [1, "e"]] }

[linkage.sketch]
crank_angle = 40
B = [123, 10]
"""
PARAMETERS = """\
[parameters]
r = [30, 20]
l = 100
e = { start = 0, stop = 20, num = 3 }
speed = "60 rpm"

[evaluate]
metrics = ["guide_velocity_peak", "guide_position_peak_to_peak"]

[rank]
metrics = ["guide_velocity_peak", "guide_position_peak_to_peak:max"]
"""
STUDY = f'mechanism = "linkage"\n\n{TABLE}\n{PARAMETERS}'
NAMING = f'mechanism = "linkage"\nlinkage = "slider.toml"  # its table\n\n{PARAMETERS}'


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "slider.toml").write_text(TABLE)
    (tmp_path / "naming.toml").write_text(NAMING)
    return tmp_path


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("linkage")
    return sweep_text(folder, STUDY, workers=1)


def problems_of(file):
    with pytest.raises(ConfigError) as error:
        explore.load_study(file)
    return [line.removeprefix(f"{file.parent}/") for line in error.value.problems]


def test_a_table_of_a_file_is_one_of_the_study(folder):
    own, naming = explore.load_study(folder / "study.toml"), explore.load_study(folder / "naming.toml")
    assert own == naming
    assert own.linkage == naming.linkage == explore.load_linkage(folder / "study.toml")
    assert own.to_toml() == STUDY


def test_the_text_holds_the_table_in_place_of_the_name_of_its_file(folder):
    study = explore.load_study(folder / "naming.toml")
    text = study.to_toml()
    assert text.startswith(f'mechanism = "linkage"\n\n{PARAMETERS.rstrip()}\n\n[linkage]\n')
    assert tomllib.loads(text)["linkage"] == study.linkage.content
    (folder / "elsewhere").mkdir()
    (folder / "elsewhere" / "study.toml").write_text(text)
    assert explore.load_study(folder / "elsewhere" / "study.toml") == study


def test_a_name_within_other_texts_is_inlined_as_well(folder):
    (folder / "naming.toml").write_text(NAMING.replace("linkage =", '"linkage" ='))
    assert "slider.toml" not in explore.load_study(folder / "naming.toml").to_toml()
    (folder / "naming.toml").write_text(NAMING.replace('"slider.toml"', '"""\nslider.toml"""'))
    assert tomllib.loads(explore.load_study(folder / "naming.toml").to_toml())["linkage"]["driver"] == "crank"


def test_linkages_in_python(folder):
    linkage = explore.Linkage(tomllib.loads(TABLE), parameters={"r": 30, "l": 100, "e": 10})
    assert linkage == explore.Linkage(tomllib.loads(TABLE)["linkage"], parameters={"r": "3 cm", "l": [100], "e": 10})
    sections = tomllib.loads(PARAMETERS)
    options = {"metrics": sections["evaluate"]["metrics"], "objectives": sections["rank"]["metrics"]}
    study = explore.load_study(folder / "study.toml")
    for given in ({"mechanism": linkage}, {"mechanism": "linkage", "linkage": linkage},
                  {"mechanism": "linkage", "linkage": linkage.content},
                  {"mechanism": "linkage", "linkage": str(folder / "slider.toml")}):  # fmt: skip
        same = explore.Study(**given, parameters=sections["parameters"], **options)
        assert same == study
        assert pickle.loads(pickle.dumps(same)) == study
        (folder / "same.toml").write_text(same.to_toml())
        assert explore.load_study(folder / "same.toml") == study
    with pytest.raises(RequestError, match="this linkage has no parameter 'q'; it has"):
        explore.evaluate(linkage, {"q": 1})
    assert repr(linkage) == "Linkage(links=['crank', 'rod'], points=['O', 'A', 'B'], parameters=['r', 'l', 'e'])"
    assert "B = &quot;far&quot;" in linkage._repr_html_()


def test_paths_that_look_alike_are_named_together(results):
    (legend,) = mechanism_chart(results).legends
    assert legend.get_texts()[0].get_text() == "paths of A, B"


def test_a_linkage_stands_for_the_name_of_a_mechanism(tmp_path):
    linkage = explore.Linkage(tomllib.loads(TABLE), parameters={"r": 30, "l": 100, "e": 10})
    row = explore.evaluate(linkage, {"r": 30, "l": 100, "e": 0}, metrics=["guide_position_peak_to_peak"])
    assert row["guide_position_peak_to_peak"].iloc[0] == pytest.approx(60, rel=1e-9)
    motion = explore.simulate(linkage, {"r": 30, "l": 100, "e": 10}, angles=[90])
    assert motion["B_x"].iloc[0] == pytest.approx(np.sqrt(100**2 - 20**2), rel=1e-12)
    tuning = explore.tune(linkage, {"r": 30, "l": 100, "e": 0}, parameter="r", metric="guide_position_peak_to_peak",
                          low=80, high=80, start=1, stop=60)  # fmt: skip
    assert tuning.intervals[0].start.parameter == pytest.approx(40, rel=1e-9)
    explore.export(linkage, tmp_path / "design.toml", parameters={"r": 30, "l": 100, "e": 10})
    assert explore.load_study(tmp_path / "design.toml").linkage == linkage
    with pytest.raises(RequestError, match="a linkage alone is no design"):
        explore.export(linkage, tmp_path / "other.toml")


def test_results_are_understood_by_a_process_that_knows_no_table(results, tmp_path):
    """The names of mechanisms of tables are not registered anywhere: the study in the file describes them."""
    program = f"""
import explore
from explore.studies.config.linkage import mechanism_of
from explore.figures.simulation import simulate_design
results = explore.open_results({str(results.path)!r})
assert mechanism_of(results).name == results.mechanism
assert len(simulate_design(results, 0).motion) > 10
explore.export(results, {str(tmp_path / "best.toml")!r}, design=4)
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=300)
    study = explore.load_study(tmp_path / "best.toml")
    assert study.request.mechanism.name == results.mechanism
    assert study.space.n_designs == 1


def test_the_study_of_a_design_keeps_the_sides_of_joints(tmp_path):
    """A sketch would be too far from this design to tell them."""
    swept = sweep_text(tmp_path, STUDY.replace("r = [30, 20]", "r = [30, 2]"), workers=1)
    explore.export(swept, tmp_path / "one.toml", design=3)
    assert explore.load_study(tmp_path / "one.toml").request.mechanism.name == swept.mechanism


def test_a_changed_table_is_another_study(folder):
    run("sweep", "naming.toml", "-o", "out.h5", cwd=folder, seconds=300)
    (folder / "slider.toml").write_text(TABLE.replace('B = "l"', 'B = "l + 1"'))
    refused = run("sweep", "naming.toml", "-o", "out.h5", cwd=folder, code=1, seconds=300)
    assert "another study; what changed:" in refused.stderr
    assert '  linkage.links.rod.B: "l" -> "l + 1"\n' in refused.stderr
    # Another way to write the same table is the same study.
    (folder / "slider.toml").write_text(TABLE.replace('A = "r"', 'A = [" ( r ) ", "0 * 3"]'))
    run("sweep", "naming.toml", "-o", "out.h5", cwd=folder, seconds=300)


def test_damaged_studies_of_results_are_said(results):
    class Altered(RecordedStudy):
        config, mechanism, points, target = "", "", (), None

        def __init__(self, config):
            self.config, self.mechanism, self.path = config, results.mechanism, results.path
            self.points, self.target = results.points, results.target

    assert mechanism_of(Altered(results.config)).name == results.mechanism
    for config, reason in (
        (results.config.replace('"l"', '"l + 1"'), "its study describes linkage-"),
        (results.config.replace('driver = "crank"', ""), "does not describe its linkage: linkage: the key 'driver'"),
        ("[", "its study cannot be read"),
    ):
        with pytest.raises(ResultsError, match=reason):
            mechanism_of(Altered(config))


def test_a_parameter_with_bounds_is_solved_for_beside_a_sketch(folder):
    """The sketch is of the middle of the bounds."""
    solved = '{ solve = "stroke", value = 50, min = 20, max = 30 }'
    results = sweep_text(folder, STUDY.replace("r = [30, 20]", f"r = {solved}"), workers=1)
    frame = results.to_pandas()
    # The stroke of a slider-crank without offset is 2 r.
    assert frame["r"][0] == pytest.approx(25.0, rel=1e-9)
    assert frame["guide_position_peak_to_peak"].to_numpy() == pytest.approx(50.0, rel=1e-9)


def test_mistakes_of_studies(folder):
    study, naming = folder / "study.toml", folder / "naming.toml"
    study.write_text(STUDY.replace("l = 100", "l = 100\nll = 3\nr2 = 4").replace('"l"', '"l + q"'))
    assert problems_of(study) == [
        "study.toml:21: parameters: missing q; this linkage needs r, l, q, e",
        (
            "study.toml:21: parameters: the sketch needs a value of q; write it here, or as its default in "
            "[linkage.parameters]"
        ),
        "study.toml:24: parameters.ll: nothing in [linkage] uses it; did you mean 'l'?",
        "study.toml:25: parameters.r2: nothing in [linkage] uses it; did you mean 'r'?",
    ]
    study.write_text(STUDY.replace("l = 100", "l = 100\nll = 3\nr2 = 4").replace("start = 0", "start = 30"))
    assert problems_of(study) == [
        "study.toml:24: parameters.ll: nothing in [linkage] uses it; did you mean 'l'?",
        "study.toml:25: parameters.r2: nothing in [linkage] uses it; did you mean 'r'?",
        "study.toml:26: parameters.e: start = 30 is above stop = 20; swap them",
    ]
    study.write_text(STUDY.replace("l = 100", 'l = "x"'))
    assert problems_of(study) == ["study.toml:23: parameters.l: 'x' is not a number with a unit, such as \"10 mm\""]
    table = TABLE.partition("[linkage.sketch]")[0] + '[linkage.branch]\nB = "far"\n'
    text = f'mechanism = "linkage"\n{table}{PARAMETERS}[constraints]\nzzz = {{ min = 1 }}\n'
    study.write_text(text.replace("l = 100", ""))
    missing, unknown, *_ = problems_of(study)
    assert missing.endswith("parameters: missing l; this linkage needs r, l, e"), missing
    assert unknown.endswith("unknown metric 'zzz'; `explore mechanisms STUDY.toml` lists them"), unknown
    study.write_text(STUDY.replace('output = "guide"', 'output = "gide"').replace("speed", "sped"))
    assert problems_of(study) == [
        "study.toml:5: linkage.output: unknown link or slot 'gide'; did you mean 'guide'?",
        "study.toml:25: parameters.sped: nothing in [linkage] uses it; did you mean 'speed'?",
    ]
    study.write_text(STUDY.replace('mechanism = "linkage"\n', ""))
    assert problems_of(study) == ['study.toml:1: mechanism: is missing; begin the file with mechanism = "linkage"']
    study.write_text(STUDY.replace('mechanism = "linkage"', 'mechanism = "gears"'))
    assert "study.toml:3: linkage: needs mechanism = \"linkage\", not 'gears'" in problems_of(study)
    study.write_text(f'mechanism = "linkage"\n{PARAMETERS}')
    assert problems_of(study) == [
        (
            "study.toml:1: linkage: is missing; describe the linkage in the section [linkage], or name its file, "
            'linkage = "shaper.toml"'
        ),
    ]
    naming.write_text(NAMING.replace("slider.toml", "nowhere.toml"))
    assert problems_of(naming) == [
        f"naming.toml:2: linkage: {folder}/nowhere.toml: no such file; `explore init` writes one to start from"
    ]
    naming.write_text(NAMING)
    (folder / "slider.toml").write_text(TABLE.replace('driver = "crank"', 'driver = "crnk"'))
    assert problems_of(naming) == ["slider.toml:2: linkage.driver: unknown link or slot 'crnk'; did you mean 'crank'?"]
    (folder / "slider.toml").write_text('linkage = "other.toml"\n')
    assert len(problems_of(naming)) == 1


@pytest.mark.parametrize("pair", ["[123]", "[1, 2, 3]", "5"])
def test_what_is_no_pair_has_a_line(folder, pair):
    text = TABLE.replace("B = [123, 10]", f"B = {pair}\n\n[linkage.loads]\ngravity = {pair}")
    (folder / "slider.toml").write_text(text)
    found = problems_of(folder / "naming.toml")
    for number, key in ((17, "sketch.B"), (20, "loads.gravity")):
        assert f"slider.toml:{number}: linkage.{key}: must be a pair [x, y], got {pair}" in found


def test_a_file_with_values_draws_its_sketch_for_them(folder):
    """The study may sweep other values than those that the sketch was drawn for."""
    (folder / "slider.toml").write_text(f"{TABLE}\n[parameters]\nr = 30\nl = 100\ne = 10\n")
    (folder / "naming.toml").write_text(NAMING.replace("l = 100", "l = 1000"))
    study = explore.load_study(folder / "naming.toml")
    assert study.linkage.content["branch"] == {"B": "far"}
    assert explore.load_linkage(folder / "naming.toml") == study.linkage


def test_services_take_the_table_and_read_no_file(folder):
    with pytest.raises(ConfigError, match="naming.toml:2: linkage: a server reads no file of a linkage"):
        read_job_file("naming", NAMING.encode())
    text = with_points(NAMING, folder / "naming.toml")
    assert read_job_file("naming", text.encode()) == explore.load_study(folder / "study.toml")


def test_the_command_line_lists_what_a_table_has(folder):
    listed = run("mechanisms", "study.toml", cwd=folder, seconds=300).stdout
    assert "guide_velocity" in listed
    described = json.loads(run("mechanisms", "slider.toml", "--json", cwd=folder, code=2, seconds=300).stdout or "null")
    assert described is None
    described = json.loads(run("mechanisms", "naming.toml", "--json", cwd=folder, seconds=300).stdout)
    assert list(described["parameters"]) == ["r", "l", "e", "speed"]


def test_init_writes_classic_linkages(tmp_path):
    names = linkage_starters()
    assert len(names) >= 16
    assert all(linkage_starter(name)[2:].replace("\n# ", " ").startswith(names[name]) for name in names)
    listed = run("init", "--list", cwd=tmp_path).stdout
    picture = (Path(__file__).parents[1] / "docs" / "linkages-gallery.svg").read_text(encoding="utf-8")
    assert all(name in listed and f">{name}</text>" in picture for name in names)
    refused = run("init", "--linkage", "wat-2", cwd=tmp_path, code=2).stderr
    assert "unknown linkage 'wat-2'; did you mean 'watt-2'? available: crank-shaper, " in refused
    refused = run("init", "--linkage", "watt-2", "--task", "path", cwd=tmp_path, code=2).stderr
    assert refused == "error: --task and --linkage are given; name one of them\n"
    assert "explore sweep my.toml" in run("init", "--linkage", "watt-2", "my.toml", cwd=tmp_path).stderr
    assert (tmp_path / "my.toml").read_text() == linkage_starter("watt-2")


@pytest.mark.parametrize("name", linkage_starters())
def test_classic_linkages_are_studies_with_a_source(tmp_path, name):
    text = linkage_starter(name)
    (tmp_path / "study.toml").write_text(text)
    study = explore.load_study(tmp_path / "study.toml")
    assert study.remarks == ()
    assert len(study.objectives) >= 2
    assert "\n# Source: " in text
