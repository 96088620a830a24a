"""A design taken out of results: a study that computes the same row, motion files, animations, refused requests."""

import shutil
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import pairwise

import h5py
import numpy as np
import pandas as pd
import pytest
from command_line import assert_refused, call, run
from PIL import Image
from scipy.io import loadmat
from studies import TABLE, crank_rockers, sweep_text

import explore
from explore.base.errors import RequestError, ResultsError
from explore.base.units.shown import read_shown_units
from explore.cli.commands.export import ENDINGS
from explore.figures.exporting import frames
from explore.figures.exporting.chosen import DesignOfParameters
from explore.figures.exporting.formats import _WRITERS
from explore.figures.exporting.sheet import draw_sheet

LINKS = {"crank": 40.0, "coupler": 170.0, "rocker": 60.0, "ground": 180.0}
SVG = "{http://www.w3.org/2000/svg}"

#: Studies of all kinds of entries: units, points, formulas, drawn values, a length solved for.
STUDIES = {
    "points": crank_rockers((38, 42), 170, (58, 64), '"18 cm"', speed='"40 rpm"')
    + """\
[points]
knife = { along = { min = 100, max = 130 }, across = "4 cm" }
[sampling]
method = "sobol"
count = 16
seed = 3
[evaluate]
window = { from = 10, to = 200 }
metrics = ["knife_x_peak_to_peak", "knife_velocity_max", "transmission_angle_min"]
tolerance = 1e-8
[metrics]
share = { formula = "knife_x_peak_to_peak / ground", unit = "1" }
[constraints]
transmission_angle_min = { min = "10 deg" }
[rank]
metrics = ["share:max"]
""",
    "solved": crank_rockers('{ solve = "swing_angle", value = "20 deg" }', [500.1, 520.7], 200, [480, 490.3])
    + """\
[evaluate]
metrics = ["swing_angle", "cv"]
""",
    "gears": """mechanism = "gears"
[parameters]
growth = [1.3, 1.44]
sector = [3.9, 4.2]
module = 2
""",
    "inches": """mechanism = "crank-rocker"
[parameters]
crank = ["4 in", "4.1 in"]
coupler = "37 in"
rocker = "22 in"
ground = "28.1 in"
opposing_torque = "9 in lbf"
[points]
tip = { along = "3.1 in", across = 0 }
[units]
length = "in"
torque = "in lbf"
""",
}


@pytest.fixture(scope="module")
def wiper(tmp_path_factory):
    """Files of one design with a point in all formats but films."""
    folder = tmp_path_factory.mktemp("wiper")
    paths = [folder / f"wiper{ending}" for ending in _WRITERS if ending != ".mp4"]
    explore.export("crank-rocker", paths, parameters=LINKS, points={"knife": (120.0, 40.0)})
    return folder


@pytest.mark.parametrize("name", STUDIES)
def test_the_study_of_one_design_computes_the_same_row(name, tmp_path):
    results = sweep_text(tmp_path, STUDIES[name], "all", workers=1)
    number = len(results) - 1
    explore.export(results, tmp_path / "one.toml", design=number)
    one = explore.sweep(explore.load_study(tmp_path / "one.toml"), tmp_path / "one.h5", workers=1)
    assert len(one) == 1
    assert one.objectives == results.objectives
    expected, row = results.designs([number]), one.designs([0])
    assert list(row) == list(expected)
    for column in expected:
        assert row[column].to_numpy().tobytes() == expected[column].to_numpy().tobytes(), column


def test_the_study_of_results_in_other_units_is_the_same(tmp_path):
    results = sweep_text(tmp_path, STUDIES["points"], "a", workers=1)
    units = {"a": {}, "b": {"length": "in", "angle": "rad", "speed": "rpm"}}
    for name, chosen in units.items():
        explore.export(results.in_units(read_shown_units(chosen)), tmp_path / f"{name}.one.toml", design=3)
    assert (tmp_path / "b.one.toml").read_text() == (tmp_path / "a.one.toml").read_text()


def test_the_study_of_parameters_has_them_exactly(wiper):
    study = explore.load_study(wiper / "wiper.toml")
    columns = study.space.designs(0, 1)
    assert study.space.n_designs == 1
    assert {name: float(values[0]) for name, values in columns.items()} == {
        **LINKS, "knife_along": 120.0, "knife_across": 40.0
    }  # fmt: skip


def motion():
    return explore.simulate("crank-rocker", LINKS, points={"knife": (120.0, 40.0)})


def test_csv_has_the_motion_to_the_last_bit_with_units(wiper):
    table = pd.read_csv(wiper / "wiper.csv")
    expected = motion()
    assert table["crank_angle [deg]"].to_list() == expected.index.to_list()
    for name, unit in expected.attrs["units"].items():
        assert np.array_equal(table[f"{name} [{unit}]"], expected[name]), name
    angle = np.deg2rad(expected["rocker_angle"])
    # some roundings of numbers up to 240
    assert table["rocker joint x [mm]"].to_numpy() == pytest.approx(
        (180.0 + 60.0 * np.cos(angle)).to_numpy(), abs=1e-12
    )
    assert table["rocker joint y [mm]"].to_numpy() == pytest.approx((60.0 * np.sin(angle)).to_numpy(), abs=1e-12)


def test_a_driven_link_named_crank_does_not_take_the_place_of_the_input_angle(tmp_path):
    text = TABLE.replace("crank = {", "arm = {").replace('driver = "crank"', 'driver = "arm"')
    sweep_text(tmp_path, text.replace("coupler = {", "crank = {"))
    run("export", "study.h5", "--design", "0", "-o", "motion.csv", cwd=tmp_path)
    table = pd.read_csv(tmp_path / "motion.csv")
    assert list(table["drive_angle [deg]"]) == list(range(len(table)))
    assert table["crank_angle [deg]"].between(30.0, 90.0).all()


def test_a_drawing_notes_speeds_as_the_study_gives_them_and_lengths_in_mm(tmp_path):
    results = sweep_text(tmp_path, STUDIES["points"], "a", workers=1)
    explore.export(results.in_units(read_shown_units({"length": "in"})), tmp_path / "a.svg", design=0)
    rocker = f"rocker {results.design(0)['rocker']:.10g} mm"
    texts = {text.text for text in ET.parse(tmp_path / "a.svg").iter(f"{SVG}text")}
    assert {"speed 40 rpm", rocker} < texts, texts


def test_hdf5_has_the_motion_with_units_and_meanings(wiper):
    expected = motion()
    with h5py.File(wiper / "wiper.hdf5") as file:
        assert file.attrs["mechanism"] == "crank-rocker"
        for name, unit in expected.attrs["units"].items():
            assert np.array_equal(file[f"motion/{name}"], expected[name])
            assert file[f"motion/{name}"].attrs["units"] == unit
        assert {place.attrs["units"] for place in file["points"].values()} == {"mm"}
        assert file["parameters/coupler"][()] == 170.0
        assert file["parameters/coupler"].attrs["long_name"] == "coupler length"
        # the drawing's vectors and the kernel, to some roundings of numbers below 200
        assert file["points/point knife"][:, 0] == pytest.approx(file["motion/knife_x"][:], abs=1e-12)


def test_mat_has_the_motion_with_units(wiper):
    content = loadmat(wiper / "wiper.mat", simplify_cells=True)
    expected = motion()
    for name, unit in expected.attrs["units"].items():
        assert np.array_equal(content["motion"][name], expected[name])
        assert content["units"][name] == unit
    assert content["parameters"]["rocker"] == 60.0
    assert content["points"]["rocker_joint"].shape == (360, 2)
    assert content["long_names"]["rocker_angle"] == "rocker angle"


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="needs GNU Octave")
def test_octave_loads_the_motion(wiper):
    program = (
        "load('wiper.mat'); printf('%.17g ', motion.rocker_angle(91), size(points.rocker_joint), parameters.ground);"
        "printf('%s|', units.rocker_velocity, long_names.rocker_angle, mechanism)"
    )
    done = subprocess.run(
        ["octave-cli", "--no-gui", "--eval", program], cwd=wiper, capture_output=True, text=True, timeout=240
    )
    assert done.returncode == 0, done.stderr
    *numbers, texts = done.stdout.split(" ", 4)
    assert [float(number) for number in numbers] == [motion()["rocker_angle"].iloc[90], 360, 2, 180]
    assert texts == "rad/s|rocker angle|crank-rocker|"


def test_gif_is_one_turn_that_begins_again_evenly(wiper):
    with Image.open(wiper / "wiper.gif") as gif:
        assert (gif.n_frames, gif.info["loop"], gif.info["duration"]) == (frames.POSITIONS, 0, 40)
        pictures = []
        for k in range(gif.n_frames):
            gif.seek(k)
            pictures.append(np.asarray(gif.convert("L"), dtype=float))
    steps = [np.abs(after - before).mean() for before, after in pairwise(pictures)]
    closing = np.abs(pictures[0] - pictures[-1]).mean()
    assert closing > 0.0, "the last picture repeats the first"
    # A step over the seam changes as much as any other; half a turn changes several times more.
    assert min(steps) <= closing <= max(steps)
    assert np.abs(pictures[0] - pictures[frames.POSITIONS // 2]).mean() > 1.5 * closing


def animations(path):
    """Attribute and values of each animation of an SVG."""
    root = ET.parse(path).getroot()
    assert not list(root.iter(f"{SVG}script"))
    for each in (*root.iter(f"{SVG}animate"), *root.iter(f"{SVG}animateTransform")):
        assert (each.get("repeatCount"), each.get("dur")) == ("indefinite", "4s")
        yield each.get("attributeName"), each.get("values").split(";")


def test_animated_svg_turns_without_scripts_and_closes(wiper):
    lengths = []
    for name, values in animations(wiper / "wiper.animated.svg"):
        assert values[0] == values[-1], name
        if name == "points":
            places = np.array([[point.split(",") for point in value.split()] for value in values], dtype=float)
            lengths.append(np.hypot(*(places[:, 1] - places[:, 0]).T))
    assert [float(length.mean()) for length in lengths[:3]] == pytest.approx([40, 170, 60], abs=1e-6)  # six decimals
    assert max(float(np.ptp(length)) for length in lengths) < 4e-6


def test_animated_gears_turn_rigidly_in_opposite_senses(tmp_path):
    explore.export("gears", tmp_path / "gears.animated.svg", parameters={"growth": 1.44})
    (first, one), (second, other) = animations(tmp_path / "gears.animated.svg")
    assert (first, second) == ("transform", "transform")
    driver, driven = np.array(one, dtype=float), np.array(other, dtype=float)
    # Clockwise is positive in SVG: gear 1 turns counter-clockwise, gear 2 with it the other way, once each.
    assert driver == pytest.approx(-np.linspace(0.0, 360.0, len(driver)), abs=1e-6)
    expected = explore.simulate("gears", {"growth": 1.44}, angles=np.linspace(0.0, 360.0, len(driver))[:-1])
    assert driven[:-1] == pytest.approx(expected["driven_angle"].to_numpy() % 360.0, abs=2e-6)
    assert driven[-1] == pytest.approx(360.0, abs=2e-6)


@pytest.mark.skipif(not frames.has_ffmpeg(), reason="needs ffmpeg")
def test_mp4_is_a_film_of_one_turn(tmp_path):
    explore.export("slider-crank", tmp_path / "film.mp4", parameters={"crank": 60, "rod": 200, "offset": 25})
    shown = subprocess.run(
        ["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames,pix_fmt", "-of", "csv=p=0",
         tmp_path / "film.mp4"], capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert shown.strip() == f"yuv420p,{frames.POSITIONS}"


def test_without_ffmpeg_a_film_is_refused_before_anything_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(RequestError, match="film.mp4: MP4 needs the program ffmpeg, which is not installed"):
        explore.export("crank-rocker", [tmp_path / "wiper.csv", tmp_path / "film.mp4"], parameters=LINKS)
    assert list(tmp_path.iterdir()) == []


def test_a_film_that_fails_says_why(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: "/bin/false")
    (tmp_path / "film.mp4").write_text("before")
    with pytest.raises(ResultsError, match="ffmpeg failed: no reason given"):
        explore.export("crank-rocker", tmp_path / "film.mp4", parameters=LINKS)
    assert [file.read_text() for file in tmp_path.iterdir()] == ["before"]


def test_the_best_design_is_the_default_and_results_are_never_overwritten(few, tmp_path):
    results = explore.open_results(few)
    best = int(explore.rank(results).index[0])
    explore.export(few, tmp_path / "best.toml")
    explore.export(results, tmp_path / "same.toml", design=best)
    assert (tmp_path / "best.toml").read_text() == (tmp_path / "same.toml").read_text()
    with pytest.raises(explore.RequestError, match="same.toml exists; a study is not overwritten, so name another"):
        explore.export(few, tmp_path / "same.toml")
    copy = tmp_path / "copy.csv"
    copy.write_bytes(few.read_bytes())
    with pytest.raises(RequestError, match="is the results file itself; name another file"):
        explore.export(copy, copy)
    assert copy.read_bytes() == few.read_bytes()


def test_a_mechanism_without_a_drawing_has_none_to_export():
    simulated = DesignOfParameters.read("gears", {"growth": 1.44}, {}).simulated
    without = replace(simulated, mechanism=replace(simulated.mechanism, drawing=None))
    with pytest.raises(RequestError, match="'gears' declares no drawing; draw or export its motion instead"):
        draw_sheet(without)


def test_a_design_without_its_solved_length_is_refused(tmp_path):
    results = sweep_text(tmp_path, STUDIES["solved"].replace("20 deg", "170 deg"), "a", workers=1)
    with pytest.raises(explore.MotionError, match="design 0 has no crank: "):
        explore.export(results, tmp_path / "b.toml", design=0)
    assert not (tmp_path / "b.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("crank-rocker", "a.step", {"parameters": LINKS}),
            "a.step: the name must end in .* or .mp4",
        ),
        (("crank-rocker", "a.dxf", {"parameters": {**LINKS, "crank": 400.0}}), "no full turn to simulate"),
        (("crank-rocker", "a.dxf", {"parameters": {"crank": 40}}), "crank-rocker needs coupler, rocker, ground"),
        (("crank-rocker", "a.dxf", {"parameters": LINKS, "design": 1}), "a number chooses a design of results"),
        (("some.h5", "a.dxf", {"points": {"knife": (1, 2)}}), "results have their own"),
        (("no_such.h5", "a.dxf", {}), "no_such.h5"),
    ],
)
def test_refused_requests_write_nothing(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    source, path, options = arguments
    with pytest.raises(explore.ExploreError, match=message):
        explore.export(source, path, **options)
    assert list(tmp_path.iterdir()) == []


def test_the_command_takes_the_formats_of_the_library():
    assert set(ENDINGS) == {f".{ending.rsplit('.', 1)[1]}" for ending in _WRITERS}


def test_the_command_writes_several_files_of_the_newest_results(in_results):
    output = run("export", "--design", "1", "-o", "one.toml", "-o", "one.CSV", cwd=in_results)
    assert output.stdout == ""
    said = output.stderr.splitlines()[-3:]  # slow machines say first that they compile
    assert said == ["design 1 of results/small.h5", "wrote one.toml", "wrote one.CSV"]
    assert (in_results / "one.toml").read_text().startswith("# Design 1 of small.h5\n")
    assert len((in_results / "one.CSV").read_text().splitlines()) == 361


def test_the_command_takes_a_mechanism_with_units_and_points(tmp_path):
    settings = [part for name, value in LINKS.items() for part in ("--set", f"{name}={value / 10} cm")]
    run("export", "--mechanism", "crank-rocker", *settings, "--point", "knife=120,40", "-o", "a.hdf5", cwd=tmp_path)
    with h5py.File(tmp_path / "a.hdf5") as file:
        assert np.array_equal(file["motion/knife_x"], motion()["knife_x"])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("", "name a file: -o wiper.dxf, and others by -o again"),
        ("-o a.h5", "-o a.h5: the name must end in .toml, .csv, .hdf5, .mat, .dxf, .svg, .gif or .mp4"),
        ("-o a.step", "-o a.step: there are no solids to write; .dxf has the drawing for a sketch in CAD"),
        ("-o nowhere/a.dxf", "-o nowhere/a.dxf: there is no folder nowhere"),
        ("-o a.dxf", "no results yet"),
        ("-o a.dxf --set crank=4", "--set and --point are those of a --mechanism"),
        ("-o a.dxf --mechanism gears --design 3", "leave out RESULTS and --design"),
    ],
)
def test_bad_commands_give_one_line(words, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert_refused(call("export", *words.split()), 2 if "no results" not in message else 1, message)
