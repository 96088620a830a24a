"""Tables of designs, and messages about invalid ones."""

import csv
import math
import os
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import explore
from explore.base.errors import ConfigError, ResultsError
from explore.studies.config import table_file
from explore.studies.config.study_file import load_study
from explore.studies.designs.spaces import ListedAxis

HEADER = "crank,coupler,rocker,ground"
ROW = "100,1000,500,700"
STUDY = """\
mechanism = "crank-rocker"
[sampling]
method = "table"
file = "designs.csv"
"""


@pytest.fixture
def table(load):
    """Load a study of a table with this content, text or bytes."""

    def load_table(content, study=STUDY):
        Path("designs.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
        return load(study)

    return load_table


@pytest.fixture
def wrong(table):
    """Problems of a study of a table with this content."""

    def problems_of(content, study=STUDY):
        with pytest.raises(ConfigError) as caught:
            table(content, study)
        return caught.value.problems

    return problems_of


def designs(study):
    return {name: column.tolist() for name, column in study.space.designs(0, study.space.n_designs).items()}


# Good tables


def test_designs_are_the_rows_in_the_order_of_the_file(table):
    study = table("ground, rocker ,crank,coupler\n700,500,100,1000\n7e2,5.5,.1,1000.25\n")
    assert (study.space.method, study.space.n_designs, study.space.seed) == ("table", 2, 0)
    assert designs(study) == {
        "crank": [100.0, 0.1],
        "coupler": [1000.0, 1000.25],
        "rocker": [500.0, 5.5],
        "ground": [700.0, 700.0],
    }
    assert study.space.swept_parameters == ("crank", "coupler", "rocker")


@pytest.mark.parametrize(
    "content",
    [
        f"\ufeff{HEADER},speed\n{ROW},2\n",
        f"{HEADER},speed\r\n{ROW},2\r\n",
        f"{HEADER},speed\r{ROW},2\r",
        f"{HEADER},speed\n\n{ROW},2\n\n   \n",
        f"\n{HEADER},speed\n{ROW},2",
        " crank , coupler,rocker,ground,\tspeed\n 100 ,1e3,+500,700.0, 2 \n",
        '"crank","coupler","rocker","ground","speed"\n"100","1000","500","700","2"\n',
        f"{HEADER},speed\n10 cm,1 m,500 mm,700, 2 rad/s\n",
        f'{HEADER},speed\n"10 cm","1 m","500 mm",700,"2 rad/s"\n',
        f"speed,{HEADER}\n2,{ROW}\n",
    ],
)
def test_ways_of_writing_make_no_difference(table, content):
    study = table(content)
    assert designs(study) == {
        "crank": [100.0], "coupler": [1000.0], "rocker": [500.0], "ground": [700.0], "speed": [2.0],
    }  # fmt: skip
    assert study.sha256 == table(f"{HEADER},speed\n{ROW},2\n").sha256


def test_units_are_exact(table):
    study = table(f"{HEADER},speed\n{ROW},40 rpm\n{ROW},7\n{ROW},40 rpm\n")
    assert designs(study)["speed"] == [4.188790204786391, 7.0, 4.188790204786391]  # 4 pi / 3, rounded once


def test_single_values_in_parameters_belong_to_every_design(table):
    study = table(
        "crank,coupler\n100,1000\n101,1001\n", STUDY + "[parameters]\nrocker = '50 cm'\nground = 700\nphases = 2\n"
    )
    assert [axis.name for axis in study.space.axes] == ["crank", "coupler", "rocker", "ground", "phases"]
    assert study.space.axes[2] == ListedAxis("rocker", (500.0,))
    assert designs(study)["rocker"] == [500.0, 500.0]
    assert designs(study)["phases"] == [2.0, 2.0]


def test_the_hash_follows_the_values_not_the_file(table, load):
    first = table(f"{HEADER}\n{ROW}\n101,1000,500,700\n")
    Path("sub folder").mkdir()
    Path("sub folder/other.csv").write_text("ground,crank,rocker,coupler\n700.0,10 cm,500,1000\n700,101.0,500,1e3\n")
    assert load(STUDY.replace("designs", "sub folder/other")).sha256 == first.sha256

    others = [
        f"{HEADER}\n101,1000,500,700\n{ROW}\n",
        f"{HEADER}\n{ROW}\n",
        f"{HEADER}\n{ROW}\n101.00000000000001,1000,500,700\n",
    ]
    others += [
        f"{HEADER},speed\n{ROW},1\n101,1000,500,700,1\n",
        f"coupler,crank,rocker,ground\n{ROW}\n101,1000,500,700\n",
    ]
    hashes = {table(content).sha256 for content in others}
    assert len(hashes | {first.sha256}) == 6


@pytest.mark.parametrize("name", ["../designs.csv", "a b/Entwürfe é.csv", "./a b/../x.csv", "absolute"])
def test_names_start_at_the_folder_of_the_study_file(tmp_path, monkeypatch, name):
    (tmp_path / "study/a b").mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    name = str(tmp_path / "any.csv") if name == "absolute" else name
    (tmp_path / "study" / name).write_text(f"{HEADER}\n{ROW}\n")
    (tmp_path / "study/study.toml").write_text(STUDY.replace("designs.csv", name), encoding="utf-8")
    assert load_study("../study/study.toml").space.n_designs == 1


@settings(max_examples=50, derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.lists(st.lists(st.floats(5e-324, 1.7e308), min_size=4, max_size=4), min_size=1, max_size=20))
def test_every_double_comes_back_exactly(tmp_path, rows):
    file = tmp_path / "designs.csv"
    with file.open("w", newline="") as stream:
        csv.writer(stream).writerows([HEADER.split(","), *rows])
    (tmp_path / "study.toml").write_text(STUDY)
    columns = load_study(tmp_path / "study.toml").space.designs(0, len(rows))
    np.testing.assert_array_equal(np.column_stack(list(columns.values())), rows)


def test_a_table_is_swept_and_one_with_other_values_is_refused(table):
    study = table(f"{HEADER}\n{ROW}\n" + "".join(f"{100 + n},1000,500,700\n" for n in range(70_000)))
    explore.sweep(study, "out.h5")
    frame = explore.read_results("out.h5")
    np.testing.assert_array_equal(frame["crank"], [100, *range(100, 70_100)])
    with pytest.raises(ResultsError, match="sampling: other designs"):
        explore.sweep(table(f"{HEADER}\n" + f"{ROW}\n" * 70_001), "out.h5")


# Wrong tables


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", ["1: is empty; begin with a header line, such as crank,coupler,rocker,ground"]),
        (HEADER, ["1: has no designs; add a line of values below the header"]),
        (f"{ROW}\n", ["1: the first line must name the parameters, but it holds numbers; add a header line"]),
        (
            f"{HEADER}\n{ROW}\n".replace(",", ";"),
            ["1: cells are separated by semicolons; save it with commas between cells and decimal points"],
        ),
        (
            f"{HEADER}\n{ROW}\n".replace(",", "\t"),
            ["1: cells are separated by tabs; save it with commas between cells and decimal points"],
        ),
        (f"\n{HEADER},spede\n{ROW},1\n", ["2: spede: unknown parameter; did you mean 'speed'?"]),
        (
            f"{HEADER},xyz\n{ROW},1\n",
            ["1: xyz: unknown parameter; available: crank, coupler, rocker, ground, phases, branch, "],
        ),
        (f"{HEADER},\n{ROW},\n", ["1: column 5: has no name; name it or remove the column"]),
        (f"{HEADER},crank\n{ROW},1\n", ["1: crank: the column occurs twice; remove one"]),
        (
            "crank,coupler\n1,2\n",
            ["1: missing rocker, ground; add a column, or one value for all designs to the parameters"],
        ),
        (f"{HEADER}\n{ROW}\n1,2,3\n", ["3: has 3 cells, but the header has 4; write one for each column"]),
        (f"{HEADER}\n{ROW},5\n{ROW}\n", ["2: has 5 cells, but the header has 4; write one for each column"]),
        (f"{HEADER}\n\n1\n", ["3: has 1 cell, but the header has 4; write one for each column"]),
        (f"{HEADER}\n1,,3,4\n", ["2: coupler: the cell is empty; write a number, or remove the line"]),
        (f"{HEADER}\n1,nan,3,inf\n", ["2: coupler: nan is not a finite", "2: ground: inf is not a finite"]),
        (f"{HEADER}\n1,0,-3,4\n", [
            "2: coupler: must be greater than 0 mm, got 0.0", "2: rocker: must be greater than 0 mm, got -3.0",
        ]),
        (f"{HEADER},phases\n{ROW},2.5\n", ["2: phases: must be a whole number from 1 to 12, got 2.5"]),
        (f"{HEADER}\n1,2,abc,4\n", ["2: rocker: 'abc' is not a number with a unit, such as \"10 mm\""]),
        (f'{HEADER}\n1,2,"5,5",4\n', ["2: rocker: '5,5' is not a number with a unit; write decimals with a point"]),
        (f"{HEADER}\n1_0,2,3,4\n", ["2: crank: '1_0' is not a number with a unit, such as \"10 mm\""]),
        (f"{HEADER}\n1,2,3 kg,4\n", ["2: rocker: 'kg' cannot be converted to 'mm'; use mm, cm, m or in"]),
    ],
)  # fmt: skip
def test_wrong_tables(wrong, content, expected):
    lines = wrong(content)
    assert len(lines) == len(expected)
    for line, start in zip(lines, expected, strict=True):
        assert line.startswith(f"designs.csv:{start}")


def test_units_in_the_header(table, wrong):
    study = table("crank [in],rocker,coupler [ m ],ground\n4,500,1,700\n0.5,20 in,10 mm,700\n")
    assert designs(study) == {
        "crank": [101.6, 12.7], "coupler": [1000, 10], "rocker": [500, 508], "ground": [700, 700],
    }  # fmt: skip
    for heading, reason in (
        ("crank [deg]", "'deg' cannot be converted to 'mm'; use mm, cm, m or in"),
        ("crank [inn]", "unknown unit 'inn'; did you mean 'in'?"),
    ):
        (line,) = wrong(f"{heading},coupler,rocker,ground\n{ROW}\n")
        assert line == f"designs.csv:1: crank: {reason}"
    (line,) = wrong("crank [in],coupler,rocker,ground\nnan,2,3,4\n")
    assert line == "designs.csv:2: crank: nan is not a finite number"


def test_text_that_is_not_csv(wrong):
    (problem,) = wrong(f'{HEADER}\n1,"2,3,4\n')
    assert re.match(r"designs.csv:\d: not CSV: .*; check the quotation marks", problem)
    (problem,) = wrong(f'{HEADER}\n1,"2"3,4,5\n')
    assert re.match(r"designs.csv:2: not CSV: ", problem)
    # a quotation mark left open that a later one closes
    (problem,) = wrong(f'{HEADER}\n\n{ROW}\n1,"2,3,4\n{ROW}\n1,2",3,4\n{ROW}\n')
    assert problem == "designs.csv:4: a cell continues on the next line; check for an unclosed quotation mark"


def test_all_problems_at_once_in_the_order_of_the_lines_after_those_of_the_study(wrong):
    content = f"{HEADER},spede\n{ROW},1\n1,x,0,4,1\n1,2,3\n1,2,3,nan,y\n"
    lines = wrong(content, STUDY + 'seed = 3\n[evaluate]\nmetrics = ["foo"]\n')
    assert [problem.split(": ")[:2] for problem in lines] == [
        ["study.toml:5", "sampling.seed"],
        ["study.toml:7", "evaluate.metrics"],
        ["designs.csv:1", "spede"],
        ["designs.csv:3", "coupler"],
        ["designs.csv:3", "rocker"],
        ["designs.csv:4", "has 3 cells, but the header has 5; write one for each column"],
        ["designs.csv:5", "ground"],
    ]


def test_a_long_list_of_problems_is_cut(wrong):
    lines = wrong(f"{HEADER}\n" + "1,x,3,4\n" * 30 + f"{ROW}\n")
    assert [line.split(":")[1] for line in lines[:-1]] == [str(n) for n in range(2, 22)]
    assert lines[-1] == "designs.csv: and 10 more"
    # exactly as many as are shown
    assert len(wrong(f"{HEADER}\n" + "1,x,3,4\n" * 20)) == 20


def test_reading_a_file_full_of_mistakes_stops_early(wrong):
    lines = wrong(f"{HEADER}\n" + "1,2,3,4 furlongz\n" * 200_000)
    assert len(lines) == 21
    assert lines[-1].startswith("designs.csv: and at least ")
    assert int(lines[-1].split()[-2].replace(",", "")) < 100_000


def test_lines_are_right_beyond_the_first_pieces(wrong):
    n = 3 * table_file._ROWS_AT_A_TIME
    assert wrong(f"{HEADER}\n\n" + f"{ROW}\n" * n + "1,2,3,-4\n") == [
        f"designs.csv:{n + 3}: ground: must be greater than 0 mm, got -4.0"
    ]


@pytest.mark.parametrize(
    ("entry", "key"),
    [
        ("crank = [1, 2]", "crank"),
        ("crank = [1]", "crank"),
        ("crank = { start = 1, stop = 2, num = 3 }", "crank"),
        ("crank = { min = 1, max = 2 }", "crank"),
    ],
)
def test_parameters_beside_a_table_have_one_value(wrong, entry, key):
    (problem,) = wrong("coupler,rocker,ground\n1,2,3\n", f"{STUDY}[parameters]\n{entry}\n")
    assert problem.startswith(f"study.toml:6: parameters.{key}: must be one value, because a table lists the designs; ")


def test_a_parameter_in_both_places(wrong):
    assert wrong(f"{HEADER}\n{ROW}\n", STUDY + "[parameters]\ncrank = 100\n") == [
        "designs.csv:1: crank: is also among the parameters; remove it there or remove this column"
    ]


def test_wrong_parameters_beside_a_table(wrong):
    lines = wrong(f"{HEADER}\n{ROW}\n", STUDY + "[parameters]\nspeed = -1\nspede = 3\n")
    assert [problem.split(": ")[:2] for problem in lines] == [
        ["study.toml:6", "parameters.speed"],
        ["study.toml:7", "parameters.spede"],
    ]


# Files that cannot be read


def reason_of(problems):
    """The one problem, which stands at sampling.file."""
    (problem,) = problems
    assert problem.startswith("study.toml:4: sampling.file: ")
    return problem.removeprefix("study.toml:4: sampling.file: ")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (f"{HEADER}\n{ROW}\n".encode("utf-16"), "is not UTF-8 text; save it as CSV in UTF-8"),
        (f"{HEADER}\n{ROW}\n".encode() + b"1,2,3,\xff\n", "is not UTF-8 text; save it as CSV in UTF-8"),
        (f"{HEADER}\n".encode() + f"{ROW}\n".encode() * 20_000 + b"\xff\n", "is not UTF-8 text"),
        (b"PK\x03\x04\x14\x00\x06\x00\x08\x00\x00\x00!\x00\xb5\xfd\x8c", "is not UTF-8 text"),  # a spreadsheet
    ],
)
def test_files_that_are_not_text(wrong, content, reason):
    assert reason_of(wrong(content)).startswith(reason)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("none.csv", "no such file: /"),
        ("", "is a folder, not a table"),
        (".", "is a folder, not a table"),
        ("/dev/zero", "is not a regular file"),
        ("pipe", "is not a regular file"),
        ("study.toml/x", "cannot be read: Not a directory"),
        ("x" * 300, "cannot be read: File name too long"),
        ("a\\u0000b", "is not a valid file name"),
    ],
)
def test_files_that_cannot_be_opened(problems, tmp_path, name, reason):
    os.mkfifo(tmp_path / "pipe")
    assert reason_of(problems(STUDY.replace("designs.csv", name))).startswith(reason)


def test_a_forbidden_file(unprivileged):
    folder, lower = unprivileged
    (folder / "study.toml").write_text(STUDY)
    (folder / "designs.csv").touch(mode=0)
    lower()
    with pytest.raises(ConfigError, match="sampling.file: .*cannot be read: Permission denied"):
        load_study(folder / "study.toml")


def test_too_many_rows(wrong, table, monkeypatch):
    assert table_file.MOST_TABLE_ROWS == 10**7
    monkeypatch.setattr(table_file, "MOST_TABLE_ROWS", 10_000)  # the real limit takes half a minute to reach
    assert table(f"{HEADER}\n" + f"{ROW}\n" * 10_000).space.n_designs == 10_000
    reason = reason_of(wrong(f"{HEADER}\n" + f"{ROW}\n" * 10_001))
    assert reason == "has more than 10000 rows, the limit of a table; split it"


@settings(max_examples=300, derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    st.one_of(
        st.binary(max_size=60),
        st.text(max_size=60).map(str.encode),
        st.lists(
            st.sampled_from(
                [HEADER, ROW, "\n", "\r", ",", '"', "nan", "1e5", "4 rpm", ";", " ", "\0", "x", "speed", "é"]
            ),
            max_size=30,
        ).map(lambda pieces: "".join([HEADER, *pieces]).encode()),
    )
)
def test_anything_else_is_a_study_or_config_errors_of_one_line(tmp_path, content):
    (tmp_path / "designs.csv").write_bytes(content)
    (tmp_path / "study.toml").write_text(STUDY)
    lines, columns = [], {}
    try:
        space = load_study(tmp_path / "study.toml").space
        columns = space.designs(0, space.n_designs)
    except ConfigError as error:
        lines = error.problems
    start = (f"{tmp_path / 'study.toml'}:4: sampling.file: ", "designs.csv:")
    assert all(problem.startswith(start) and problem.isprintable() for problem in lines)
    assert bool(lines) != bool(columns)
    assert all(np.isfinite(column).all() and len(column) for column in columns.values())


def test_the_sum_of_lengths_keeps_its_last_bit(table):
    # 150 + 1083.4236 = 541.7118 + 691.7118 in doubles, as a table gives them
    lengths = designs(table(f"{HEADER}\n150,1083.4236,541.7118,691.7118\n"))
    assert math.fsum([lengths["crank"][0], lengths["coupler"][0]]) == lengths["rocker"][0] + lengths["ground"][0]
