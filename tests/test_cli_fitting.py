"""Tables that fit: no number is cut, and every column that is not there is named."""

import random
import re

import pytest
from command_line import call, succeed

import explore
from explore.cli.tables import lay_out, print_table
from explore.studies.request.names import find_mechanism

COLUMNS = [("design", ""), ("alike", ""), ("crank", "mm"), ("speed", "rad/s"), ("rocker_acceleration_max", "rad/s^2"),
           ("transmission_angle_min", "deg"), ("cv", "")]  # fmt: skip


def rows(count):
    return [[str(213_261 + k), "1", f"{180 + k}", "4.18879", f"{10.2239 + k:.6g}", f"{30.1234 + k:.6g}", "0.45423"]
            for k in range(count)]  # fmt: skip


def print_lines(capsys, monkeypatch, width, *arguments, **options):
    """The lines of a table on a terminal of so many letters."""
    monkeypatch.setenv("COLUMNS", str(width))
    print_table("heading", *arguments, **options)
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize("count", [1, 2, 3, 10])
@pytest.mark.parametrize("width", [200, 90, 80, 70, 60, 50, 40, 30])
def test_numbers_are_not_cut_and_columns_are_shown_or_named(capsys, monkeypatch, width, count):
    droppable = ["alike", "speed", "crank", "transmission_angle_min", "rocker_acceleration_max"]

    lines = print_lines(
        capsys, monkeypatch, width, COLUMNS, rows(count), droppable=droppable, hint="-o FILE.csv writes all"
    )

    table = [line for line in lines if "left out" not in line]
    assert max(map(len, table)) <= width
    note = "".join(line for line in lines if "left out" in line)
    match = re.fullmatch(r"\d columns? left out: (.*); -o FILE.csv writes all", note)
    left_out = match[1].split(", ") if match else []
    assert set(left_out) <= set(droppable)
    cells = " ".join(table).split()
    for row in rows(count):
        for (name, _), cell in zip(COLUMNS, row, strict=True):
            assert name in left_out or cell in cells
    assert width < 80 or not left_out


def test_few_rows_are_transposed(capsys, monkeypatch):
    assert print_lines(capsys, monkeypatch, 60, COLUMNS, rows(2)) == [
        "heading",
        "",
        " design                    unit       213261    213262",
        " ─────────────────────────────────────────────────────",
        " alike                                     1         1",
        " crank                     mm            180       181",
        " speed                     rad/s     4.18879   4.18879",
        " rocker_acceleration_max   rad/s^2   10.2239   11.2239",
        " transmission_angle_min    deg       30.1234   31.1234",
        " cv                                  0.45423   0.45423",
        "",
    ]


def test_headings_are_folded_at_underscores_first(capsys, monkeypatch):
    lines = print_lines(capsys, monkeypatch, 72, COLUMNS, rows(9))
    assert [line.split() for line in lines[2:5]] == [
        ["rocker_"],
        ["acceleration_", "transmission_"],
        ["crank", "speed", "max", "angle_min"],
    ]
    assert not any("left out" in line for line in lines)


def test_other_columns_stay_on_any_terminal(capsys, monkeypatch):
    lines = print_lines(capsys, monkeypatch, 10, COLUMNS, rows(20), droppable=["speed", "crank"])
    assert "2 columns left out: crank, speed; a wider terminal shows all" in lines
    assert len({line.split()[0] for line in lines if line.startswith(" 2132")}) == 20
    assert print_lines(capsys, monkeypatch, 10, COLUMNS, [])[0] == "heading"


def test_texts_wrap_between_words(capsys, monkeypatch):
    table = [("column", ""), ("meaning", "")], [["transmission_angle_min", "smallest transmission angle over the turn"]]
    lines = print_lines(capsys, monkeypatch, 50, *table)
    assert lines[4:] == [
        " transmission_angle_min   smallest transmission",
        "                          angle over the turn",
        "",
    ]


@pytest.mark.parametrize("name", explore.list_mechanisms())
def test_no_word_about_a_parameter_is_cut(monkeypatch, name):
    """A column that cannot wrap stands before that of the meanings."""
    monkeypatch.setenv("COLUMNS", "80")

    _, out, _ = call("mechanisms", name)

    table = out.split("\n\n")[1].splitlines()
    start = table[0].index("meaning")
    texts = [line[start:].strip() for line in table[2:]]
    assert " ".join(filter(None, texts)) == " ".join(p.long_name for p in find_mechanism(name).parameters)


def test_no_column_is_left_out_without_need():
    """At random: without the columns left out the table fits, and with any of them it does not."""
    rng = random.Random(4)
    for _ in range(300):
        count, width = rng.randint(1, 9), rng.randint(20, 120)
        columns = [("_".join("x" * rng.randint(1, 9) for _ in range(rng.randint(1, 3))) + str(k), "mm")
                   for k in range(count)]  # fmt: skip
        cells = [["1" * rng.randint(1, 9) for _ in columns] for _ in range(rng.randint(0, 12))]
        droppable = [name for name, _ in columns[:0:-1]]
        fit = lay_out(columns, cells, width, droppable)
        assert fit.min_width <= width or len(fit.left_out) == count - 1
        for name in fit.left_out:
            more = lay_out(columns, cells, width, [other for other in fit.left_out if other != name])
            assert more.min_width > width, "there was room for it"


def test_a_pipe_gets_eighty_characters_and_the_metric_that_orders(in_results, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    names = "cv swing_angle time_ratio mean_output_ratio transmission_angle_min transmission_angle_max grashof_margin"
    objectives = [f"{name}:min" for name in names.split()]
    for options in ([], ["--quality"], ["--quality", "--fronts", "3", "--top", "0"]):
        out, _ = succeed("rank", *[word for objective in objectives for word in ("--metric", objective)], *options)
        *table, note = (line for line in out.splitlines() if "more lines" not in line)
        assert max(map(len, table)) <= 80
        assert note.endswith("; -o FILE.csv writes all")
        assert " cv" in " ".join(table)
    out, _ = succeed("show")
    assert max(map(len, out.splitlines())) <= 80


def test_a_design_on_a_very_narrow_terminal_keeps_its_names_and_values(in_results, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    out, _ = succeed("show", "--design", "0")
    assert ["crank", "80"] in [line.split() for line in out.splitlines()]
    assert "columns left out: unit, meaning; a wider terminal shows all\n" in out


def test_a_table_may_be_as_wide_as_the_terminal():
    columns, rows = [("design", ""), ("crank", "mm"), ("swing_angle", "deg")], [["17", "100.25", "20.5"]]
    plain = lay_out(columns, rows, 1000, [])
    assert lay_out(columns, rows, plain.min_width, []) == plain
    assert lay_out(columns, rows, plain.min_width - 1, []) != plain
