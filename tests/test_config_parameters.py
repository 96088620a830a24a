"""Messages about invalid entries of [parameters]."""

import re

import pytest
from studies import GOOD, with_parameter


@pytest.mark.parametrize(
    ("name", "value", "key", "reason"),
    [
        ("crank", "0", "", "must be greater than 0 mm, got 0"),
        ("crank", "nan", "", "nan is not a finite number"),
        ("crank", "true", "", "true is not a number"),
        ("crank", "1979-05-27", "", "1979-05-27 is not a number"),
        ("crank", '"5 cmm"', "", "unknown unit 'cmm'; did you mean 'mm'?"),
        ("crank", '"100"', "", "has no unit; write 100 without quotes"),
        ("speed", "0", "", "must be greater than 0 rad/s"),
        ("crank", "[]", "", "an empty list makes no designs"),
        ("crank", "[1, 2, 1]", "", "1 is listed twice"),
        ("crank", '[100, "10 cm"]', "", "'10 cm' is listed twice"),
        ("crank", "[1, [2]]", "", "[2] is not a number"),
        ("phases", "0", "", "must be a whole number from 1 to 12, got 0"),
        ("phases", "2.5", "", "must be a whole number from 1 to 12, got 2.5"),
        ("phases", "13", "", "must be a whole number from 1 to 12, got 13"),
        ("phases", "{ start = 1, stop = 2, num = 3 }", "", "every value must be a whole number from 1 to 12"),
        ("branch", "0", "", "must be 1 or -1, got 0"),
        ("crank", "{ start = 1, stop = 5, num = 0 }", ".num", "must be at least 1, got 0"),
        ("crank", "{ start = 1, stop = 5, num = 3.0 }", ".num", "must be a whole number without quotes, got 3.0"),
        ("crank", "{ start = 1, stop = 5, num = true }", ".num", "must be a whole number"),
        ("crank", "{ start = 1, stop = 5, num = 100000000000000000 }", ".num", "not distinct in double precision"),
        ("crank", "{ start = 5, stop = 1, num = 3 }", "", "start = 5 is above stop = 1; swap them"),
        ("crank", "{ start = 5, stop = 5, num = 3 }", "", "3 values from 5 to 5 are all the same"),
        ("crank", "{ start = -5, stop = 5, num = 3 }", ".start", "must be greater than 0 mm, got -5"),
        ("crank", '{ start = 1, stop = "2 kg", num = 3 }', ".stop", "cannot be converted to"),
        ("crank", "{ start = 1, stpo = 5, num = 3 }", ".stpo", "unknown key; did you mean 'stop'?"),
        ("crank", "{ start = 1, stop = 5 }", "", "the key 'num' is missing"),
        (
            "crank",
            "{ min = 1, max = 2 }",
            "",
            'needs the sampling method "sobol" or "latin-hypercube" or "random"; in a grid',
        ),
    ],
)
def test_bad_parameter(problems, name, value, key, reason):
    text, line = with_parameter(name, value)
    (problem,) = problems(text)
    assert problem.startswith(f"study.toml:{line}: parameters.{name}{key}: ")
    assert reason in problem


@pytest.mark.parametrize(
    ("value", "key", "reason"),
    [
        ("{ min = 2, max = 2 }", "", "min = 2 must be below max = 2"),
        ("{ min = 0, max = 2, log = true }", ".min", "must be greater than 0 mm, got 0"),
        ("{ min = 1, max = 2, log = 1 }", ".log", "must be true or false, got 1"),
        ("{ min = 1, mx = 2 }", ".mx", "unknown key; did you mean 'max'?"),
        ("{ min = 1 }", "", "the key 'max' is missing"),
        ("{ min = 1, max = inf }", ".max", "inf is not a finite number"),
    ],
)
@pytest.mark.parametrize("method", ["sobol", "latin-hypercube", "random"])
def test_bad_range(problems, value, key, reason, method):
    text, line = with_parameter("crank", value)
    (problem,) = problems(text + f'[sampling]\nmethod = "{method}"\ncount = 5\n')
    assert problem.startswith(f"study.toml:{line}: parameters.crank{key}: ")
    assert reason in problem


def test_range_of_a_parameter_of_choices(problems):
    text = GOOD + 'phases = { min = 1, max = 3 }\n[sampling]\nmethod = "sobol"\ncount = 5\n'
    (problem,) = problems(text)
    assert problem.startswith(
        "study.toml:7: parameters.phases: must be a whole number from 1 to 12, which a range does not"
    )


def test_missing_and_misspelt_parameters(problems):
    assert problems('mechanism = "crank-rocker"\n[parameters]\ncrank = 3\n') == [
        "study.toml:2: parameters: missing coupler, rocker, ground; crank-rocker needs crank, coupler, rocker, ground"
    ]
    assert problems(GOOD.replace("ground", "grund")) == [
        "study.toml:6: parameters.grund: unknown parameter; did you mean 'ground'?"
    ]
    assert "missing crank" in problems('mechanism = "crank-rocker"\n')[0]


def test_too_many_designs_to_number(problems):
    spaced = "{ start = 1, stop = 2, num = 9007199254740992 }"
    text = re.sub(r"(crank|coupler) = \d+", rf"\1 = {spaced}", GOOD)
    assert problems(text) == [
        "study.toml:2: parameters: the grid has more than 2^63 designs, too many to number; make it coarser"
    ]
