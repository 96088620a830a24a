"""Files of points, poses and pairs: the same rows for a study and for a task, or the same refusal with its place."""

import math

import pytest

import explore
from explore.base.errors import ConfigError, RequestError
from explore.studies.request.names import find_mechanism
from explore.synthesis.tasks.task_files import parse_task

#: A file, and its points in mm and crank angles in deg, or what is said of it after its name.
PATHS = {
    "positions": ("0,0\n1.5,2\n3,0\n", [[0, 0], [1.5, 2], [3, 0]], []),
    "positions with angles": ("0,0,0\n1.5,2,40\n3,0,90\n", [[0, 0], [1.5, 2], [3, 0]], [0, 40, 90]),
    "a heading": ("x,y\n0,0\n1.5,2\n3,0\n", [[0, 0], [1.5, 2], [3, 0]], []),
    "angles first": ("crank_angle,x,y\n0,5,6\n40,7,8\n90,9,6\n", [[5, 6], [7, 8], [9, 6]], [0, 40, 90]),
    "y before x": ("y,x\n6,5\n8,7\n6,9\n", [[5, 6], [7, 8], [9, 6]], []),
    "capital letters and quotes": ('"Y", "X"\n6,5\n"8", "7"\n6,9\n', [[5, 6], [7, 8], [9, 6]], []),
    "units in the heading": ("x [in],y [cm],crank_angle [rad]\n0,1,0\n1,2,1\n2,1,2\n",
                             [[0, 10], [25.4, 20], [50.8, 10]], [0, math.degrees(1), math.degrees(2)]),
    "units in cells": ("0 in,0,0\n1 in,2,1 rad\n3,0,90\n", [[0, 0], [25.4, 2], [3, 0]], [0, math.degrees(1), 90]),
    "a unit in a cell below another": ("x [in],y\n0,0\n1 cm,2\n3,0\n", [[0, 0], [10, 2], [76.2, 0]], []),
    "decimal commas": ("x;y\n0;0\n1,5;2\n3;0,25\n", [[0, 0], [1.5, 2], [3, 0.25]], []),
    "decimal commas with units": ("0;0\n1,5 cm;2\n3;0\n", [[0, 0], [15, 2], [3, 0]], []),
    "tabs": ("0\t0\n1,5\t2\n3\t0\n", [[0, 0], [1.5, 2], [3, 0]], []),
    "comments, empty lines, a mark and other line ends": (
        "\ufeff# drawn by hand\r\nx,y\r\n\r\n0,0\r\n  # half way, with a comma\r\n1.5,2\r\n,\r\n3,0\r\n",
        [[0, 0], [1.5, 2], [3, 0]], []),
    "no number at the top": ("nan,0\n1.5,2\n3,0\n", ":1: column 1 (x): nan is not a finite number"),
    "a word at the top": ("zero,0\n1.5,2\n3,0\n", ":1: column 1 (x): 'zero' is not a number with a unit"),
    "an unknown column": ("t,x,y\n0,1,2\n1,2,3\n2,3,4\n", ":1: column 1: unknown column 't'; available: x, y"),
    "a misspelt column": ("x,y,crankangle\n0,1,2\n1,2,3\n", ":1: column 3: unknown column 'crankangle'; did you mean"),
    "a column without a name": ("x,y,\n0,1,2\n1,2,3\n", ":1: column 3: has no name"),
    "a column twice": ("x,y,X\n0,1,2\n1,2,3\n", ":1: column 3: x occurs twice"),
    "a missing column": ("x,crank_angle\n0,1\n1,2\n2,3\n", ":1: the heading lacks y"),
    "an angle for a length": ("x [deg],y\n0,1\n1,2\n2,3\n", ":1: column 1 (x): 'deg' cannot be converted to 'mm'"),
    "an expression for a unit": ("x [10**10**10],y\n0,1\n1,2\n", ":1: column 1 (x): '1 10**10**10' is not a number"),
    "a length for an angle": ("0,0,1 mm\n1,1,2\n2,0,3\n", ":1: column 3 (crank_angle): 'mm' cannot be converted to"),
    "a line too short": ("x,y\n0,0\n1\n2,0\n", ":3: has 1 column, but the first has 2"),
    "decimal commas between commas": ("0,5,0,5\n1,5,2,0\n", ":1: has 4 columns; write x,y or x,y,crank_angle"),
    "one column": ("0 0\n1 2\n3 0\n", ":1: has 1 column; write x,y or x,y,crank_angle in every line"),
    "an empty cell": ("0,0\n1,\n2,0\n", ":2: column 2 (y): the cell is empty; write a number"),
    "both decimal marks": ("0,5;1\n1.234;2\n2;3\n", ":2: column 1 (x): '1.234' has '.', but that of line 1 has ','"),
    "thousands": ("0;1\n1.234,5;2\n2;3\n", ":2: column 1 (x): '1.234,5' is not a number"),
    "underscores": ("0,0\n1_0,1\n2,0\n", ":2: column 1 (x): '1_0' is not a number"),
    "a huge number": ("0,0\n1,1e999999999\n2,0\n", ":2: column 2 (y): inf is not a finite number"),
    "an open quotation mark": ('0,0\n"1,1\n2,0\n', ":2: not CSV: unexpected end of data; check the quotation marks"),
    "nothing": ("\n# nothing\n", " is empty; write x,y or x,y,crank_angle in every line"),
    "a heading only": ("x,y\n", " has no rows below its heading"),
    "too many points": ("0,0\n1,1\n" * 500, " has 1,000 rows, but at most 500 are possible; keep every 2th"),
    "too many bytes": ("0.12345,0.54321\n" * 1_100_000,
                       " has 17,600,000 bytes; at most 500 rows are possible, thin it"),
}  # fmt: skip


def of_study(folder, kind, file="path.csv"):
    """The target of a study with a file."""
    return find_mechanism("crank-rocker", ("M",), {"kind": kind, "file": str(folder / file)}).target


def of_task(folder, task="path", file="path.csv", more=""):
    """A task with a file."""
    return parse_task(f'task = "{task}"\n[target]\nfile = "{file}"\n{more}', "task.toml", folder).task


@pytest.mark.parametrize("name", [name for name, trial in PATHS.items() if len(trial) == 3])
def test_a_study_and_a_task_read_the_same_points(tmp_path, name):
    text, points, angles = PATHS[name]
    (tmp_path / "path.csv").write_text(text, encoding="utf-8", newline="")
    target, task = of_study(tmp_path, "path"), of_task(tmp_path)
    assert [list(place) for place in target.points] == task.target["points"] == points
    assert list(target.crank_angles) == pytest.approx(angles, rel=1e-15)  # of a radian, rounded twice
    timed = task.find.__self__.crank_angles
    assert (timed is None) == (not angles)
    assert not angles or timed.tolist() == [math.radians(angle) for angle in target.crank_angles]


@pytest.mark.parametrize("name", [name for name, trial in PATHS.items() if len(trial) == 2])
def test_a_study_and_a_task_refuse_the_same_files(tmp_path, name):
    text, reason = PATHS[name]
    (tmp_path / "path.csv").write_text(text, encoding="utf-8", newline="")
    with pytest.raises(RequestError) as of_a_study:
        of_study(tmp_path, "path")
    with pytest.raises(ConfigError) as of_a_task:
        of_task(tmp_path)
    said = str(of_a_study.value)
    assert said.startswith(f"target.file: {tmp_path / 'path.csv'}{reason}")
    assert of_a_task.value.problems == [f"task.toml:3: {said.replace(str(tmp_path) + '/', '')}"]


@pytest.mark.parametrize(
    ("file", "reason"),
    [("none.csv", "no such file: "), (".", ". is not a file"), ("a\x00b", "no such file: "),
     ("word.csv", "word.csv is not UTF-8 text; save it as CSV in UTF-8")],
)  # fmt: skip
def test_files_that_cannot_be_read(tmp_path, file, reason):
    (tmp_path / "word.csv").write_bytes(b"\xff\xfe0\x00")
    with pytest.raises(ConfigError) as caught:
        of_task(tmp_path, file=file.replace("\x00", "\\u0000"))
    (line,) = caught.value.problems
    assert line.startswith(f"task.toml:3: target.file: {reason}")


def test_what_a_file_gives_is_not_given_twice(tmp_path):
    (tmp_path / "path.csv").write_text("0,0,0\n1,2,10\n3,0,20\n")
    for more, said in (
        ("crank_angles = [0, 10, 20]", "target.crank_angles: the file has a column crank_angle"),
        ("points = [[0, 0], [1, 2], [3, 0]]", "target.file: 'points' and 'file' are given; leave out one of the two"),
    ):
        with pytest.raises(ConfigError, match=said):
            of_task(tmp_path, more=more)


def test_poses_of_a_file(tmp_path):
    """By name and by position, of a study and of a task, which both say what is wrong with a row."""
    poses = [[0.0, 0.0, 0.0], [10.0, 25.4, 5.0], [12.0, 8.0, 15.0], [5.0, 12.0, 25.0]]
    for text in (
        "0,0,0\n10,1 in,5\n12,8,15\n5,12,25\n",
        "angle;y;x\n0;0;0\n5;25,4;1 cm\n15;8,0;12\n25;12,0;5\n",
    ):
        (tmp_path / "poses.csv").write_text(text)
        assert [list(pose) for pose in of_study(tmp_path, "poses", "poses.csv").poses] == poses
        assert of_task(tmp_path, "motion", "poses.csv").target["poses"] == [pytest.approx(pose) for pose in poses]
    for text, reason in (
        ("x,y\n0,0\n1,1\n2,0\n", "poses.csv:1: the heading lacks angle; write x,y,angle"),
        ("0,0\n1,1\n2,0\n", "poses.csv:1: has 2 columns; write x,y,angle in every line"),
        ("0,0,0\n1,1,1 mm\n2,0,2\n", "poses.csv:2: column 3 (angle): 'mm' cannot be converted to 'deg'"),
    ):
        (tmp_path / "poses.csv").write_text(text)
        with pytest.raises(ConfigError) as caught:
            of_task(tmp_path, "motion", "poses.csv")
        assert str(caught.value).startswith(f"task.toml:3: target.file: {reason}")
        with pytest.raises(RequestError) as refused:
            of_study(tmp_path, "poses", "poses.csv")
        assert reason in str(refused.value)
    (tmp_path / "poses.csv").write_text("0,0,0\n1,1,1\n1,1,1\n")
    with pytest.raises(ConfigError, match=r"task.toml:3: target.file: poses 2 and 3 are alike"):
        of_task(tmp_path, "motion", "poses.csv")


def test_functions_of_a_file(tmp_path):
    """Of a study in angles, of a task in plain numbers."""
    (tmp_path / "f.csv").write_text("output,input\n0,0\n12,30\n31,1 rad\n")
    target = of_study(tmp_path, "function", "f.csv")
    assert target.table == ((0.0, 0.0), (30.0, 12.0), (pytest.approx(math.degrees(1)), 31.0))
    (tmp_path / "f.csv").write_text("y,x\n0,1\n0.176,1.5\n0.301,2\n")
    turns = "input_angle = 60\noutput_angle = 90\n"
    of_file = of_task(tmp_path, "function", "f.csv", turns)
    text = f'task = "function"\n[target]\ntable = [[1, 0], [1.5, 0.176], [2, 0.301]]\n{turns}'
    assert of_file.target == parse_task(text, "task.toml").task.target
    (tmp_path / "f.csv").write_text("x [mm],y\n0,1\n1,1\n2,2\n")
    with pytest.raises(ConfigError, match=r"target.file: f.csv:1: column 1 \(x\): 'mm' cannot be converted to '1'"):
        of_task(tmp_path, "function", "f.csv", turns)


def test_a_study_file_finds_its_file_of_poses(tmp_path):
    (tmp_path / "poses.csv").write_text("x,y,angle\n0,0,0\n10,0,5\n12,8,15\n")
    (tmp_path / "study.toml").write_text(
        'mechanism = "crank-rocker"\n[points]\nM = { along = 5, across = 5 }\n[target]\nkind = "poses"\n'
        'file = "poses.csv"\n[parameters]\ncrank = [10, 20]\ncoupler = 60\nrocker = 50\nground = 55\n'
    )
    study = explore.load_study(tmp_path / "study.toml")
    assert study.request.mechanism.target.poses == ((0.0, 0.0, 0.0), (10.0, 0.0, 5.0), (12.0, 8.0, 15.0))
